/* SPDX-License-Identifier: MIT */
/* farlight compare: compares two image files, with --tracers two tracers, or with an option of views pictures
 * from depth layers with rendered ones. */
#include "commands.h"
#include "options/image_path.h"
#include "options/interrupt.h"
#include "options/job.h"
#include "options/parse.h"
#include "options/talk.h"
#include "comparison.h"
#include "lib/text.h"

#include <errno.h>
#include <string.h>

#define OPERANDS_MAX 2u

enum key {
    KEY_JSON = 0x500,
    KEY_THRESHOLD,
    KEY_FAIL_ABOVE,
    KEY_LAYOUT,
    KEY_HEAT_TOP,
    KEY_IGNORE_ALPHA,
    KEY_TONE_MAP
};

struct comparing {
    const char *operands[OPERANDS_MAX];
    size_t operand_count;
    struct fl_compare_options options;
    struct cli_limits limits;
    bool json;
    struct cli_job job; /* holds an option's error */
};

static const struct argp_option options[] = {
    {"output", 'o', "IMAGE", 0, "Write a picture of the errors, PNG or JPEG by its ending", 0},
    {"layout", KEY_LAYOUT, "NAME", 0,
     "Choose the content of the picture: heat, only the errors (default), or side, with both images", 0},
    {"heat-top", KEY_HEAT_TOP, "ERROR", 0,
     "Set the error that gets the brightest colour (default: the maximum error, at most 1)", 0},
    {"threshold", KEY_THRESHOLD, "ERROR", 0, "Count a pixel as beyond if a channel differs by more (default 0.01)",
     0},
    {"fail-above", KEY_FAIL_ABOVE, "[FIGURE=]VALUE", 0,
     "Exit with 1 if a figure is worse: psnr, shown_psnr (dB) and ssim below the value; mean, rms, max, "
     "butteraugli, and the shares beyond, visible and nonfinite (0.001 or 0.1%) above it. Without a name: max. "
     "May be repeated",
     0},
    {"tone-map", KEY_TONE_MAP, "NAME", 0,
     "Choose how a screen shows linear files: neutral (default), aces or none", 0},
    {"ignore-alpha", KEY_IGNORE_ALPHA, NULL, 0, "Compare colours only", 0},
    {"json", KEY_JSON, NULL, 0, "Print one JSON object on one line", 0},
    {0}};

/* Adds the option's name to an error of a value that the library parsed. */
static error_t name_field(struct comparing *comparing, const char *field)
{
    snprintf(comparing->job.error.field, sizeof(comparing->job.error.field), "%s", field);
    return EINVAL;
}

static error_t parse_error(struct comparing *comparing, const char *field, const char *value, float *error)
{
    double real = 0;
    if (!fl_text_real(value, 0, 1e9, &real, &comparing->job.error))
        return name_field(comparing, field);
    *error = (float)real;
    return 0;
}

static error_t add_operand(struct comparing *comparing, char *value)
{
    if (comparing->operand_count == OPERANDS_MAX)
        return cli_usage(&comparing->job, value, "only two images can be compared");
    comparing->operands[comparing->operand_count++] = value;
    return 0;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    struct comparing *comparing = state->input;
    error_t status = 0;
    switch (key) {
    case 'o':
        comparing->options.picture = value;
        return 0;
    case KEY_LAYOUT:
        if (!protocol_comparison_layout_parse(value, &comparing->options.layout))
            return cli_usage(&comparing->job, "--layout", "'%s' is not known (known: heat, side)", value);
        return 0;
    case KEY_TONE_MAP:
        if (!protocol_tone_map_parse(value, &comparing->options.tone_map))
            return cli_usage(&comparing->job, "--tone-map", "'%s' is not known (known: neutral, aces, none)",
                             value);
        return 0;
    case KEY_HEAT_TOP:
        return parse_error(comparing, "--heat-top", value, &comparing->options.heat_top);
    case KEY_THRESHOLD:
        status = parse_error(comparing, "--threshold", value, &comparing->options.threshold);
        if (!(comparing->options.threshold > 0))
            comparing->options.threshold = FL_THRESHOLD_NONE;
        return status;
    case KEY_FAIL_ABOVE:
        return cli_limits_add(&comparing->limits, value, &comparing->job.error)
                   ? 0
                   : name_field(comparing, "--fail-above");
    case KEY_IGNORE_ALPHA:
        comparing->options.ignore_alpha = true;
        return 0;
    case KEY_JSON:
        comparing->json = true;
        return 0;
    case ARGP_KEY_ARG:
        return add_operand(comparing, value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* ---- two image files ---- */

static void print_figures(const struct comparing *comparing, const struct fl_comparison *comparison)
{
    cli_print_name(comparing->options.a);
    fputs(" and ", stdout);
    cli_print_name(comparing->options.b);
    putchar('\n');
    cli_comparison_print(stdout, comparison, &comparing->limits);
}

static void print_object(const struct comparing *comparing, const struct fl_comparison *comparison)
{
    const char *picture = comparing->options.picture;
    json_t *object = cli_comparison_json(comparison, &comparing->limits);
    json_object_set_new(object, "a", json_string(comparing->options.a));
    json_object_set_new(object, "b", json_string(comparing->options.b));
    json_object_set_new(object, "picture", picture ? json_string(picture) : json_null());
    json_dumpf(object, stdout, CLI_JSON | JSON_REAL_PRECISION(9));
    putchar('\n');
    json_decref(object);
}

static int compare_images(struct comparing *comparing)
{
    struct fl_error error = {0};
    struct fl_comparison comparison;
    if (!cli_check_error_picture(comparing->options.picture, comparing->operands, OPERANDS_MAX, &error) ||
        !cli_interrupt_begin(&error))
        return cli_trouble(&error);
    comparing->options.a = comparing->operands[0];
    comparing->options.b = comparing->operands[1];
    comparing->options.interrupt_fd = cli_interrupt_fd();
    if (!fl_compare(&comparing->options, &comparison, &error))
        return cli_trouble(&error);
    if (comparing->json)
        print_object(comparing, &comparison);
    else
        print_figures(comparing, &comparison);
    return cli_limits_hold(&comparing->limits, &comparison) ? CLI_DONE : CLI_FAILED;
}

/* Options that select another form; abbreviations count, down to `shortest` characters. */
struct form {
    const char *option;
    size_t shortest; /* shortest prefix that no other option of images has; "--tracer" qualifies */
    int (*run)(int argc, char **argv);
};
static const struct form forms[] = {
    {"--tracers", 4, cli_compare_tracers},   {"--stereo", 3, cli_compare_views},
    {"--light-field", 4, cli_compare_views}, {"--lens", 4, cli_compare_views},
    {"--views", 4, cli_compare_views},       {"--upsample", 4, cli_compare_views},
};

/* The other form that the options select; NULL: two images. */
static const struct form *find_form(int argc, char **argv)
{
    for (size_t k = 0; k < sizeof(forms) / sizeof(forms[0]); k++)
        for (int i = 1; i < argc && strcmp(argv[i], "--") != 0; i++) {
            const size_t length = strcspn(argv[i], "=");
            if (length >= forms[k].shortest && length <= strlen(forms[k].option) &&
                strncmp(argv[i], forms[k].option, length) == 0)
                return &forms[k];
        }
    return NULL;
}

int cli_compare(int argc, char **argv)
{
    const struct form *form = find_form(argc, argv);
    if (form)
        return form->run(argc, argv);
    static const struct argp argp = {
        .options = options,
        .parser = parse,
        .args_doc = "IMAGE IMAGE\nMODEL --tracers A,B\nMODEL --stereo METRES|--light-field NxM|--lens "
                    "quadtree|--upsample N",
        .doc = "Measure the difference of two images of one size, of two tracers on a model, ray by ray, or of "
               "pictures made from depth layers and rendered ones.\vOptions of the second form: 'farlight compare "
               "--tracers bvh,reference --help', of the third: 'farlight compare --stereo 0.065 --help'. Images "
               "are EXR, HDR, PNG or JPEG. EXR and HDR files are compared in linear light, others as a screen "
               "shows them, 0 to 1. Exit status: 0 within all limits, 1 beyond a limit, 2 not compared."};
    struct comparing comparing = {0};
    if (cli_parse(&argp, argc, argv, 0, &comparing) != 0)
        return cli_trouble(&comparing.job.error);
    if (comparing.operand_count < 2) {
        cli_usage(&comparing.job, "IMAGE", "two image files are needed");
        fl_error_remedy(&comparing.job.error,
                        "name them, or compare tracers on a model with --tracers bvh,reference, or pictures made "
                        "from depth layers with --stereo 0.065");
        return cli_trouble(&comparing.job.error);
    }
    return compare_images(&comparing);
}
