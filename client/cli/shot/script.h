/* SPDX-License-Identifier: MIT */
/* A shot file: the request of `animate` as JSON; farlight-shot(5) and shot.schema.json describe it. A mistake is
 * FL_ERROR_ARGUMENT with the file as its field; the text begins with the line and the path of the value ("line 12:
 * camera.eye: ..."), and there is a remedy. */
#ifndef FARLIGHT_CLI_SHOT_SCRIPT_H
#define FARLIGHT_CLI_SHOT_SCRIPT_H

#include "lib/json_text.h"
#include "options/job.h"

struct cli_shot {
    const char *path;
    char folder[4096]; /* the file's: its paths are relative to this folder */
    struct fl_json json;
    void **owned; /* strings and numbers that the job refers to */
    size_t owned_count, owned_capacity;
};

/* Options that the command line sets and the file therefore does not. */
struct cli_shot_given {
    bool camera, clips, output, model, aperture, focus, up, fov;
};

/* Options that belong to animations alone: 0, an errno with job->error set, or ARGP_ERR_UNKNOWN. */
typedef error_t cli_shot_set(void *user, const char *option, const char *value);

bool cli_shot_load(struct cli_shot *shot, const char *path, struct fl_error *error);
/* Applies the file to `job`, as options of the command line would; `set` has precedence. The job refers to the
 * shot from then on. */
bool cli_shot_apply(struct cli_shot *shot, struct cli_job *job, const struct cli_shot_given *given,
                    cli_shot_set *set, void *user);
void cli_shot_finish(struct cli_shot *shot);

#endif
