/* SPDX-License-Identifier: MIT */
/* One picture by two tracers: every ray compared, then the pictures. */
#include "cli/cli.h"
#include "cli/comparison.h"
#include "lib/text.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define FAR_DEFAULT 1e-4
#define FAR_MIN 1e-9
#define STEPS 3u /* that progress is counted in */

enum key {
    KEY_PICTURE = 'o',
    KEY_TRACERS = 0x400,
    KEY_FAR,
    KEY_TIME,
    KEY_FAIL_ABOVE,
    KEY_THRESHOLD,
    KEY_HEAT_TOP,
    KEY_JSON
};

struct tracer_comparison {
    struct cli_job job;
    bool has_tracers, json;
    enum protocol_tracer tracer, reference;
    double far_share, min_agreement; /* of all rays; 0: no limit */
    struct cli_limits limits;
    struct fl_compare_options images; /* `picture` NULL: none is asked for */
    struct fl_comparison figures;
    char folder[4096], paths[2][4224]; /* of the pictures, temporary: the reference's, the tracer's */
    struct cli_progress progress;
    struct cli_loading loading;
    struct fl_exporter *exporter;
    struct fl_frame *frame; /* the tracer's, with what came of the rays */
};

static const struct argp_option options[] = {
    {"tracers", KEY_TRACERS, "A,B", 0, "Compare tracer A with the reference B", 0},
    {"far", KEY_FAR, "SHARE", 0,
     "Count hits as different if they are farther apart than this share of the scene's diagonal (default 0.0001)",
     0},
    {"time", KEY_TIME, "SECONDS", 0, "Compare at this time of the clips (default 0)", 0},
    {"output", KEY_PICTURE, "PICTURE", 0,
     "Write the reference, the tracer and the errors side by side, PNG or JPEG", 0},
    {"heat-top", KEY_HEAT_TOP, "ERROR", 0,
     "Set the error that gets the brightest colour (default: the maximum error, at most 1)", 0},
    {"threshold", KEY_THRESHOLD, "ERROR", 0, "Count a pixel as beyond if a channel differs by more (default 0.01)",
     0},
    {"fail-above", KEY_FAIL_ABOVE, "[FIGURE=]VALUE", 0,
     "Exit with 1 if a figure is worse: agree, the share of the rays that both answer alike, below the value "
     "(99.99%); else as for images, see 'farlight compare --help'. May be repeated",
     0},
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {0}};

/* ---- command line ---- */

static error_t parse_tracers(struct tracer_comparison *comparison, const char *value)
{
    struct cli_job *job = &comparison->job;
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

static error_t name_field(struct tracer_comparison *comparison, const char *field)
{
    snprintf(comparison->job.error.field, sizeof(comparison->job.error.field), "%s", field);
    return EINVAL;
}

static error_t parse_real(struct tracer_comparison *comparison, const char *field, const char *value,
                          double maximum, double *real)
{
    return fl_text_real(value, 0, maximum, real, &comparison->job.error) ? 0 : name_field(comparison, field);
}

/* "agree=99.99%" or "agree=0.9999"; others are of the images. */
static error_t parse_limit(struct tracer_comparison *comparison, const char *value)
{
    static const char field[] = "--fail-above", agree[] = "agree=";
    if (strncmp(value, agree, sizeof(agree) - 1) != 0)
        return cli_limits_add(&comparison->limits, value, &comparison->job.error) ? 0
                                                                                  : name_field(comparison, field);
    return cli_share_parse(value + sizeof(agree) - 1, &comparison->min_agreement, &comparison->job.error)
               ? 0
               : name_field(comparison, field);
}

static error_t parse_own(struct tracer_comparison *comparison, int key, char *value)
{
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_TRACERS:
        return parse_tracers(comparison, value);
    case KEY_FAR:
        status = parse_real(comparison, "--far", value, 1, &comparison->far_share);
        if (status == 0 && !(comparison->far_share >= FAR_MIN))
            return cli_usage(&comparison->job, "--far", "must be at least %g", FAR_MIN);
        return status;
    case KEY_TIME:
        return fl_text_real(value, -1e6, 1e6, &comparison->job.time_s, &comparison->job.error)
                   ? 0
                   : name_field(comparison, "--time");
    case KEY_FAIL_ABOVE:
        return parse_limit(comparison, value);
    case KEY_THRESHOLD:
        status = parse_real(comparison, "--threshold", value, 1e9, &real);
        comparison->images.threshold = real > 0 ? (float)real : FL_THRESHOLD_NONE;
        return status;
    case KEY_HEAT_TOP:
        status = parse_real(comparison, "--heat-top", value, 1e9, &real);
        comparison->images.heat_top = (float)real;
        return status;
    case KEY_PICTURE:
        comparison->images.picture = value;
        return 0;
    case KEY_JSON:
        comparison->json = true;
        return 0;
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct tracer_comparison *comparison = state->input;
    struct cli_job *job = &comparison->job;
    switch (key) {
    case ARGP_KEY_INIT:
        state->child_inputs[0] = job;
        return 0;
    case ARGP_KEY_ARG:
        if (job->model)
            return cli_usage(job, value, "only one model can be rendered");
        job->model = value;
        return 0;
    default:
        return parse_own(comparison, key, value);
    }
}

/* The pictures are EXR files of 32-bit floats, whatever the other options. */
static bool complete(struct tracer_comparison *comparison)
{
    struct cli_job *job = &comparison->job;
    if (!comparison->has_tracers)
        return cli_usage(job, "--tracers", "a pair of tracers is needed, for example bvh,reference") == 0;
    if (job->time_s != 0 && job->clip_count == 0) {
        cli_usage(job, "--time", "no clip is played");
        return fl_error_remedy(&job->error, "add --clip NAME");
    }
    job->output = "picture.exr";
    job->float_pixels = true;
    if (!cli_job_complete(job, false))
        return false;
    job->options.primary = PROTOCOL_PRIMARY_TRACE;
    job->options.compare_far = (float)comparison->far_share;
    return true;
}

/* ---- pictures ---- */

static bool prepare(struct tracer_comparison *comparison, struct fl_error *error)
{
    char folder[4096];
    const char *const inputs[] = {comparison->job.model, comparison->job.environment};
    if (!cli_check_error_picture(comparison->images.picture, inputs, 2, error))
        return false;
    if (!cli_temporary_folder(folder, sizeof(folder), error))
        return false;
    memcpy(comparison->folder, folder, sizeof(folder));
    snprintf(comparison->paths[0], sizeof(comparison->paths[0]), "%s/reference.exr", folder);
    snprintf(comparison->paths[1], sizeof(comparison->paths[1]), "%s/tracer.exr", folder);
    return true;
}

static bool load(struct tracer_comparison *comparison, struct fl_error *error)
{
    const struct fl_exporter_options export = {.folder = comparison->folder,
                                               .model = cli_base_name(comparison->job.model),
                                               .interrupt_fd = cli_interrupt_fd(),
                                               .format = "exr"};
    if (!cli_loading_begin(&comparison->loading, error))
        return false;
    comparison->exporter = fl_exporter_start(&export, error);
    return comparison->exporter && cli_loading_end(&comparison->loading, error) &&
           cli_choose_camera(&comparison->job, comparison->loading.scene, error) &&
           cli_settle(&comparison->job, comparison->loading.scene, false, error);
}

/* The one frame of a job, into a file; the caller's to destroy, NULL if it failed. */
static struct fl_frame *render(struct tracer_comparison *comparison, const char *path, struct fl_error *error)
{
    struct fl_job *job = fl_render_start(comparison->loading.scene, &comparison->job.options, error);
    struct fl_frame *frame = job ? fl_render_next(job, error) : NULL;
    if (frame &&
        !fl_exporter_write(comparison->exporter, frame, &(struct fl_export_options){.path = path}, error)) {
        fl_frame_destroy(frame);
        frame = NULL;
    }
    fl_render_destroy(job);
    return frame;
}

static bool render_both(struct tracer_comparison *comparison, struct fl_error *error)
{
    struct message_render *wanted = &comparison->job.options;
    struct cli_warned warned = {0};
    char what[100];
    snprintf(what, sizeof(what), "rays of %s and %s", protocol_tracer_text(comparison->tracer),
             protocol_tracer_text(comparison->reference));
    cli_progress_step(&comparison->progress, 0, STEPS, what);
    wanted->compare = true;
    wanted->tracer = comparison->tracer;
    wanted->compare_with = comparison->reference;
    comparison->frame = render(comparison, comparison->paths[1], error);
    if (!comparison->frame)
        return false;
    cli_structure_warn(comparison->frame, &warned, &comparison->progress);
    snprintf(what, sizeof(what), "picture of %s", protocol_tracer_text(comparison->reference));
    cli_progress_step(&comparison->progress, 1, STEPS, what);
    wanted->compare = false;
    wanted->tracer = comparison->reference;
    struct fl_frame *reference = render(comparison, comparison->paths[0], error);
    if (reference)
        cli_structure_warn(reference, &warned, &comparison->progress);
    fl_frame_destroy(reference);
    return reference && fl_exporter_wait(comparison->exporter, error);
}

static bool compare_pictures(struct tracer_comparison *comparison, struct fl_error *error)
{
    struct fl_compare_options *images = &comparison->images;
    images->a = comparison->paths[0];
    images->b = comparison->paths[1];
    images->layout = PROTOCOL_COMPARISON_LAYOUT_SIDE;
    images->label_a = protocol_tracer_text(comparison->reference);
    images->label_b = protocol_tracer_text(comparison->tracer);
    images->interrupt_fd = cli_interrupt_fd();
    cli_progress_step(&comparison->progress, 2, STEPS, "comparing the pictures");
    return fl_compare(images, &comparison->figures, error);
}

/* ---- what came of it ---- */

static bool is_within(const struct tracer_comparison *comparison)
{
    return cli_wave_agreement(comparison->frame) >= comparison->min_agreement &&
           cli_limits_hold(&comparison->limits, &comparison->figures);
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
    cli_print_name(comparison->job.model);
    printf(", %ux%u, %u sample%s a pixel, %s\n", frame->width, frame->height, frame->samples,
           frame->samples == 1 ? "" : "s", protocol_integrator_text(frame->integrator));
    print_structure(frame);
    cli_print_waves(frame, comparison->reference, comparison->far_share);
    if (agreement < comparison->min_agreement)
        printf("  over the limit: agree %.6g %%, at least %.6g %%\n", agreement * 100,
               comparison->min_agreement * 100);
    printf("\nthe picture of %s and that of %s\n", reference, tracer);
    cli_comparison_print(stdout, &comparison->figures, &comparison->limits);
}

static void print_json(const struct tracer_comparison *comparison)
{
    const struct fl_frame *frame = comparison->frame;
    const char *picture = comparison->images.picture;
    char model[4097]; /* a path need not be UTF-8, which JSON is */
    json_t *object = json_pack(
        "{s:s,s:s,s:s,s:I,s:I,s:I,s:f,s:o,s:o,s:o,s:b}", "tracer", protocol_tracer_text(comparison->tracer),
        "reference", protocol_tracer_text(comparison->reference), "integrator",
        protocol_integrator_text(frame->integrator), "width", (json_int_t)frame->width, "height",
        (json_int_t)frame->height, "samples", (json_int_t)frame->samples, "far_share", comparison->far_share,
        "waves", cli_waves_json(frame), "all", cli_wave_total_json(frame), "image",
        cli_comparison_json(&comparison->figures, &comparison->limits), "within", is_within(comparison) ? 1 : 0);
    fl_text_utf8(comparison->job.model, model, sizeof(model));
    json_object_set_new(object, "model", json_string(model));
    json_object_set_new(object, "picture", picture ? json_string(picture) : json_null());
    cli_structure_set_json(object, frame);
    json_object_set_new(object, "min_agreement",
                        comparison->min_agreement > 0 ? json_real(comparison->min_agreement) : json_null());
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

static bool run(struct tracer_comparison *comparison, struct fl_error *error)
{
    return prepare(comparison, error) && load(comparison, error) && render_both(comparison, error) &&
           compare_pictures(comparison, error);
}

static void finish(struct tracer_comparison *comparison)
{
    if (comparison->loading.connection)
        fl_connection_set_interrupt(comparison->loading.connection, 0);
    fl_exporter_destroy(comparison->exporter);
    cli_loading_close(&comparison->loading);
    fl_frame_destroy(comparison->frame);
    if (comparison->folder[0] == '\0')
        return;
    unlink(comparison->paths[0]);
    unlink(comparison->paths[1]);
    rmdir(comparison->folder);
}

int cli_compare_tracers(int argc, char **argv)
{
    const struct argp_child children[] = {{cli_picture_argp(), 0, NULL, 0}, {0}};
    const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "MODEL --tracers A,B",
        .doc = "Render one picture of a model with tracer A, trace all of its rays with tracer B too, and show "
               "where the answers differ, wave by wave; then render it with B and compare the pictures.\v"
               "All first hits are traced. Exit status: 0 within all limits, 1 beyond a limit, 2 not compared.",
        .children = children};
    struct tracer_comparison comparison = {.far_share = FAR_DEFAULT};
    struct fl_error error = {0};
    if (!cli_job_begin(&comparison.job, fl_render_defaults()) ||
        cli_parse(&argp, argc, argv, 0, &comparison) != 0 || !complete(&comparison))
        return cli_trouble(&comparison.job.error);
    if (!cli_interrupt_begin(&error))
        return cli_trouble(&error);
    cli_progress_begin(&comparison.progress, comparison.job.quiet);
    comparison.loading = (struct cli_loading){.job = &comparison.job, .progress = &comparison.progress};
    const bool done = run(&comparison, &error);
    cli_progress_end(&comparison.progress, done);
    if (done && comparison.json)
        print_json(&comparison);
    else if (done)
        print_text(&comparison);
    const int status = done && is_within(&comparison) ? CLI_DONE : CLI_FAILED;
    finish(&comparison);
    return done ? status : cli_trouble(&error);
}
