/* SPDX-License-Identifier: MIT */
/* farlight animate and farlight turntable: series of frames. */
#include "cli/shot/script.h"
#include "lib/text.h"
#include "commands.h"
#include "series.h"
#include "session.h"
#include "options/arguments.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* With fewer samples, edges of a turning model visibly creep. */
#define TURNTABLE_SAMPLES 8u

enum key {
    KEY_SHARD = 0x400,
    KEY_CHUNK,
    KEY_RESUME,
    KEY_DIGESTS,
    KEY_SCRIPT,
    KEY_LOSSLESS,
    KEY_DRY_RUN,
    KEY_SCENE
};

struct animation {
    struct cli_job job;
    const char *script_path;
    struct cli_shot shot;
    bool dry_run;
};

static const struct argp_option options[] = {
    {NULL, 0, NULL, 0, "Animation:", -2},
    {"script", KEY_SCRIPT, "SHOT.json", 0,
     "Read the settings from a shot file (farlight-shot(5)); options of the command line override it", 0},
    {"scene", KEY_SCENE, "NAME", 0,
     "Use a shared scene at --server in place of MODEL ('farlight scenes' lists them)", 0},
    {"dry-run", KEY_DRY_RUN, NULL, 0, "Check options and script without rendering", 0},
    {"lossless", KEY_LOSSLESS, NULL, 0, "Write a lossless video, for .mkv and .webp", 0},
    {NULL, 0, NULL, 0, "Parts:", -1},
    {"shard", KEY_SHARD, "K/N", 0, "Render only every N-th frame of the range, beginning with the K-th", 0},
    {"chunk", KEY_CHUNK, "K/N", 0, "Render only the K-th of N runs of neighbouring frames", 0},
    {"resume", KEY_RESUME, NULL, 0, "Skip frames whose files exist, are complete and have the requested size", 0},
    {"digests", KEY_DIGESTS, NULL, 0,
     "Write FILE.sha256 beside each picture, for 'farlight verify'; --resume then renders changed pictures again",
     0},
    {0}};

static error_t set_part(struct cli_job *job, const char *value, bool is_chunk)
{
    const char *option = is_chunk ? "--chunk" : "--shard";
    if (job->series.shard_parts > 0 && job->series.is_chunk != is_chunk)
        return cli_usage(job, option, "cannot be combined with %s", is_chunk ? "--shard" : "--chunk");
    job->series.is_chunk = is_chunk;
    if (fl_text_shard(value, &job->series.shard_part, &job->series.shard_parts, &job->error))
        return 0;
    snprintf(job->error.field, sizeof(job->error.field), "%s", option);
    return EINVAL;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct animation *animation = state->input;
    struct cli_job *job = &animation->job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = state->child_inputs[1] = job;
        return 0;
    case KEY_SHARD:
    case KEY_CHUNK:
        return set_part(job, value, key == KEY_CHUNK);
    case KEY_RESUME:
        job->series.resume = true;
        return 0;
    case KEY_DIGESTS:
        job->series.digests = true;
        return 0;
    case KEY_LOSSLESS:
        job->output.lossless = true;
        return 0;
    case KEY_SCRIPT:
        animation->script_path = value;
        return 0;
    case KEY_DRY_RUN:
        animation->dry_run = true;
        return 0;
    case KEY_SCENE:
        job->input.scene = value;
        return 0;
    case ARGP_KEY_ARG:
        return cli_set_model(job, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Reads the script's members that only animations have. */
static error_t set_series(void *user, const char *name, const char *value)
{
    struct animation *animation = user;
    struct cli_job *job = &animation->job;
    if (strcmp(name, "shard") == 0)
        return set_part(job, value, false);
    if (strcmp(name, "lossless") != 0)
        return cli_series_set(job, name, value);
    job->output.lossless = true;
    return 0;
}

/* Sets the script's options, except those that the command line sets. `typed` was read from the command line
 * alone. */
static bool apply_script(struct animation *animation, const struct animation *typed)
{
    const struct cli_job *job = &typed->job;
    const struct cli_shot_given given = {.camera = job->camera.name || job->camera.has_eye ||
                                                   job->camera.has_look_at || job->camera.is_orbit ||
                                                   job->camera.keys_file,
                                         .clips = job->clips.count > 0,
                                         .output = job->output.path != NULL,
                                         .aperture = job->camera.has_aperture,
                                         .focus = job->camera.has_focus,
                                         .up = job->camera.has_up,
                                         .fov = job->camera.has_fov};
    return cli_shot_load(&animation->shot, typed->script_path, &animation->job.error) &&
           cli_shot_apply(&animation->shot, &animation->job, &given, set_series, animation);
}

static bool read_all(struct animation *animation, int argc, char **argv)
{
    const struct argp_child children[] = {
        {cli_series_argp(), 0, NULL, 0}, {cli_options_argp(CLI_OPTIONS_ALL), 0, NULL, 0}, {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --frames A-B -o 'DIR/%04d.exr'\nMODEL --clip NAME -o MOVIE.mp4\n"
                    "--scene NAME --server ADDRESS --frames A-B -o 'DIR/%04d.exr'\n--script SHOT.json",
        .doc =
            "Render a series of pictures or a video of a model, with clips or a moving camera. 'farlight "
            "turntable' does the same with --orbit: once around the model, in 4 seconds unless --frames or "
            "--script says otherwise.\v"
            "In the name of the images write %d or %04d for the frame's number and %% for a percent sign. Videos "
            "end in .mp4, .mkv or .y4m, moving pictures, whose name has no %d, in .gif or .webp; '-' is standard "
            "output, as y4m or as --format says.",
        .children = children};
    struct animation typed = {0};
    bool good = cli_job_begin(&typed.job, fl_render_defaults()) &&
                cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &typed) == 0;
    if (!good || !typed.script_path) {
        *animation = typed;
        return good;
    }
    /* Reads the command line again, over the script. */
    good = cli_job_begin(&animation->job, fl_render_defaults()) && apply_script(animation, &typed);
    struct cli_job *job = &animation->job;
    /* The command line has no models, so the script's stay */
    const bool is_kept = !typed.job.input.scene && !typed.job.input.model;
    const char *model = is_kept ? job->input.model : NULL;
    const size_t model_count = is_kept ? job->input.count : 0;
    job->input.model = NULL;
    job->input.count = 0;
    good = good && cli_parse(&argp, argc, argv, ARGP_IN_ORDER, animation) == 0;
    if (is_kept) {
        job->input.model = model;
        job->input.count = model_count;
    }
    return good;
}

static int run(struct animation *animation)
{
    struct cli_job *job = &animation->job;
    if (!animation->dry_run)
        return cli_run_job(job, true);
    return cli_dry_run(job);
}

static int animate(int argc, char **argv, bool is_turntable)
{
    struct animation animation = {0};
    bool good = read_all(&animation, argc, argv);
    animation.job.camera.is_orbit |= is_turntable;
    animation.job.sampling.filters = true;
    if (is_turntable && animation.job.sampling.usual == 0)
        animation.job.sampling.usual = TURNTABLE_SAMPLES;
    good = good && cli_series_complete(&animation.job);
    const int status = good ? run(&animation) : cli_report(&animation.job.error);
    cli_series_finish(&animation.job);
    cli_shot_finish(&animation.shot);
    return status;
}

int cli_animate(int argc, char **argv)
{
    return animate(argc, argv, false);
}

int cli_turntable(int argc, char **argv)
{
    return animate(argc, argv, true);
}
