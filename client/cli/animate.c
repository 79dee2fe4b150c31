/* SPDX-License-Identifier: MIT */
#include "cli/shot.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define TURN_DEGREES 360.0

enum key {
    KEY_FRAMES = 0x300,
    KEY_FPS,
    KEY_ORBIT,
    KEY_KEYS,
    KEY_SHARD,
    KEY_RESUME,
    KEY_SCRIPT,
    KEY_LOSSLESS,
    KEY_DRY_RUN,
    KEY_SCENE,
    KEY_UPSAMPLE
};

struct animation {
    struct cli_job job;
    const char *script_path;
    struct cli_shot shot;
    bool dry_run;
    const char *keys_path;
    struct record_camera_key *keys;
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Animation:", -2},
    {"script", KEY_SCRIPT, "SHOT.json", 0,
     "Read what to render from a file (farlight-shot(5)); options of the command line override it", 0},
    {"scene", KEY_SCENE, "NAME", 0,
     "Use a shared scene at --server in place of MODEL ('farlight scenes' lists them)", 0},
    {"dry-run", KEY_DRY_RUN, NULL, 0, "Check options and script without rendering", 0},
    {"frames", KEY_FRAMES, "A-B[:STEP]", 0, "Render these frames (default: once through the clips)", 0},
    {"fps", KEY_FPS, "N", 0, "Set frames per second (default 24); frame A is at time 0", 0},
    {"orbit", KEY_ORBIT, "DEGREES", OPTION_ARG_OPTIONAL,
     "Turn around the scene, or around --look-at, by this angle over the range (default 360; write --orbit=180)",
     0},
    {"keys", KEY_KEYS, "FILE.json", 0,
     "Read camera keys: array of {\"time\", \"eye\", \"look_at\", \"up\", \"fov\"}; seconds, degrees", 0},
    {"upsample", KEY_UPSAMPLE, "N", 0,
     "Render every N-th frame, up to 64, and make those between from the depth layers of the nearest (default 1)",
     0},
    {"lossless", KEY_LOSSLESS, NULL, 0, "Write a lossless video, for .mkv", 0},
    {NULL, 0, NULL, 0, "Parts:", -1},
    {"shard", KEY_SHARD, "K/N", 0, "Render only every N-th frame of the range, beginning with the K-th", 0},
    {"resume", KEY_RESUME, NULL, 0, "Skip frames whose files exist, are complete and have the requested size", 0},
    {0}};

/* An error of lib/text.h gets the option's name. */
static error_t named(struct cli_job *job, bool good, const char *field)
{
    if (good)
        return 0;
    snprintf(job->error.field, sizeof(job->error.field), "%s", field);
    return EINVAL;
}

static error_t parse_series(struct cli_job *job, int key, const char *value)
{
    struct cli_series *series = &job->series;
    double real = 0;
    uint64_t whole = 1;
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
        return !value ? 0
                      : named(job, fl_text_real(value, -1e6, 1e6, &series->orbit_degrees, &job->error), "--orbit");
    case KEY_SHARD:
        return named(job, fl_text_shard(value, &series->shard_part, &series->shard_parts, &job->error), "--shard");
    case KEY_RESUME:
        series->resume = true;
        return 0;
    case KEY_UPSAMPLE:
        status = named(job, fl_text_integer(value, 1, 64, &whole, &job->error), "--upsample");
        job->options.upsample = (uint32_t)whole;
        return status;
    case KEY_LOSSLESS:
        job->lossless = true;
        return 0;
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
    case KEY_SCRIPT:
        animation->script_path = value;
        return 0;
    case KEY_DRY_RUN:
        animation->dry_run = true;
        return 0;
    case KEY_SCENE:
        job->scene = value;
        return 0;
    case ARGP_KEY_ARG:
        if (job->model)
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
    job->options.camera_path = PROTOCOL_CAMERA_KEYS;
    job->options.keys = animation->keys;
    job->options.keys_count = (uint32_t)count;
    return true;
}

static bool complete(struct animation *animation)
{
    struct cli_job *job = &animation->job;
    const bool has_keys = animation->keys_path != NULL;
    if (!job->series.has_range && job->clip_count == 0 && !job->script) {
        cli_usage(job, "--frames", "no range of frames is given");
        return fl_error_remedy(&job->error, "for example --frames 1-120; a clip or a script needs none");
    }
    if (!cli_job_complete(job, true))
        return false;
    if (has_keys && (job->is_orbit || job->camera || job->has_eye))
        return cli_usage(job, "--keys", "cannot be combined with --orbit, --camera or --eye") == 0;
    if (job->is_orbit && job->camera)
        return cli_usage(job, "--orbit",
                         "cannot be combined with --camera; it can begin at --eye and --look-at") == 0;
    if (has_keys)
        return complete_keys(animation);
    /* All frames would be alike if neither the camera nor anything else moves. */
    job->is_orbit = job->is_orbit || (!job->camera && !job->script && job->clip_count == 0);
    if (job->is_orbit)
        job->options.camera_path = PROTOCOL_CAMERA_ORBIT;
    return true;
}

static bool begin(struct animation *animation)
{
    const bool begun = cli_job_begin(&animation->job, fl_render_defaults());
    animation->job.series.orbit_degrees = TURN_DEGREES;
    return begun;
}

/* The script's members that only animations have. */
static error_t set_series(void *user, const char *name, const char *value)
{
    struct animation *animation = user;
    for (const struct argp_option *option = options; option->name || option->doc; option++)
        if (option->name && strcmp(option->name, name) == 0)
            return parse_series(&animation->job, option->key, value);
    return ARGP_ERR_UNKNOWN;
}

/* The script sets options that the command line does not. `typed` was read from the command line alone. */
static bool apply_script(struct animation *animation, const struct animation *typed)
{
    const struct cli_job *job = &typed->job;
    const struct cli_shot_given given = {.camera = job->camera || job->has_eye || job->has_look_at ||
                                                   job->is_orbit || typed->keys_path,
                                         .clips = job->clip_count > 0,
                                         .output = job->output != NULL,
                                         .aperture = job->has_aperture,
                                         .focus = job->has_focus,
                                         .up = job->has_up,
                                         .fov = job->has_fov};
    return cli_shot_load(&animation->shot, typed->script_path, &animation->job.error) &&
           cli_shot_apply(&animation->shot, &animation->job, &given, set_series, animation);
}

static bool read_all(struct animation *animation, int argc, char **argv)
{
    const struct argp_child children[] = {{cli_job_argp(), 0, NULL, 0}, {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --frames A-B -o 'DIR/%04d.exr'\nMODEL --clip NAME -o MOVIE.mp4\n"
                    "--scene NAME --server ADDRESS --frames A-B -o 'DIR/%04d.exr'\n--script SHOT.json",
        .doc =
            "Render a series of pictures or a video of a model, with clips or a moving camera.\v"
            "In the name of the images write %d or %04d for the frame's number and %% for a percent sign. Videos "
            "end "
            "in .mp4, .mkv or .y4m; '-' is standard output, as y4m.",
        .children = children};
    struct animation typed = {0};
    bool good = begin(&typed) && cli_parse(&argp, argc, argv, 0, &typed) == 0;
    if (!good || !typed.script_path) {
        *animation = typed;
        return good;
    }
    /* The command line again, over the script. */
    good = begin(animation) && apply_script(animation, &typed);
    const char *model = !typed.job.scene ? animation->job.model : NULL; /* which --scene replaces */
    animation->job.model = NULL;
    good = good && cli_parse(&argp, argc, argv, 0, animation) == 0;
    if (!animation->job.model)
        animation->job.model = model;
    return good;
}

static int run(struct animation *animation)
{
    struct cli_job *job = &animation->job;
    if (!animation->dry_run)
        return cli_run_job(job, true);
    return cli_dry_run(job);
}

int cli_animate(int argc, char **argv)
{
    struct animation animation = {0};
    const bool good = read_all(&animation, argc, argv) && complete(&animation);
    const int status = good ? run(&animation) : cli_report(&animation.job.error);
    free(animation.keys);
    cli_shot_finish(&animation.shot);
    return status;
}
