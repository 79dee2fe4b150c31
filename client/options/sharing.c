/* SPDX-License-Identifier: MIT */
/* Sharing of a scene on a daemon. */
#include "sharing.h"
#include "job.h"
#include "loading.h"
#include "progress.h"
#include "retry.h"
#include "talk.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define WAIT_MS 3600000u

/* ---- an address ---- */

bool cli_socket_choose(struct cli_socket *chosen, struct fl_error *error)
{
    const char *folder = getenv("XDG_RUNTIME_DIR");
    *chosen = (struct cli_socket){.folder = ""};
    if (!folder || folder[0] != '/') {
        /* The folder of temporary files is writable for everyone, so the socket goes into a subfolder of mode
         * 0700. */
        snprintf(chosen->folder, sizeof(chosen->folder), "%s/farlight-XXXXXX", P_tmpdir);
        folder = mkdtemp(chosen->folder);
    }
    if (!folder) {
        chosen->folder[0] = '\0';
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "cannot create a folder for a socket in %s: %s", P_tmpdir,
                     strerror(errno));
        return fl_error_remedy(error, "set XDG_RUNTIME_DIR");
    }
    snprintf(chosen->address, sizeof(chosen->address), "unix:%s/farlight-%ld.sock", folder, (long)getpid());
    return true;
}

/* Removes the remains; the daemon removes its socket itself if it can. */
void cli_socket_remove(const struct cli_socket *chosen)
{
    if (chosen->folder[0] == '\0')
        return;
    unlink(chosen->address + strlen("unix:"));
    rmdir(chosen->folder);
}

/* ---- serving ---- */

static bool watch_scene(struct cli_sharing *sharing, struct fl_error *error)
{
    return !sharing->job->input.watch || cli_watch_scene(&sharing->watch, sharing->loading.scene, error);
}

/* Waits until files have changed, and reloads them. Unreadable files are reported, and the scene stays. */
static bool follow(struct cli_sharing *sharing, struct fl_error *error)
{
    struct cli_loading *loading = &sharing->loading;
    if (!cli_watch_wait(&sharing->watch, loading->connection, error))
        return false;
    const bool is_read = cli_loading_again(loading, error);
    cli_progress_clear(&sharing->progress);
    if (is_read) {
        cli_loading_print_sent(loading, sharing->job->input.model);
        return watch_scene(sharing, error);
    }
    if (error->code == FL_ERROR_INTERRUPTED || cli_is_temporary(error))
        return false;
    cli_report(error);
    *error = (struct fl_error){0};
    return true;
}

/* Serves until it is interrupted, which is success, or the daemon is lost. */
static bool stay(struct cli_sharing *sharing, struct fl_error *error)
{
    while (sharing->job->input.watch ? follow(sharing, error)
                                     : fl_connection_wait(sharing->loading.connection, WAIT_MS, error))
        continue;
    if (error->code != FL_ERROR_INTERRUPTED)
        return false;
    *error = (struct fl_error){0};
    return true;
}

static bool load_again(struct cli_loading *loading, const struct cli_job *job, struct fl_error *error)
{
    *error = (struct fl_error){0};
    loading->job = job;
    return cli_loading_begin(loading, error) && cli_loading_end(loading, error);
}

/* Attaches again to a running daemon, which may have kept the scene; a new one gets it under the same name. */
static bool load_after_loss(struct cli_sharing *sharing, struct fl_error *error)
{
    struct cli_loading *loading = &sharing->loading;
    struct cli_job attaching = *sharing->job;
    attaching.input.scene = loading->scene_name;
    if (sharing->job->daemon.server) {
        const bool attached = load_again(loading, &attaching, error);
        loading->job = sharing->job;
        if (attached || error->server_code != PROTOCOL_ERROR_UNKNOWN_ID)
            return attached;
        cli_loading_close(loading);
    }
    return load_again(loading, sharing->job, error);
}

static bool recover(struct cli_sharing *sharing, struct fl_error *error)
{
    struct cli_loading *loading = &sharing->loading;
    const struct cli_job *job = sharing->job;
    unsigned failures = 0;
    loading->again = true;
    while ((job->daemon.server || sharing->restarts) && cli_is_temporary(error)) {
        const uint32_t pause_ms = cli_retry_pause_ms(++failures, error->retry_after_ms);
        cli_progress_clear(&sharing->progress);
        cli_report(error);
        cli_loading_close(loading);
        if (!job->talk.quiet)
            fprintf(stderr, "farlight: trying again in %.1f s\n", pause_ms * 1e-3);
        if (!cli_retry_wait(pause_ms, error))
            return false;
        if (!load_after_loss(sharing, error) || !watch_scene(sharing, error))
            continue;
        cli_progress_clear(&sharing->progress);
        if (!job->talk.quiet)
            fputs("farlight: the scene is shared again\n", stderr);
        return true;
    }
    return false;
}

bool cli_sharing_begin(struct cli_sharing *sharing, struct fl_error *error)
{
    struct cli_loading *loading = &sharing->loading;
    loading->job = sharing->job;
    loading->progress = &sharing->progress;
    loading->sharing = PROTOCOL_SHARING_SHARED;
    cli_progress_begin(&sharing->progress, &sharing->job->talk);
    const struct cli_job *job = sharing->job;
    const bool is_up =
        (!job->input.watch || cli_watch_begin_models(&sharing->watch, job->input.models, job->input.count,
                                                     job->input.environment, error)) &&
        cli_loading_begin(loading, error) && cli_loading_end(loading, error) && watch_scene(sharing, error);
    cli_progress_end(&sharing->progress, is_up);
    return is_up;
}

bool cli_sharing_stay(struct cli_sharing *sharing, struct fl_error *error)
{
    while (!stay(sharing, error))
        if (!recover(sharing, error))
            break;
    if (error->code == FL_ERROR_INTERRUPTED)
        *error = (struct fl_error){0};
    return error->code == FL_ERROR_NONE;
}

void cli_sharing_end(struct cli_sharing *sharing)
{
    if (sharing->loading.connection)
        /* The daemon still gets an orderly goodbye */
        fl_connection_set_interrupt(sharing->loading.connection, 0);
    cli_loading_close(&sharing->loading);
    cli_watch_end(&sharing->watch);
}
