/* SPDX-License-Identifier: MIT */
/* farlight render: a picture of a model. */
#include "picture_part.h"
#include "lib/frame_set.h"
#include "lib/text.h"
#include "commands.h"
#include "session.h"
#include "options/arguments.h"
#include "options/complete.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/talk.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>

/* Enough for smooth edges and soft shadows; software GL renders 1280x720 pixels in some seconds. */
#define STILL_SAMPLES 16u

enum key { KEY_TIME = 0x400, KEY_PROGRESSIVE, KEY_SCENE, KEY_WATCH, KEY_PART, KEY_RESUME };

static const struct argp_option options[] = {
    {"scene", KEY_SCENE, "NAME", 0,
     "Use a shared scene at --server in place of MODEL ('farlight scenes' lists them)", -1},
    {"time", KEY_TIME, "SECONDS", 0, "Show this time of the clips (default 0)", -1},
    {"progressive", KEY_PROGRESSIVE, "N", OPTION_ARG_OPTIONAL,
     "Write the picture again after every N samples (default: after 1, 2, 4, 8 ..) until --samples are reached, "
     "or "
     "without --samples until Ctrl-C",
     -1},
    {"part", KEY_PART, "K/N", 0,
     "Render only the K-th of N parts of the picture, for 'farlight merge'; EXR files, with a number of samples",
     -1},
    {"resume", KEY_RESUME, NULL, 0, "Skip a part whose file exists and belongs to the same picture", -1},
    {"watch", KEY_WATCH, NULL, 0,
     "Render again when the model, or a file that it names, has changed, until Ctrl-C; only changes are sent", -1},
    {0}};

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct cli_job *job = state->input;
    uint64_t number = 0;
    bool good = true;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case KEY_TIME:
        good = fl_text_real(value, -1e6, 1e6, &job->clips.time_s, &job->error);
        break;
    case KEY_PROGRESSIVE:
        job->sampling.progressive = true;
        good = !value || fl_text_integer(value, 1, 65536, &number, &job->error);
        job->sampling.pass_samples = (uint32_t)number;
        break;
    case KEY_PART:
        good = fl_text_shard(value, &job->part.number, &job->part.count, &job->error);
        break;
    case KEY_SCENE:
        job->input.scene = value;
        return 0;
    case KEY_RESUME:
        job->series.resume = true;
        return 0;
    case KEY_WATCH:
        job->input.watch = true;
        return 0;
    case ARGP_KEY_ARG:
        return cli_set_model(job, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
    if (good)
        return 0;
    snprintf(job->error.field, sizeof(job->error.field), "%s",
             key == KEY_TIME   ? "--time"
             : key == KEY_PART ? "--part"
                               : "--progressive");
    return EINVAL;
}

/* Checks --watch: only files change, and only a file can be written again. */
static bool complete_watch(struct cli_job *job)
{
    if (!job->input.watch || !cli_check_watch(job))
        return !job->input.watch;
    if (job->sampling.endless) {
        cli_usage(job, "--watch", "a picture that is refined without an end waits for nothing");
        return fl_error_remedy(&job->error, "say how far by --samples");
    }
    if (!cli_writes_to_stdout(job))
        return true;
    cli_usage(job, "--watch", "standard output can be written only once");
    return fl_error_remedy(&job->error, "name a file: it is replaced each time");
}

static bool complete(struct cli_job *job)
{
    job->sampling.usual = STILL_SAMPLES;
    job->sampling.filters = true;
    if (!cli_job_complete(job, false) || !cli_picture_part_complete(job) || !complete_watch(job))
        return false;
    if (job->sampling.progressive && cli_writes_to_stdout(job)) {
        cli_usage(job, "--progressive", "standard output can be written only once");
        return fl_error_remedy(&job->error, "name a file: it is replaced after each pass");
    }
    if (job->clips.time_s != 0 && job->clips.count == 0) {
        cli_usage(job, "--time", "no clip is played");
        return fl_error_remedy(&job->error, "add --clip NAME");
    }
    return true;
}

int cli_render(int argc, char **argv)
{
    const struct argp_child children[] = {{cli_options_argp(CLI_OPTIONS_ALL), 0, NULL, 0}, {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL [--at PLACE] [MODEL [--at PLACE]]... -o IMAGE\n--scene NAME --server ADDRESS -o IMAGE",
        .doc = "Render one picture of a model.\v"
               "MODEL is glTF, GLB, OBJ, PLY, STL, FBX, COLLADA, 3MF or of another format "
               "of farlight-import; '-' is standard input. FARLIGHT_SERVER, FARLIGHT_SIZE, "
               "FARLIGHT_SAMPLES and so on give defaults.",
        .children = children};
    struct cli_job job;
    if (!cli_job_begin(&job, fl_render_defaults()) || cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &job) != 0 ||
        !complete(&job))
        return cli_report(&job.error);
    return cli_run_job(&job, false);
}
