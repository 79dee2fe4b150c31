/* SPDX-License-Identifier: MIT */
/* Loading of the command line's scene into a daemon. */
#ifndef FARLIGHT_OPTIONS_LOADING_H
#define FARLIGHT_OPTIONS_LOADING_H

#include "options/job.h"
#include "progress.h"

/* A load; `job`, `progress` and the sharing of the scene are the caller's, the rest is initially zero. */
struct cli_loading {
    const struct cli_job *job;
    struct cli_progress *progress;
    bool again; /* the notes about the model are printed already */
    enum protocol_sharing sharing;
    const char *scene_name;              /* NULL: the model's file name */
    const char *const *daemon_arguments; /* arguments of a private daemon; NULL: none */
    unsigned timeout_ms;                 /* see fl_connect_options */
    struct fl_load_options load;
    struct fl_connection *connection;
    struct fl_scene *scene;
    unsigned warnings;
    uint64_t import_begin_ns, connect_begin_ns; /* monotonic clock */
};

/* Checks that the files exist, starts the importer and connects to the daemon. */
bool cli_loading_begin(struct cli_loading *loading, struct fl_error *error);
/* Waits for the scene. */
bool cli_loading_end(struct cli_loading *loading, struct fl_error *error);
/* Loads the files again over the same connection: the new scene replaces the old one, which stays after a
 * failure. Only data that the daemon lacks are sent. */
bool cli_loading_again(struct cli_loading *loading, struct fl_error *error);
/* Prints that `what` has changed, and how much was sent, to standard error, unless the job is quiet. */
void cli_loading_print_sent(const struct cli_loading *loading, const char *what);
void cli_loading_close(struct cli_loading *loading);
/* Sets the job's camera if the command line leaves it to the model. */
bool cli_choose_camera(struct cli_job *job, const struct fl_scene *scene, struct fl_error *error);

#endif
