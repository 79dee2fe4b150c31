/* SPDX-License-Identifier: MIT */
/* farlight compare --tracers: a picture by two tracers; compares every ray, then the pictures. */
#include "pair.h"
#include "lib/text.h"
#include "commands.h"
#include "comparison.h"
#include "cli/jobs/structure.h"
#include "options/arguments.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/models.h"
#include "options/parse.h"
#include "options/progress.h"
#include "options/talk.h"
#include "options/wave_table.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

#define FAR_DEFAULT 1e-4
#define FAR_MIN 1e-9
#define STEPS 3u /* steps of the progress */

enum key { KEY_TRACERS = 0x400, KEY_FAR, KEY_FAIL_ABOVE };

struct tracer_comparison {
    struct cli_pair pair;
    bool has_tracers;
    enum protocol_tracer tracer, reference;
    double far_share, min_agreement; /* share of all rays; 0: no limit */
    struct fl_comparison figures;
    struct fl_frame *frame; /* the tracer's frame, with the results of the rays */
};

static const struct argp_option options[] = {
    {"tracers", KEY_TRACERS, "A,B", 0, "Compare tracer A with the reference B", 0},
    {"far", KEY_FAR, "SHARE", 0,
     "Count hits as different if they are farther apart than this share of the scene's diagonal (default 0.0001)",
     0},
    {"fail-above", KEY_FAIL_ABOVE, "[FIGURE=]VALUE", 0,
     "Exit with 1 if a figure is worse: agree, the share of the rays that both answer alike, below the value "
     "(99.99%); else as for images, see 'farlight compare --help'. May be repeated",
     0},
    {0}};

/* ---- command line ---- */

static error_t parse_tracers(struct tracer_comparison *comparison, const char *value)
{
    struct cli_job *job = &comparison->pair.job;
    char name[40], known[200];
    const char *comma = strchr(value, ',');
    const size_t length = comma ? (size_t)(comma - value) : 0;
    if (length == 0 || length >= sizeof(name) || strchr(comma + 1, ','))
        return cli_usage(job, "--tracers", "'%s' is not a pair of tracers like bvh,reference", value);
    memcpy(name, value, length);
    name[length] = '\0';
    const bool known_first = protocol_tracer_parse(name, &comparison->tracer);
    if (!known_first || !protocol_tracer_parse(comma + 1, &comparison->reference)) {
        cli_usage(job, "--tracers", "unknown tracer '%s'", known_first ? comma + 1 : name);
        fl_error_remedy(&job->error, "known: %s", protocol_enum_list("tracer", known, sizeof(known)));
        return EINVAL;
    }
    comparison->has_tracers = true;
    return 0;
}

static error_t parse_far(struct tracer_comparison *comparison, const char *value)
{
    struct cli_job *job = &comparison->pair.job;
    if (!fl_text_real(value, 0, 1, &comparison->far_share, &job->error)) {
        snprintf(job->error.field, sizeof(job->error.field), "--far");
        return EINVAL;
    }
    return comparison->far_share >= FAR_MIN ? 0 : cli_usage(job, "--far", "must be at least %g", FAR_MIN);
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct tracer_comparison *comparison = state->input;
    struct cli_job *job = &comparison->pair.job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = &comparison->pair;
        state->child_inputs[1] = job;
        return 0;
    case KEY_TRACERS:
        return parse_tracers(comparison, value);
    case KEY_FAR:
        return parse_far(comparison, value);
    case KEY_FAIL_ABOVE:
        return cli_pair_set_limit(&comparison->pair, "agree", value, &comparison->min_agreement);
    case ARGP_KEY_ARG:
        return cli_set_model(job, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static bool complete(struct tracer_comparison *comparison)
{
    struct cli_job *job = &comparison->pair.job;
    const char *const inputs[] = {job->input.model, job->input.environment};
    if (!comparison->has_tracers)
        return cli_usage(job, "--tracers", "a pair of tracers is needed, for example bvh,reference") == 0;
    if (!cli_pair_complete(&comparison->pair, false) ||
        !cli_check_error_picture(comparison->pair.images.picture, inputs, 2, &job->error))
        return false;
    job->options.tracing.primary = PROTOCOL_PRIMARY_TRACE;
    job->options.comparison.compare_far = (float)comparison->far_share;
    comparison->pair.labels[CLI_PAIR_REFERENCE] = protocol_tracer_text(comparison->reference);
    comparison->pair.labels[CLI_PAIR_COMPARED] = protocol_tracer_text(comparison->tracer);
    return true;
}

/* ---- pictures ---- */

/* Renders the single frame of a side, which the caller destroys; NULL: failure. */
static struct fl_frame *render(struct tracer_comparison *comparison, enum cli_pair_side side,
                               struct cli_warned *warned, struct fl_error *error)
{
    struct cli_pair *pair = &comparison->pair;
    struct message_render *wanted = &pair->job.options;
    wanted->comparison.compare = side == CLI_PAIR_COMPARED;
    wanted->tracing.tracer = wanted->comparison.compare ? comparison->tracer : comparison->reference;
    wanted->comparison.compare_with = comparison->reference;
    struct fl_frame *frame = cli_pair_render(pair, side, error) ? cli_pair_next(pair, error) : NULL;
    if (frame)
        cli_structure_warn(frame, warned, &pair->progress);
    return frame;
}

static bool run(struct tracer_comparison *comparison, struct fl_error *error)
{
    struct cli_pair *pair = &comparison->pair;
    struct cli_warned warned = {0};
    char what[100];
    if (!cli_pair_begin(pair, false, error))
        return false;
    snprintf(what, sizeof(what), "rays of %s and %s", protocol_tracer_text(comparison->tracer),
             protocol_tracer_text(comparison->reference));
    cli_progress_step(&pair->progress, 0, STEPS, what);
    comparison->frame = render(comparison, CLI_PAIR_COMPARED, &warned, error);
    if (!comparison->frame)
        return false;
    snprintf(what, sizeof(what), "picture of %s", protocol_tracer_text(comparison->reference));
    cli_progress_step(&pair->progress, 1, STEPS, what);
    struct fl_frame *reference = render(comparison, CLI_PAIR_REFERENCE, &warned, error);
    fl_frame_destroy(reference);
    if (!reference)
        return false;
    cli_progress_step(&pair->progress, 2, STEPS, "comparing the pictures");
    return cli_pair_compare(pair, comparison->frame->frame, pair->images.picture, &comparison->figures, error);
}

/* ---- results ---- */

static bool is_within(const struct tracer_comparison *comparison)
{
    return cli_wave_agreement(comparison->frame) >= comparison->min_agreement &&
           cli_limits_hold(&comparison->pair.limits, &comparison->figures);
}

static void print_structure(const struct fl_frame *frame)
{
    struct fl_structure_part part;
    for (size_t at = 0; fl_structure_next(frame, &at, &part);)
        printf("  structure%s%s: %s\n", part.name[0] != '\0' ? " " : "", part.name, part.text);
}

static void print_text(const struct tracer_comparison *comparison)
{
    const struct fl_frame *frame = comparison->frame;
    const double agreement = cli_wave_agreement(frame);
    const char *tracer = protocol_tracer_text(comparison->tracer);
    const char *reference = protocol_tracer_text(comparison->reference);
    printf("%s against %s: ", tracer, reference);
    cli_print_name(comparison->pair.job.input.model);
    printf(", %ux%u, %u sample%s a pixel, %s\n", frame->width, frame->height, frame->samples,
           frame->samples == 1 ? "" : "s", protocol_integrator_text(frame->integrator));
    print_structure(frame);
    cli_print_waves(frame, comparison->reference, comparison->far_share);
    if (agreement < comparison->min_agreement)
        printf("  over the limit: agree %.6g %%, at least %.6g %%\n", agreement * 100,
               comparison->min_agreement * 100);
    printf("\nthe pictures of %s and %s\n", reference, tracer);
    cli_comparison_print(stdout, &comparison->figures, &comparison->pair.limits);
}

static void print_json(const struct tracer_comparison *comparison)
{
    const struct fl_frame *frame = comparison->frame;
    const char *picture = comparison->pair.images.picture;
    char model[4097]; /* a path need not be UTF-8, but JSON is */
    json_t *object = json_pack(
        "{s:s,s:s,s:s,s:I,s:I,s:I,s:f,s:o,s:o,s:o,s:b}", "tracer", protocol_tracer_text(comparison->tracer),
        "reference", protocol_tracer_text(comparison->reference), "integrator",
        protocol_integrator_text(frame->integrator), "width", (json_int_t)frame->width, "height",
        (json_int_t)frame->height, "samples", (json_int_t)frame->samples, "far_share", comparison->far_share,
        "waves", cli_waves_json(frame), "all", cli_wave_total_json(frame), "image",
        cli_comparison_json(&comparison->figures, &comparison->pair.limits), "within",
        is_within(comparison) ? 1 : 0);
    fl_text_utf8(comparison->pair.job.input.model, model, sizeof(model));
    json_object_set_new(object, "model", json_string(model));
    json_object_set_new(object, "picture", picture ? json_string(picture) : json_null());
    cli_structure_set_json(object, frame);
    json_object_set_new(object, "min_agreement",
                        comparison->min_agreement > 0 ? json_real(comparison->min_agreement) : json_null());
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

int cli_compare_tracers(int argc, char **argv)
{
    const struct argp_child children[] = {
        {&cli_pair_argp, 0, NULL, 0}, {cli_options_argp(CLI_OPTIONS_PICTURE), 0, NULL, 0}, {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --tracers A,B",
        .doc = "Render one picture of a model with tracer A, trace all of its rays with tracer B too, and show "
               "where the answers differ, wave by wave; then render it with B and compare the pictures.\v"
               "All first hits are traced. Exit status: 0 within all limits, 1 beyond a limit, 2 not compared.",
        .children = children};
    struct tracer_comparison comparison = {.pair.image = CLI_IMAGE_EXR, .far_share = FAR_DEFAULT};
    struct fl_error error = {0};
    if (!cli_job_begin(&comparison.pair.job, fl_render_defaults()) ||
        cli_parse(&argp, argc, argv, ARGP_IN_ORDER, &comparison) != 0 || !complete(&comparison))
        return cli_trouble(&comparison.pair.job.error);
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
    fl_frame_destroy(comparison.frame);
    cli_pair_finish(&comparison.pair);
    return done ? status : cli_trouble(&error);
}
