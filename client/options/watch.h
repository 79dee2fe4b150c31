/* SPDX-License-Identifier: MIT */
/* Watching of files, those of a scene, for --watch. The folders are watched, since editors replace a file by
 * renaming another one; a file has changed if its identity, size or time differs. Where the kernel reports
 * nothing, as on network file systems, files are checked once a second. */
#ifndef FARLIGHT_OPTIONS_WATCH_H
#define FARLIGHT_OPTIONS_WATCH_H

#include "lib/farlight.h"

#include <sys/stat.h>

struct cli_watched {
    char *path;
    struct stat seen; /* last state; all zero: the file is missing */
};

/* Watched files; initially zero, then cli_watch_begin_models(). */
struct cli_watch {
    int fd; /* inotify */
    struct cli_watched *files;
    size_t count, capacity;
    uint64_t check_ns;   /* latest time of the next check */
    uint64_t changed_ns; /* time of the last change; 0: nothing has changed */
};

/* Begins with models, and an environment (NULL: none), before they are read, so that changes during the reading
 * count. */
bool cli_watch_begin_models(struct cli_watch *watch, const struct fl_model *models, size_t count,
                            const char *environment, struct fl_error *error);
/* Adds a file, which need not exist; a known one keeps its state. */
bool cli_watch_add(struct cli_watch *watch, const char *path, struct fl_error *error);
/* Adds all files of the scene. */
bool cli_watch_scene(struct cli_watch *watch, const struct fl_scene *scene, struct fl_error *error);
/* True, once, after a file has changed and writing has settled. Never waits. */
bool cli_watch_has_changed(struct cli_watch *watch, uint64_t now_ns);
/* Waits for a change, and serves the connection meanwhile. False: interrupted, or the daemon is lost. */
bool cli_watch_wait(struct cli_watch *watch, struct fl_connection *connection, struct fl_error *error);
void cli_watch_end(struct cli_watch *watch);

/* True if all edits assign values and none adds or multiplies: they can be repeated in a scene that has them
 * and whose files are read again. */
bool cli_watch_can_edit_again(const struct fl_assignment *edits, size_t count);

#endif
