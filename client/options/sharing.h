/* SPDX-License-Identifier: MIT */
/* A scene shared with other clients, on a private daemon, which ends with the command, or on a running one.
 * After the loss of a daemon the scene is loaded again. With the job's `watch` the scene follows its files. */
#ifndef FARLIGHT_OPTIONS_SHARING_H
#define FARLIGHT_OPTIONS_SHARING_H

#include "loading.h"
#include "progress.h"
#include "watch.h"

/* A Unix socket for a private daemon, in $XDG_RUNTIME_DIR or a new folder that only its owner can enter. */
struct cli_socket {
    char address[300];
    char folder[64]; /* created for the socket; empty: none */
};
/* Chooses a socket. False: *error names no field. */
bool cli_socket_choose(struct cli_socket *chosen, struct fl_error *error);
/* Removes the daemon's remains. */
void cli_socket_remove(const struct cli_socket *chosen);

/* A shared scene. The caller sets `job`, `loading.scene_name`, `loading.daemon_arguments`, and `restarts`: a
 * private daemon that fails is started again instead of causing an error. */
struct cli_sharing {
    const struct cli_job *job;
    bool restarts;
    struct cli_progress progress;
    struct cli_loading loading;
    struct cli_watch watch;
};
/* Loads the scene. */
bool cli_sharing_begin(struct cli_sharing *sharing, struct fl_error *error);
/* Serves until it is interrupted, which is success, or the daemon is finally lost. */
bool cli_sharing_stay(struct cli_sharing *sharing, struct fl_error *error);
/* Must follow cli_sharing_begin, also after a failure. */
void cli_sharing_end(struct cli_sharing *sharing);

#endif
