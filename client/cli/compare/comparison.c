/* SPDX-License-Identifier: MIT */
/* Figures of a comparison: names, limits, output. */
#include "comparison.h"
#include "lib/text.h"
#include "options/talk.h"

#include <inttypes.h>
#include <math.h>
#include <string.h>

static const struct figure {
    const char *name, *unit;
    bool is_share;   /* share of the pixels; may be typed in percent */
    bool less_fails; /* the limit is a minimum */
    double min, max; /* allowed limits; shares are 0 to 1 */
} figures[CLI_FIGURE_COUNT] = {
    [CLI_FIGURE_PSNR] = {.name = "psnr", .unit = " dB", .less_fails = true, .min = -1000, .max = 1000},
    [CLI_FIGURE_SHOWN_PSNR] = {.name = "shown_psnr", .unit = " dB", .less_fails = true, .min = -1000, .max = 1000},
    [CLI_FIGURE_MEAN] = {.name = "mean", .unit = "", .max = 1e30},
    [CLI_FIGURE_RMS] = {.name = "rms", .unit = "", .max = 1e30},
    [CLI_FIGURE_MAX] = {.name = "max", .unit = "", .max = 1e30},
    [CLI_FIGURE_BEYOND] = {.name = "beyond", .unit = "", .is_share = true},
    [CLI_FIGURE_SSIM] = {.name = "ssim", .unit = "", .less_fails = true, .min = -1, .max = 1},
    [CLI_FIGURE_BUTTERAUGLI] = {.name = "butteraugli", .unit = "", .max = 1e30},
    [CLI_FIGURE_VISIBLE] = {.name = "visible", .unit = "", .is_share = true},
    [CLI_FIGURE_NONFINITE] = {.name = "nonfinite", .unit = "", .is_share = true}};

/* ---- limits ---- */

static bool find_figure(const char *name, size_t length, enum cli_figure *found, struct fl_error *error)
{
    char known[160] = "";
    for (size_t i = 0; i < CLI_FIGURE_COUNT; i++) {
        if (strlen(figures[i].name) == length && strncmp(figures[i].name, name, length) == 0) {
            *found = (enum cli_figure)i;
            return true;
        }
        const size_t used = strlen(known);
        snprintf(known + used, sizeof(known) - used, "%s%s", used > 0 ? ", " : "", figures[i].name);
    }
    fl_error_set(error, FL_ERROR_ARGUMENT, "", "'%.*s' is not a figure", (int)(length < 80 ? length : 80), name);
    return fl_error_remedy(error, "known: %s", known);
}

bool cli_share_parse(const char *text, double *share, struct fl_error *error)
{
    char number[64];
    const size_t length = strlen(text);
    if (length == 0 || length >= sizeof(number) || text[length - 1] != '%')
        return fl_text_real(text, 0, 1, share, error);
    memcpy(number, text, length - 1);
    number[length - 1] = '\0';
    if (!fl_text_real(number, 0, 100, share, error))
        return false;
    *share /= 100;
    return true;
}

bool cli_limits_add(struct cli_limits *limits, const char *text, struct fl_error *error)
{
    struct cli_limit limit = {.figure = CLI_FIGURE_MAX};
    const char *equals = strchr(text, '=');
    if (equals && !find_figure(text, (size_t)(equals - text), &limit.figure, error))
        return false;
    if (limits->count == CLI_LIMITS_MAX)
        return fl_error_set(error, FL_ERROR_ARGUMENT, "", "at most %u limits", CLI_LIMITS_MAX);
    const struct figure *figure = &figures[limit.figure];
    const char *value = equals ? equals + 1 : text;
    if (!figure->is_share && strchr(value, '%'))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "",
                            "'%s' is not a share of the pixels, so it cannot be a percentage", figure->name);
    if (figure->is_share ? !cli_share_parse(value, &limit.value, error)
                         : !fl_text_real(value, figure->min, figure->max, &limit.value, error))
        return false;
    limits->limits[limits->count++] = limit;
    return true;
}

static double share(uint64_t pixels, const struct fl_comparison *comparison)
{
    return (double)pixels / (double)comparison->pixels;
}

/* NaN: not measured. */
static double value_of(enum cli_figure figure, const struct fl_comparison *comparison)
{
    const double unknown = (double)NAN;
    switch (figure) {
    case CLI_FIGURE_PSNR:
        return comparison->has_errors ? comparison->psnr_db : unknown;
    case CLI_FIGURE_SHOWN_PSNR:
        return comparison->has_errors ? comparison->shown_psnr_db : unknown;
    case CLI_FIGURE_MEAN:
        return comparison->has_errors ? comparison->mean_error : unknown;
    case CLI_FIGURE_RMS:
        return comparison->has_errors ? comparison->rms_error : unknown;
    case CLI_FIGURE_MAX:
        return comparison->has_errors ? comparison->max_error : unknown;
    case CLI_FIGURE_BEYOND:
        return share(comparison->beyond, comparison);
    case CLI_FIGURE_SSIM:
        return comparison->has_ssim ? comparison->ssim : unknown;
    case CLI_FIGURE_BUTTERAUGLI:
        return comparison->has_butteraugli ? comparison->butteraugli : unknown;
    case CLI_FIGURE_VISIBLE:
        return comparison->has_butteraugli ? share(comparison->visible, comparison) : unknown;
    default:
        return share(comparison->nonfinite, comparison);
    }
}

static bool holds(const struct cli_limit *limit, const struct fl_comparison *comparison)
{
    const double value = value_of(limit->figure, comparison);
    return figures[limit->figure].less_fails ? value >= limit->value : value <= limit->value;
}

/* True if there are pixels that are not finite, and no limit for them. */
static bool has_stray_pixels(const struct cli_limits *limits, const struct fl_comparison *comparison)
{
    for (size_t i = 0; i < limits->count; i++)
        if (limits->limits[i].figure == CLI_FIGURE_NONFINITE)
            return false;
    return limits->count > 0 && comparison->nonfinite > 0;
}

bool cli_limits_hold(const struct cli_limits *limits, const struct fl_comparison *comparison)
{
    for (size_t i = 0; i < limits->count; i++)
        if (!holds(&limits->limits[i], comparison))
            return false;
    return !has_stray_pixels(limits, comparison);
}

/* ---- text ---- */

static void print_psnr(FILE *out, double psnr_db, const char *of)
{
    if (isfinite(psnr_db))
        fprintf(out, "  %-16s%.3f dB (%s)\n", "PSNR", psnr_db, of);
    else
        fprintf(out, "  %-16sinfinite: no error (%s)\n", "PSNR", of);
}

static void print_errors(FILE *out, const struct fl_comparison *comparison)
{
    if (!comparison->has_errors)
        return;
    const bool is_linear = comparison->space == PROTOCOL_COMPARISON_SPACE_LINEAR;
    print_psnr(out, comparison->psnr_db,
               is_linear ? "of linear light; peak: white, 1, not the highlights" : "peak: white, 1");
    if (is_linear)
        print_psnr(out, comparison->shown_psnr_db, "tone-mapped, as a screen shows it; peak: white, 1");
    fprintf(out, "  %-16s%.6g\n", "mean error", comparison->mean_error);
    fprintf(out, "  %-16s%.6g\n", "rms error", comparison->rms_error);
    fprintf(out, "  %-16s%.6g", "maximum error", comparison->max_error);
    if (comparison->max_error > 0)
        fprintf(out, " at %u,%u, channel %u of %s", comparison->max_error_x, comparison->max_error_y,
                comparison->max_error_channel + 1, comparison->channel_names);
    fputc('\n', out);
}

static void print_limits(FILE *out, const struct fl_comparison *comparison, const struct cli_limits *limits)
{
    for (size_t i = 0; i < limits->count; i++) {
        const struct cli_limit *limit = &limits->limits[i];
        const struct figure *figure = &figures[limit->figure];
        const double value = value_of(limit->figure, comparison), unit = figure->is_share ? 100 : 1;
        if (holds(limit, comparison))
            continue;
        fprintf(out, "  over the limit: %s ", figure->name);
        if (isnan(value))
            fputs("was not measured", out);
        else
            fprintf(out, "%.6g%s", value * unit, figure->is_share ? " %" : figure->unit);
        fprintf(out, ", %s %.6g%s\n", figure->less_fails ? "at least" : "at most", limit->value * unit,
                figure->is_share ? " %" : figure->unit);
    }
    if (has_stray_pixels(limits, comparison))
        fprintf(out, "  over the limit: %" PRIu64 " pixels are not finite, and 'nonfinite' has no limit\n",
                comparison->nonfinite);
}

void cli_comparison_print(FILE *out, const struct fl_comparison *comparison, const struct cli_limits *limits)
{
    fprintf(out, "  %-16s%ux%u, %s, %s\n", "pixels", comparison->width, comparison->height,
            comparison->channel_names,
            comparison->space == PROTOCOL_COMPARISON_SPACE_LINEAR ? "linear light" : "sRGB, 0 to 1");
    print_errors(out, comparison);
    fprintf(out, "  beyond %-9.4g%.6g %% (%" PRIu64 " pixels)\n", (double)comparison->threshold,
            100 * share(comparison->beyond, comparison), comparison->beyond);
    if (comparison->has_ssim)
        fprintf(out, "  %-16s%.6f\n", "SSIM", comparison->ssim);
    if (comparison->has_butteraugli)
        fprintf(out, "  %-16s%.4g (3-norm), maximum %.4g; %.4g %% of the pixels above 1\n", "Butteraugli",
                comparison->butteraugli, comparison->butteraugli_max,
                100 * share(comparison->visible, comparison));
    if (comparison->nonfinite > 0)
        fprintf(out,
                "  %-16s%" PRIu64 " pixels (%" PRIu64 " in the first, %" PRIu64
                " in the second): beyond, and in no other figure\n",
                "not finite", comparison->nonfinite, comparison->nonfinite_a, comparison->nonfinite_b);
    if (comparison->picture_width > 0 && comparison->max_error > 0)
        fprintf(out, "  %-16s%ux%u, errors from black, 0, to light yellow, %.4g, on a square-root scale\n",
                "picture", comparison->picture_width, comparison->picture_height, comparison->heat_top);
    else if (comparison->picture_width > 0)
        fprintf(out, "  %-16s%ux%u, black: no error\n", "picture", comparison->picture_width,
                comparison->picture_height);
    print_limits(out, comparison, limits);
}

/* ---- JSON ---- */

static json_t *number(double value)
{
    return isfinite(value) ? json_real(value) : json_null();
}

static void set(json_t *object, const char *name, uint64_t value)
{
    json_object_set_new(object, name, json_integer((json_int_t)value));
}

static json_t *limits_array(const struct cli_limits *limits, const struct fl_comparison *comparison)
{
    json_t *array = json_array();
    for (size_t i = 0; i < limits->count; i++) {
        const struct cli_limit *limit = &limits->limits[i];
        json_array_append_new(array, json_pack("{s:s,s:f,s:b}", "figure", figures[limit->figure].name, "limit",
                                               limit->value, "within", holds(limit, comparison) ? 1 : 0));
    }
    return array;
}

static json_t *max_error_at(const struct fl_comparison *comparison)
{
    return comparison->has_errors && comparison->max_error > 0
               ? json_pack("{s:I,s:I,s:I}", "x", (json_int_t)comparison->max_error_x, "y",
                           (json_int_t)comparison->max_error_y, "channel",
                           (json_int_t)comparison->max_error_channel)
               : json_null();
}

json_t *cli_comparison_json(const struct fl_comparison *comparison, const struct cli_limits *limits)
{
    json_t *object =
        json_pack("{s:s,s:s,s:b,s:f,s:f}", "channels", comparison->channel_names, "space",
                  protocol_comparison_space_text(comparison->space), "identical", comparison->identical ? 1 : 0,
                  "peak", 1.0, "threshold", (double)comparison->threshold);
    set(object, "width", comparison->width);
    set(object, "height", comparison->height);
    set(object, "pixels", comparison->pixels);
    for (size_t i = 0; i < CLI_FIGURE_COUNT; i++)
        json_object_set_new(object, figures[i].name, number(value_of((enum cli_figure)i, comparison)));
    json_object_set_new(object, "max_at", max_error_at(comparison));
    json_object_set_new(object, "butteraugli_max",
                        comparison->has_butteraugli ? number(comparison->butteraugli_max) : json_null());
    set(object, "beyond_pixels", comparison->beyond);
    set(object, "visible_pixels", comparison->visible);
    set(object, "nonfinite_pixels", comparison->nonfinite);
    set(object, "nonfinite_pixels_a", comparison->nonfinite_a);
    set(object, "nonfinite_pixels_b", comparison->nonfinite_b);
    set(object, "picture_width", comparison->picture_width);
    set(object, "picture_height", comparison->picture_height);
    json_object_set_new(object, "heat_top",
                        comparison->picture_width > 0 ? number(comparison->heat_top) : json_null());
    json_object_set_new(object, "limits", limits_array(limits, comparison));
    json_object_set_new(object, "within", json_boolean(cli_limits_hold(limits, comparison)));
    return object;
}

int cli_trouble(const struct fl_error *error)
{
    const int status = cli_report(error);
    return status == CLI_FAILED ? CLI_TROUBLE : status;
}
