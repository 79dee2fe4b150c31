/* SPDX-License-Identifier: MIT */
/* A scene that is up for other clients: on a daemon of its own, which ends with the command, or on a running one.
 * A lost daemon is waited for, and gets the scene again. With the job's `watch` the scene follows its files. */
#ifndef FARLIGHT_OPTIONS_SHARING_H
#define FARLIGHT_OPTIONS_SHARING_H

#include "loading.h"
#include "progress.h"
#include "watch.h"

/* A Unix socket for a daemon of one's own, in $XDG_RUNTIME_DIR or a new folder that only its owner can enter. */
struct cli_socket {
    char address[300];
    char folder[64]; /* created for it; empty: there is none */
};
/* False: *error names no field. */
bool cli_socket_choose(struct cli_socket *chosen, struct fl_error *error);
/* What the daemon has left of it. */
void cli_socket_remove(const struct cli_socket *chosen);

/* `job`, `loading.scene_name` and `loading.daemon_arguments` are the caller's, and `restarts`: a daemon of its own
 * that has failed is started again, in place of an error. */
struct cli_sharing {
    const struct cli_job *job;
    bool restarts;
    struct cli_progress progress;
    struct cli_loading loading;
    struct cli_watch watch;
};
/* Loads the scene. */
bool cli_sharing_begin(struct cli_sharing *sharing, struct fl_error *error);
/* Serves until it is interrupted, which is success, or the daemon is gone for good. */
bool cli_sharing_stay(struct cli_sharing *sharing, struct fl_error *error);
/* Also after a failed beginning. */
void cli_sharing_end(struct cli_sharing *sharing);

#endif
