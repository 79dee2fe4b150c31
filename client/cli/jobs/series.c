/* SPDX-License-Identifier: MIT */
/* Options of a series of frames: the range, the camera's motion, and frames made from others. */
#include "series.h"
#include "options/complete.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define GROUP (-2) /* above the options of a picture */

enum key { KEY_FRAMES = 0x300, KEY_FPS, KEY_ORBIT, KEY_KEYS, KEY_UPSAMPLE };

static const struct argp_option options[] = {
    {"frames", KEY_FRAMES, "A-B[:STEP]", 0, "Render these frames (default: once through the clips)", GROUP},
    {"fps", KEY_FPS, "N", 0, "Set frames per second (default 24); frame A is at time 0", GROUP},
    {"orbit", KEY_ORBIT, "DEGREES", OPTION_ARG_OPTIONAL,
     "Turn around the scene, or around --look-at, by this angle over the range (default 360; write --orbit=180)",
     GROUP},
    {"keys", KEY_KEYS, "FILE.json", 0,
     "Read camera keys: array of {\"time\", \"eye\", \"look_at\", \"up\", \"fov\"}; seconds, degrees", GROUP},
    {"upsample", KEY_UPSAMPLE, "N", 0,
     "Render every N-th frame, up to 64, and make frames between from the depth layers of the nearest (default 1)",
     GROUP},
    {0}};

static error_t set_option(struct cli_job *job, int key, const char *value)
{
    struct cli_series *series = &job->series;
    double real = (double)job->options.frames_per_second;
    uint64_t whole = job->options.picture.upsample;
    bool good = true;
    switch (key) {
    case KEY_FRAMES:
        series->has_range = true;
        good = fl_text_range(value, &series->range.first, &series->range.last, &series->range.step, &job->error);
        break;
    case KEY_FPS:
        good = fl_text_real(value, 0.001, 100000, &real, &job->error);
        job->options.frames_per_second = (float)real;
        break;
    case KEY_ORBIT:
        job->camera.is_orbit = true;
        good = !value || fl_text_real(value, -1e6, 1e6, &series->orbit_degrees, &job->error);
        break;
    case KEY_KEYS:
        job->camera.keys_file = value;
        break;
    case KEY_UPSAMPLE:
        good = fl_text_integer(value, 1, 64, &whole, &job->error);
        job->options.picture.upsample = (uint32_t)whole;
        break;
    default:
        return ARGP_ERR_UNKNOWN;
    }
    return good ? 0 : EINVAL;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_job *job = state->input;
    const error_t status = set_option(job, key, value);
    for (const struct argp_option *option = options; status == EINVAL && option->name; option++)
        if (option->key == key) /* adds the option's name to an error of lib/text.h */
            snprintf(job->error.field, sizeof(job->error.field), "--%s", option->name);
    return status;
}

const struct argp *cli_series_argp(void)
{
    static const struct argp argp = {.options = options, .parser = parse};
    return &argp;
}

error_t cli_series_set(struct cli_job *job, const char *name, const char *value)
{
    for (const struct argp_option *option = options; option->name; option++)
        if (strcmp(option->name, name) == 0)
            return set_option(job, option->key, value);
    return ARGP_ERR_UNKNOWN;
}

static bool load_keys(struct cli_job *job)
{
    size_t count = 0;
    if (!fl_camera_keys_load(job->camera.keys_file, &job->series.keys, &count, &job->error))
        return false;
    job->options.camera.camera_path = PROTOCOL_CAMERA_KEYS;
    job->options.keys = job->series.keys;
    job->options.keys_count = (uint32_t)count;
    return true;
}

bool cli_series_complete(struct cli_job *job)
{
    if (!job->series.has_range && job->clips.count == 0 && !job->script && !job->camera.is_orbit) {
        cli_usage(job, "--frames", "no range of frames is given");
        return fl_error_remedy(&job->error, "for example --frames 1-120; an orbit, a clip or a script needs none");
    }
    if (!cli_job_complete(job, true))
        return false;
    if (job->camera.keys_file && (job->camera.is_orbit || job->camera.name || job->camera.has_eye))
        return cli_usage(job, "--keys", "cannot be combined with --orbit, --camera or --eye") == 0;
    if (job->camera.is_orbit && job->camera.name)
        return cli_usage(job, "--orbit",
                         "cannot be combined with --camera; use --eye and --look-at to place its beginning") == 0;
    if (job->camera.keys_file)
        return load_keys(job);
    /* Without motion of the camera or anything else, all frames would be equal. */
    job->camera.is_orbit = job->camera.is_orbit || (!job->camera.name && !job->script && job->clips.count == 0);
    if (job->camera.is_orbit)
        job->options.camera.camera_path = PROTOCOL_CAMERA_ORBIT;
    return true;
}

void cli_series_finish(struct cli_job *job)
{
    free(job->series.keys);
    job->series.keys = NULL;
}
