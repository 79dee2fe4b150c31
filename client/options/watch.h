/* SPDX-License-Identifier: MIT */
/* Files that are waited for to change: those of a scene, for --watch. Their folders are watched, as an editor
 * replaces a file by renaming another one; what counts is whether a file is another one than before, or has
 * another size or time. Where the kernel reports nothing, as on network file systems, they are looked at once a
 * second. */
#ifndef FARLIGHT_OPTIONS_WATCH_H
#define FARLIGHT_OPTIONS_WATCH_H

#include "lib/farlight.h"

#include <sys/stat.h>

struct cli_watched {
    char *path;
    struct stat seen; /* all zero: there is none */
};

/* Zero, and then cli_watch_begin(). */
struct cli_watch {
    int fd; /* inotify */
    struct cli_watched *files;
    size_t count, capacity;
    uint64_t look_ns;    /* when they are looked at next, at the latest */
    uint64_t changed_ns; /* since when nothing has changed any more; 0: nothing has changed */
};

/* Begins with models, and an environment (NULL: none), before they are read: what changes while that happens has
 * changed. */
bool cli_watch_begin_models(struct cli_watch *watch, const struct fl_model *models, size_t count,
                            const char *environment, struct fl_error *error);
/* A file from now on, which need not exist; one that is known is left as it is. */
bool cli_watch_add(struct cli_watch *watch, const char *path, struct fl_error *error);
/* All files of the scene. */
bool cli_watch_scene(struct cli_watch *watch, const struct fl_scene *scene, struct fl_error *error);
/* True, once, when a file has changed since the last time and all writing has settled. Never waits. */
bool cli_watch_has_changed(struct cli_watch *watch, uint64_t now_ns);
/* Waits for that, and serves the connection meanwhile. False: interrupted, or the daemon is lost. */
bool cli_watch_wait(struct cli_watch *watch, struct fl_connection *connection, struct fl_error *error);
void cli_watch_end(struct cli_watch *watch);

/* Whether the edits give values, and do not add to them or multiply them: they can be made again in a scene that
 * has them and whose files are read again. */
bool cli_watch_can_edit_again(const struct fl_assignment *edits, size_t count);

#endif
