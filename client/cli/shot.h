/* SPDX-License-Identifier: MIT */
/* A request file: what `animate` is to render, as JSON; farlight-shot(5) and shot.schema.json say what may stand
 * in it. A mistake is FL_ERROR_ARGUMENT with the file as its field; the text begins with the line and the way to
 * the value ("line 12: camera.eye: ..."), and there is a remedy. */
#ifndef FARLIGHT_CLIENT_CLI_SHOT_H
#define FARLIGHT_CLIENT_CLI_SHOT_H

#include "cli/cli.h"
#include "lib/json_text.h"

struct cli_shot {
    const char *path;
    char folder[4096]; /* the file's: what it names is sought from there */
    struct fl_json json;
    void **owned; /* strings and numbers that the job refers to */
    size_t owned_count, owned_capacity;
};

/* What the command line says itself and the file is not asked for. */
struct cli_shot_given {
    bool camera, clips, output, model, aperture, focus, up, fov;
};

/* Options that belong to animations alone: 0, an errno with job->error set, or ARGP_ERR_UNKNOWN. */
typedef error_t cli_shot_set(void *user, const char *option, const char *value);

bool cli_shot_load(struct cli_shot *shot, const char *path, struct fl_error *error);
/* Sets in `job` what the file says, as options of the command line would; `set` is asked first. The job refers to
 * the shot from then on. */
bool cli_shot_apply(struct cli_shot *shot, struct cli_job *job, const struct cli_shot_given *given,
                    cli_shot_set *set, void *user);
void cli_shot_finish(struct cli_shot *shot);

#endif
