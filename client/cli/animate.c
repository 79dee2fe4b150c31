/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#define TURN_DEGREES 360.0
#define RADIANS_PER_DEGREE 0.017453292519943295

enum key { KEY_FRAMES = 0x300, KEY_FPS, KEY_ORBIT, KEY_KEYS };

struct animation {
    struct cli_job job;
    bool has_frames;
    double orbit_degrees;
    const char *keys_path;
    struct record_camera_key *keys;
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Animation:", -2},
    {"frames", KEY_FRAMES, "A-B[:STEP]", 0, "Which frames", 0},
    {"fps", KEY_FPS, "N", 0, "Frames per second (default 24); frame A is at time 0", 0},
    {"orbit", KEY_ORBIT, "DEGREES", OPTION_ARG_OPTIONAL,
     "Turn about the scene, or about --look-at; over the range in all (default 360; --orbit=180 with the sign =)",
     0},
    {"keys", KEY_KEYS, "FILE.json", 0,
     "Camera keys: array of {\"time\", \"eye\", \"look_at\", \"up\", \"fov\"}; seconds, degrees", 0},
    {0}};

static error_t parse_frames(struct animation *animation, const char *value)
{
    struct fl_job_options *wanted = &animation->job.options;
    animation->has_frames = true;
    if (fl_text_range(value, &wanted->first_frame, &wanted->last_frame, &wanted->frame_step,
                      &animation->job.error))
        return 0;
    snprintf(animation->job.error.field, sizeof animation->job.error.field, "--frames");
    return EINVAL;
}

static error_t parse_real(struct animation *animation, const char *field, const char *value, double least,
                          double greatest, double *number)
{
    if (fl_text_real(value, least, greatest, number, &animation->job.error))
        return 0;
    snprintf(animation->job.error.field, sizeof animation->job.error.field, "%s", field);
    return EINVAL;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct animation *animation = state->input;
    struct cli_job *job = &animation->job;
    double fps = 0;
    error_t status = 0;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case KEY_FRAMES:
        return parse_frames(animation, value);
    case KEY_FPS:
        status = parse_real(animation, "--fps", value, 0.001, 100000, &fps);
        job->options.frames_per_second = (float)fps;
        return status;
    case KEY_ORBIT:
        job->is_orbit = true;
        return value != NULL ? parse_real(animation, "--orbit", value, -1e6, 1e6, &animation->orbit_degrees) : 0;
    case KEY_KEYS:
        animation->keys_path = value;
        return 0;
    case ARGP_KEY_ARG:
        if (job->model != NULL)
            return cli_usage(job, value, "only one model can be rendered");
        job->model = value;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* The turn is reached one frame after the last, so that a full turn repeats without a doubled frame. */
static void complete_orbit(struct animation *animation)
{
    struct fl_job_options *wanted = &animation->job.options;
    const uint32_t frames = (wanted->last_frame - wanted->first_frame) / wanted->frame_step + 1;
    wanted->camera_path = PROTOCOL_CAMERA_PATH_ORBIT;
    wanted->orbit_turn = (float)(animation->orbit_degrees * RADIANS_PER_DEGREE);
    wanted->orbit_seconds = (float)frames * (float)wanted->frame_step / wanted->frames_per_second;
}

static bool complete_keys(struct animation *animation)
{
    struct cli_job *job = &animation->job;
    size_t count = 0;
    if (!fl_camera_keys_load(animation->keys_path, &animation->keys, &count, &job->error))
        return false;
    job->options.camera_path = PROTOCOL_CAMERA_PATH_KEYS;
    job->options.keys = animation->keys;
    job->options.key_count = count;
    return true;
}

static bool complete(struct animation *animation)
{
    struct cli_job *job = &animation->job;
    const bool has_keys = animation->keys_path != NULL;
    if (!animation->has_frames)
        return cli_usage(job, "--frames", "no range of frames is given, such as 1-120") == 0;
    if (job->options.frames_per_second <= 0)
        job->options.frames_per_second = 24;
    job->options.time_origin_frame = job->options.first_frame;
    if (!cli_job_complete(job, true))
        return false;
    if (has_keys && (job->is_orbit || job->camera != NULL || job->has_eye))
        return cli_usage(job, "--keys", "cannot go with --orbit, --camera or --eye") == 0;
    if (job->is_orbit && job->camera != NULL)
        return cli_usage(job, "--orbit", "cannot go with --camera; it can begin at --eye and --look-at") == 0;
    if (has_keys)
        return complete_keys(animation);
    /* Frames of a camera that stands still would all be alike. */
    job->is_orbit = job->is_orbit || job->camera == NULL;
    if (job->is_orbit)
        complete_orbit(animation);
    return true;
}

int cli_animate(int argc, char **argv)
{
    static const struct argp_child children[] = {{&cli_job_argp, 0, NULL, 0}, {0}};
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --frames A-B -o 'DIR/%04d.exr'",
        .doc = "Render a series of pictures along a camera's path (default: an orbit).\v"
               "In the name of the images %d or %04d stands for the frame's number, %% for a percent sign.",
        .children = children};
    struct animation animation = {.orbit_degrees = TURN_DEGREES};
    const bool good = cli_job_begin(&animation.job) && argp_parse(&argp, argc, argv, 0, NULL, &animation) == 0 &&
                      complete(&animation);
    const int status = good ? cli_run_job(&animation.job, true) : cli_report(&animation.job.error);
    free(animation.keys);
    return status;
}
