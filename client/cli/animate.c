/* SPDX-License-Identifier: MIT */
#include "cli/cli.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

#define TURN_DEGREES 360.0

enum key { KEY_FRAMES = 0x300, KEY_FPS, KEY_ORBIT, KEY_KEYS, KEY_SHARD, KEY_RESUME, KEY_RETRIES };

#define DEFAULT_RETRIES 5u

struct animation {
    struct cli_job job;
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
    {NULL, 0, NULL, 0, "Parts, and what goes wrong:", -1},
    {"shard", KEY_SHARD, "K/N", 0, "Only every N-th frame of the range, beginning with the K-th", 0},
    {"resume", KEY_RESUME, NULL, 0, "Leave out frames whose files are there, complete and of the wanted size", 0},
    {"retries", KEY_RETRIES, "N", 0,
     "How often in a row a lost daemon is sought again, 0 to 1000 (default 5); nothing is lost by it", 0},
    {0}};

/* An error of lib/text.h gets the option's name. */
static error_t named(struct cli_job *job, bool good, const char *field)
{
    if (good)
        return 0;
    snprintf(job->error.field, sizeof job->error.field, "%s", field);
    return EINVAL;
}

static error_t parse_series(struct cli_job *job, int key, const char *value)
{
    struct cli_series *series = &job->series;
    uint64_t number = 0;
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_FRAMES:
        series->has_range = true;
        return named(
            job, fl_text_range(value, &series->range.first, &series->range.last, &series->range.step, &job->error),
            "--frames");
    case KEY_FPS:
        status = named(job, fl_text_real(value, 0.001, 100000, &real, &job->error), "--fps");
        job->options.frames_per_second = (float)real;
        return status;
    case KEY_ORBIT:
        job->is_orbit = true;
        return value == NULL
                   ? 0
                   : named(job, fl_text_real(value, -1e6, 1e6, &series->orbit_degrees, &job->error), "--orbit");
    case KEY_SHARD:
        return named(job, fl_text_shard(value, &series->shard_part, &series->shard_parts, &job->error), "--shard");
    case KEY_RESUME:
        series->resume = true;
        return 0;
    case KEY_RETRIES:
        status = named(job, fl_text_integer(value, 0, 1000, &number, &job->error), "--retries");
        series->retries = (unsigned)number;
        return status;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct animation *animation = state->input;
    struct cli_job *job = &animation->job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case KEY_KEYS:
        animation->keys_path = value;
        return 0;
    case ARGP_KEY_ARG:
        if (job->model != NULL)
            return cli_usage(job, value, "only one model can be rendered");
        job->model = value;
        return 0;
    default:
        return parse_series(job, key, value);
    }
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
    if (!job->series.has_range)
        return cli_usage(job, "--frames", "no range of frames is given, such as 1-120") == 0;
    if (job->options.frames_per_second <= 0)
        job->options.frames_per_second = 24;
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
        job->options.camera_path = PROTOCOL_CAMERA_PATH_ORBIT;
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
    struct animation animation = {0};
    const bool begun = cli_job_begin(&animation.job);
    animation.job.series.orbit_degrees = TURN_DEGREES;
    animation.job.series.retries = DEFAULT_RETRIES;
    const bool good = begun && argp_parse(&argp, argc, argv, 0, NULL, &animation) == 0 && complete(&animation);
    const int status = good ? cli_run_job(&animation.job, true) : cli_report(&animation.job.error);
    free(animation.keys);
    return status;
}
