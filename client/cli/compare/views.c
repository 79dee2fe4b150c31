/* SPDX-License-Identifier: MIT */
/* Pictures from depth layers compared with rendered ones: two views or many, a lens, or frames between rendered
 * ones. */
#include "pair.h"
#include "lib/text.h"
#include "commands.h"
#include "comparison.h"
#include "cli/jobs/series.h"
#include "cli/jobs/structure.h"
#include "options/arguments.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/progress.h"
#include "options/talk.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define UNKNOWN_ROW "views/unknown" /* a row of a frame's structure */

enum key { KEY_FAIL_ABOVE = 0x400 };

struct compared_frame {
    uint32_t frame;
    double unknown; /* share of the samples that no layer shows */
    struct fl_comparison figures;
    char *picture; /* NULL: not requested */
};

struct views_comparison {
    struct cli_pair pair;
    double max_unknown; /* share of each frame's samples; below 0: no limit */
    bool is_series;
    struct fl_pattern pattern; /* paths of the pictures of a series */
    struct compared_frame *frames;
    uint32_t frame_count;
    bool is_made; /* true if some frame is made from layers */
    struct cli_warned warned;
};

static const struct argp_option options[] = {
    {"fail-above", KEY_FAIL_ABOVE, "[FIGURE=]VALUE", 0,
     "Exit with 1 if a figure of a frame is worse: unknown, the share of the samples that no depth layer shows, "
     "above "
     "the value (0.1%); else as for images, see 'farlight compare --help'. May be repeated",
     0},
    {NULL, 0, NULL, 0, "Frames, some of which --upsample makes from others:", -2},
    {0}};

/* ---- command line ---- */

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct views_comparison *comparison = state->input;
    struct cli_job *job = &comparison->pair.job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &comparison->pair;
        state->child_inputs[1] = state->child_inputs[2] = job;
        return 0;
    case KEY_FAIL_ABOVE:
        return cli_pair_set_limit(&comparison->pair, "unknown", value, &comparison->max_unknown);
    case ARGP_KEY_ARG:
        return cli_set_model(job, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Checks the path of a single picture, or of one for each frame. */
static bool check_picture(struct views_comparison *comparison)
{
    const struct cli_pair *pair = &comparison->pair;
    struct fl_error *error = &comparison->pair.job.error;
    const char *const inputs[] = {pair->job.input.model, pair->job.input.environment};
    const char *picture = pair->images.picture;
    char path[4096];
    if (!picture || !comparison->is_series)
        return cli_check_error_picture(picture, inputs, 2, error);
    if (!fl_pattern_parse(picture, &comparison->pattern, error)) {
        snprintf(error->field, sizeof(error->field), "--output");
        return false;
    }
    return (fl_pattern_path(&comparison->pattern, 0, path, sizeof(path)) ||
            fl_error_set(error, FL_ERROR_FILE, picture, "the path of the picture is too long")) &&
           cli_check_error_picture(path, inputs, 2, error);
}

static bool complete(struct views_comparison *comparison)
{
    struct cli_pair *pair = &comparison->pair;
    struct cli_job *job = &pair->job;
    comparison->is_series = job->options.picture.upsample > 1;
    if (!comparison->is_series && (job->series.has_range || job->camera.is_orbit || job->camera.keys_file)) {
        cli_usage(job,
                  job->series.has_range  ? "--frames"
                  : job->camera.is_orbit ? "--orbit"
                                         : "--keys",
                  "a single picture is compared");
        return fl_error_remedy(&job->error, "leave it out, or add --upsample 4");
    }
    if (!cli_pair_complete(pair, comparison->is_series))
        return false;
    if (job->options.picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS) {
        cli_usage(job, job->views.has_lens ? "--lens" : "--views", "no picture is made from depth layers");
        return fl_error_remedy(&job->error,
                               "use the source quadtree: the rendered picture is compared with it anyway");
    }
    pair->labels[CLI_PAIR_REFERENCE] = "rendered";
    pair->labels[CLI_PAIR_COMPARED] = "made from depth layers";
    return check_picture(comparison);
}

/* ---- pictures ---- */

static double unknown_of(struct views_comparison *comparison, const struct fl_frame *frame)
{
    for (size_t i = 0; i < frame->structure_count; i++)
        if (strcmp(frame->structure[i].name, UNKNOWN_ROW) == 0) {
            comparison->is_made = true;
            return (double)frame->structure[i].measure;
        }
    return 0;
}

static bool make(struct views_comparison *comparison, struct fl_error *error)
{
    struct cli_pair *pair = &comparison->pair;
    const uint32_t count = fl_frame_run_count(&pair->frames);
    struct fl_frame *frame;
    comparison->frames = calloc(count, sizeof(*comparison->frames));
    if (!comparison->frames)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    if (!cli_pair_render(pair, CLI_PAIR_COMPARED, error))
        return false;
    while (comparison->frame_count < count && (frame = cli_pair_next(pair, error))) {
        struct compared_frame *made = &comparison->frames[comparison->frame_count++];
        made->frame = frame->frame;
        made->unknown = unknown_of(comparison, frame);
        cli_structure_warn(frame, &comparison->warned, &pair->progress);
        fl_frame_destroy(frame);
        cli_progress_frames(&pair->progress, comparison->frame_count, 2 * count);
    }
    return error->code == FL_ERROR_NONE;
}

static bool compare(struct views_comparison *comparison, struct compared_frame *compared, struct fl_error *error)
{
    struct cli_pair *pair = &comparison->pair;
    const char *picture = pair->images.picture;
    char path[4096];
    if (picture && comparison->is_series) {
        if (!fl_pattern_path(&comparison->pattern, compared->frame, path, sizeof(path)))
            return fl_error_set(error, FL_ERROR_FILE, picture, "the path of frame %u is too long",
                                compared->frame);
        picture = path;
    }
    compared->picture = picture ? strdup(picture) : NULL;
    return cli_pair_compare(pair, compared->frame, picture, &compared->figures, error);
}

static bool run(struct views_comparison *comparison, struct fl_error *error)
{
    struct cli_pair *pair = &comparison->pair;
    struct message_render *wanted = &pair->job.options;
    if (!cli_pair_begin(pair, comparison->is_series, error) || !make(comparison, error))
        return false;
    if (!comparison->is_made) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "--lens", "this camera has no lens: the picture is rendered");
        return fl_error_remedy(error, "choose a camera with perspective");
    }
    wanted->picture.view_source = PROTOCOL_VIEW_SOURCE_RAYS;
    wanted->picture.upsample = 1;
    if (!cli_pair_render(pair, CLI_PAIR_REFERENCE, error))
        return false;
    for (uint32_t i = 0; i < comparison->frame_count; i++) {
        struct fl_frame *frame = cli_pair_next(pair, error);
        const bool is_there = frame != NULL;
        if (is_there)
            cli_structure_warn(frame, &comparison->warned, &pair->progress);
        fl_frame_destroy(frame);
        if (!is_there || !compare(comparison, &comparison->frames[i], error))
            return false;
        cli_progress_frames(&pair->progress, comparison->frame_count + i + 1, 2 * comparison->frame_count);
    }
    return true;
}

/* ---- results ---- */

static bool is_known(const struct views_comparison *comparison, const struct compared_frame *frame)
{
    return comparison->max_unknown < 0 || frame->unknown <= comparison->max_unknown;
}

static bool is_within(const struct views_comparison *comparison)
{
    bool good = true;
    for (uint32_t i = 0; i < comparison->frame_count; i++)
        good = good && is_known(comparison, &comparison->frames[i]) &&
               cli_limits_hold(&comparison->pair.limits, &comparison->frames[i].figures);
    return good;
}

/* Totals over all frames, which have equal numbers of samples and pixels. */
struct total {
    double unknown, psnr_db; /* INFINITY without error */
};

static struct total total_of(const struct views_comparison *comparison)
{
    double unknown = 0, squares = 0;
    for (uint32_t i = 0; i < comparison->frame_count; i++) {
        unknown += comparison->frames[i].unknown;
        squares += comparison->frames[i].figures.rms_error * comparison->frames[i].figures.rms_error;
    }
    return (struct total){unknown / comparison->frame_count, -10 * log10(squares / comparison->frame_count)};
}

static void print_frame(const struct views_comparison *comparison, const struct compared_frame *frame)
{
    if (comparison->is_series)
        printf("frame %u\n", frame->frame);
    printf("  %-16s%.6g %% of the samples are in no depth layer\n", "unknown", 100 * frame->unknown);
    cli_comparison_print(stdout, &frame->figures, &comparison->pair.limits);
    if (!is_known(comparison, frame))
        printf("  over the limit: unknown %.6g %%, at most %.6g %%\n", 100 * frame->unknown,
               100 * comparison->max_unknown);
}

static void print_text(const struct views_comparison *comparison)
{
    const struct message_render *wanted = &comparison->pair.job.options;
    const struct total total = total_of(comparison);
    cli_print_name(comparison->pair.job.input.model);
    if (wanted->picture.views_across * wanted->picture.views_down > 1)
        printf(", %ux%u views of", wanted->picture.views_across, wanted->picture.views_down);
    else
        putchar(',');
    printf(" %ux%u, %u sample%s a pixel, %s: rendered, and made from depth layers\n", wanted->picture.width,
           wanted->picture.height, wanted->sampling.samples, wanted->sampling.samples == 1 ? "" : "s",
           protocol_integrator_text(wanted->light.integrator));
    for (uint32_t i = 0; i < comparison->frame_count; i++)
        print_frame(comparison, &comparison->frames[i]);
    if (!comparison->is_series)
        return;
    printf("all frames\n  %-16s%.6g %%\n", "unknown", 100 * total.unknown);
    if (isfinite(total.psnr_db))
        printf("  %-16s%.3f dB (peak: white, 1)\n", "PSNR", total.psnr_db);
}

static json_t *frame_json(const struct views_comparison *comparison, const struct compared_frame *frame)
{
    return json_pack("{s:I, s:f, s:s?, s:o}", "frame", (json_int_t)frame->frame, "unknown", frame->unknown,
                     "picture", frame->picture, "image",
                     cli_comparison_json(&frame->figures, &comparison->pair.limits));
}

static void print_json(const struct views_comparison *comparison)
{
    const struct message_render *wanted = &comparison->pair.job.options;
    const struct total total = total_of(comparison);
    char model[4097]; /* a path need not be UTF-8, but JSON is */
    json_t *frames = json_array();
    for (uint32_t i = 0; i < comparison->frame_count; i++)
        json_array_append_new(frames, frame_json(comparison, &comparison->frames[i]));
    fl_text_utf8(comparison->pair.job.input.model, model, sizeof(model));
    json_t *object = json_pack(
        "{s:s, s:i, s:i, s:i, s:i, s:i, s:s, s:o, s:f, s:o, s:b}", "model", model, "width",
        (int)wanted->picture.width, "height", (int)wanted->picture.height, "views_across",
        (int)wanted->picture.views_across, "views_down", (int)wanted->picture.views_down, "samples",
        (int)wanted->sampling.samples, "integrator", protocol_integrator_text(wanted->light.integrator), "frames",
        frames, "unknown", total.unknown, "psnr", isfinite(total.psnr_db) ? json_real(total.psnr_db) : json_null(),
        "within", is_within(comparison) ? 1 : 0);
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

static void finish(struct views_comparison *comparison)
{
    for (uint32_t i = 0; i < comparison->frame_count; i++)
        free(comparison->frames[i].picture);
    free(comparison->frames);
    cli_pair_finish(&comparison->pair);
}

int cli_compare_views(int argc, char **argv)
{
    const struct argp_child children[] = {{&cli_pair_argp, 0, NULL, 0},
                                          {cli_options_argp(CLI_OPTIONS_VIEWS), 0, NULL, 0},
                                          {cli_series_argp(), 0, NULL, 0},
                                          {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --stereo METRES\nMODEL --light-field NxM --baseline METRES\n"
                    "MODEL --aperture METRES --lens quadtree\nMODEL --frames A-B --upsample N",
        .doc = "Make pictures from depth layers, render the same ones, and measure their difference and the share "
               "that no layer shows.\vWith --upsample each frame of a series is compared, and in the name of the "
               "pictures %d or %04d stands for its number. Exit status: 0 within all limits, 1 beyond a limit, 2 "
               "not compared.",
        .children = children};
    /* Displayed colours are compared: in linear light a lamp displaced by a pixel would outweigh everything
     * else. Coverage is 1 where a layer has a surface, and is not compared. */
    struct views_comparison comparison = {.pair = {.image = CLI_IMAGE_PNG, .images.ignore_alpha = true},
                                          .max_unknown = -1};
    struct fl_error error = {0};
    if (!cli_job_begin(&comparison.pair.job, fl_render_defaults()) ||
        cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &comparison) != 0 || !complete(&comparison)) {
        const int status = cli_trouble(&comparison.pair.job.error);
        finish(&comparison);
        return status;
    }
    if (!cli_interrupt_begin(&error))
        return cli_trouble(&error);
    cli_progress_begin(&comparison.pair.progress, &comparison.pair.job.talk);
    const bool done = run(&comparison, &error);
    cli_progress_end(&comparison.pair.progress, done);
    if (done && comparison.pair.json)
        print_json(&comparison);
    else if (done)
        print_text(&comparison);
    const int status = done && is_within(&comparison) ? CLI_DONE : CLI_FAILED;
    finish(&comparison);
    return done ? status : cli_trouble(&error);
}
