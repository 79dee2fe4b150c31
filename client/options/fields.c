/* SPDX-License-Identifier: MIT */
/* The list of options that are fields of `render`. */
#include "fields.h"

#include "lib/text.h"
#include "job.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <string.h>

#define FIELDS_MAX 96
#define GIVEN(member) offsetof(struct cli_job, member)

/* Options that belong to no tracer. A doc that does not end with a bracket gets the allowed values and the
 * default. */
static const struct row {
    const char *option, *field, *argument, *doc;
    int group;
    size_t given_offset;
    bool is_of_shot;
} rows[] = {
    {"samples", "samples", "N",
     "Samples per pixel, or auto: until no noise is seen, up to 256 (default 16 for a picture, 1 for animations "
     "and "
     "comparisons; 16 for the integrator ao, 64 for path)",
     CLI_GROUP_PICTURE, GIVEN(sampling.has_samples), true},
    {"noise", "noise", "ERROR",
     "Sample each part of the picture until its error is below this, such as 0.02 for 2 %; --samples is the most "
     "that a pixel gets (default 4096)",
     CLI_GROUP_PICTURE, 0, true},
    {"filter", "pixel_filter", "NAME", "Filter that spreads samples about a pixel", CLI_GROUP_PICTURE, 0, true},
    {"seed", "seed", "N", "Seed of random numbers; the same seed gives the same picture (default 0)",
     CLI_GROUP_PICTURE, 0, true},
    {"exposure", "exposure_stops", "STOPS", "Multiply the picture by 2 to this power", CLI_GROUP_PICTURE, 0, true},
    {"tone-map", "tone_map", "NAME", "Conversion of linear light to colours of PNG and JPEG", CLI_GROUP_PICTURE, 0,
     true},
    {"wireframe", "wireframe", "PIXELS", "Draw the edges of triangles, in lines of this width (default 0: none)",
     CLI_GROUP_PICTURE, 0, false},
    {"azimuth", "auto_azimuth", "DEGREES",
     "Look from this side: 0 is the front (+z), 90 the right (+x), 180 the back (default 24)", CLI_GROUP_CAMERA,
     GIVEN(camera.has_framing), true},
    {"elevation", "auto_elevation", "DEGREES", "Look down by this angle: 0 is level, 90 from the top (default 18)",
     CLI_GROUP_CAMERA, GIVEN(camera.has_framing), true},
    {"zoom", "auto_zoom", "FACTOR", "Magnify the middle of the picture (default 1: all is in view)",
     CLI_GROUP_CAMERA, GIVEN(camera.has_framing), true},
    {"margin", "auto_margin", "SHARE",
     "Share of the picture left free at the edges that the model would touch (default 0.03)", CLI_GROUP_CAMERA,
     GIVEN(camera.has_framing), true},
    {"aperture", "aperture", "METRES",
     "Diameter of the lens: objects away from --focus are blurred (default 0: all is sharp)", CLI_GROUP_CAMERA,
     GIVEN(camera.has_aperture), false},
    {"focus", "focus", "METRES", "Distance in focus (default: the distance of the point looked at)",
     CLI_GROUP_CAMERA, GIVEN(camera.has_focus), false},
    {"shutter", "shutter", "FRAMES",
     "Open time of the shutter; 0.5 is a film camera's 180 degrees (default 0: nothing moves in a frame)",
     CLI_GROUP_CAMERA, 0, true},
    {"tracer", "tracer", "NAME", "Algorithm that finds intersections ('farlight tracers' explains them)",
     CLI_GROUP_METHOD, 0, true},
    {"primary", "primary", "NAME",
     "Method that finds first hits: raster, trace, or auto, chosen for tracer and device (default)",
     CLI_GROUP_METHOD, GIVEN(given.primary), true},
    {"encoding", "encoding", "NAME",
     "Encoding of pixels on the connection: raw, zstd, predicted, jpeg (default: raw on this machine, zstd over a "
     "network)",
     CLI_GROUP_METHOD, GIVEN(given.encoding), true},
    {"quality", "quality", "N",
     "Quality of JPEG and WebP, 1 to 100, zstd level 1 to 19, or rate factor of a video, 1 (best) to 51 (default "
     "0: by the "
     "encoding)",
     CLI_GROUP_METHOD, GIVEN(given.quality), true},
    {"integrator", "integrator", "NAME",
     "Light transport (default: distributed for several samples, a lens or a shutter, else whitted)",
     CLI_GROUP_LIGHT, GIVEN(given.integrator), true},
    {"depth", "depth", "N", "Bounces after the first hit", CLI_GROUP_LIGHT, 0, true},
    {"bounces", "depth", "N", "The same as --depth", CLI_GROUP_LIGHT, 0, true},
    {"brdf", "brdf", "NAME", "Reflection model of rough surfaces, for path", CLI_GROUP_LIGHT, 0, true},
    {"clamp", "clamp", "X",
     "Bound fireflies, for distributed and path: limit light over a rough surface and another one to X times "
     "white, and see no sharp mirror behind a rough one (default 10, with fewer than 64 samples by as much less, "
     "down to 1.25; 0, which is off, for pictures that are refined without an end)",
     CLI_GROUP_LIGHT, GIVEN(given.clamp), true},
    {"ao-distance", "ao_distance", "METRES",
     "Surfaces farther away do not occlude, for ao (default 0: a tenth of the scene's diagonal)", CLI_GROUP_LIGHT,
     0, true},
    {"ao-falloff", "ao_falloff", "POWER",
     "Exponent of the falloff with distance, (1 - distance / --ao-distance)^exponent, 0 to 64 (default 0: none)",
     CLI_GROUP_LIGHT, 0, true},
    {"ao-rays", "ao_rays", "N", "Rays for each sample, for ao", CLI_GROUP_LIGHT, 0, true},
    {"layer-opacity", "layer_opacity", "SHARE",
     "Opacity of opaque surfaces, for raycast: the share of the background that they hide, up to 1 (default 0.5)",
     CLI_GROUP_LIGHT, 0, true},
};
#define ROW_COUNT (sizeof(rows) / sizeof(rows[0]))

static struct field_desc leaves[FIELDS_MAX]; /* fields of the message and its records, at offsets in it */
static size_t leaf_count;
static struct cli_field fields[FIELDS_MAX];
static size_t field_count;

/* ---- the list ---- */

/* Writes "Bounding volume of a node: auto (default), box, sphere". If `doc` ends with its default, the names
 * come before it; if it lists names itself, because not every encoding suits a batch, nothing is added. */
static void write_choices(char *out, size_t out_bytes, const struct enum_desc *choices)
{
    const char *found = strstr(out, " (default");
    char usual[160];
    snprintf(usual, sizeof(usual), "%s", found ? found : "");
    if (found && memchr(out, ':', (size_t)(found - out)))
        return;
    out[found ? (size_t)(found - out) : strlen(out)] = '\0';
    for (size_t i = 0; i < choices->value_count; i++) {
        const size_t used = strlen(out);
        snprintf(out + used, out_bytes - used, "%s%s%s", i > 0 ? ", " : ": ", choices->values[i].text,
                 !found && choices->values[i].number == 0 ? " (default)" : "");
    }
    const size_t used = strlen(out);
    snprintf(out + used, out_bytes - used, "%s", usual);
}

static void write_help(struct cli_field *option, const char *doc)
{
    char allowed[96], usual[32];
    const struct field_desc *field = option->field;
    const size_t length = strlen(doc);
    snprintf(option->help, sizeof(option->help), "%s", doc);
    option->help[0] = (char)toupper((unsigned char)doc[0]);
    const size_t used = strlen(option->help);
    if (doc[length - 1] == ')' && !field->tracer && field->kind != FIELD_ENUM)
        return;
    if (field->kind == FIELD_ENUM) {
        write_choices(option->help, sizeof(option->help), field->enumeration);
    } else if (field->kind == FIELD_INT && strcmp(option->option, "bounces") != 0) {
        snprintf(option->help + used, sizeof(option->help) - used, "%s%s (default %s)",
                 field->numbers ? ": " : ", ", field_allowed_text(field, allowed, sizeof(allowed)),
                 field_default_text(field, usual, sizeof(usual)));
    } else if (field->kind == FIELD_REAL) {
        snprintf(option->help + used, sizeof(option->help) - used, " (default %s)",
                 field_default_text(field, usual, sizeof(usual)));
    }
}

static const char *argument_of(const struct field_desc *field)
{
    return field->kind == FIELD_ENUM ? "NAME" : field->unit && strcmp(field->unit, "metres") == 0 ? "METRES" : "N";
}

static int group_of(const struct field_desc *field)
{
    enum protocol_tracer tracer = PROTOCOL_TRACER_BVH;
    protocol_tracer_parse(field->tracer, &tracer);
    return CLI_GROUP_TRACERS + (int)tracer;
}

/* A field of the message or of one of its records; NULL: there is none. */
static const struct field_desc *leaf(const char *name)
{
    for (size_t i = 0; i < leaf_count; i++)
        if (strcmp(leaves[i].name, name) == 0)
            return &leaves[i];
    return NULL;
}

static struct cli_field *add(const char *name, const struct field_desc *field)
{
    struct cli_field *option = &fields[field_count++];
    snprintf(option->option, sizeof(option->option), "%s", name);
    snprintf(option->member, sizeof(option->member), "%s", name);
    for (size_t i = 0; name[i] != '\0' && i + 1 < sizeof(option->option); i++) {
        option->option[i] = name[i] == '_' ? '-' : name[i];
        option->member[i] = name[i] == '-' ? '_' : name[i];
    }
    option->field = field;
    return option;
}

static void make_list(void)
{
    leaf_count = struct_leaves(message_describe(MESSAGE_RENDER)->body(), leaves, FIELDS_MAX);
    for (size_t i = 0; i < ROW_COUNT; i++) {
        struct cli_field *option = add(rows[i].option, leaf(rows[i].field));
        option->argument = rows[i].argument;
        option->group = rows[i].group;
        option->given_offset = rows[i].given_offset;
        option->is_of_shot = rows[i].is_of_shot;
        write_help(option, rows[i].doc);
    }
    for (const struct field_desc *field = leaves; field < leaves + leaf_count && field_count < FIELDS_MAX;
         field++) {
        if (!field->tracer)
            continue;
        struct cli_field *option = add(field->name, field);
        option->argument = argument_of(field);
        option->group = group_of(field);
        option->is_of_shot = true;
        write_help(option, field->doc);
    }
}

size_t cli_field_count(void)
{
    if (field_count == 0)
        make_list();
    return field_count;
}

const struct cli_field *cli_field_at(size_t index)
{
    return index < cli_field_count() ? &fields[index] : NULL;
}

const struct cli_field *cli_field_find(const char *option)
{
    for (size_t i = 0; i < cli_field_count(); i++)
        if (strcmp(fields[i].option, option) == 0)
            return &fields[i];
    return NULL;
}

/* ---- values ---- */

error_t cli_unknown_value(struct cli_job *job, const char *name, const char *enum_name, const char *value)
{
    char known[500], words[40];
    size_t length = 0;
    for (const char *at = enum_name; *at != '\0' && length + 1 < sizeof(words); at++)
        words[length++] = *at == '_' ? ' ' : *at;
    words[length] = '\0';
    cli_usage(job, name, "unknown %s '%s'", words, value);
    fl_error_remedy(&job->error, "known: %s", protocol_enum_list(enum_name, known, sizeof(known)));
    return EINVAL;
}

/* Adds the option's name to an error of lib/text.h. */
static error_t name_error(struct cli_job *job, const char *name)
{
    snprintf(job->error.field, sizeof(job->error.field), "%s", name);
    return EINVAL;
}

/* True if both names come from one source. The command line overrides a script, and a script the environment;
 * within one source the two names of a setting must agree. */
static bool is_same_place(const char *name, const char *other)
{
    static const char environment[] = "FARLIGHT_";
    const size_t length = sizeof(environment) - 1;
    const bool typed = name[0] == '-', from_environment = strncmp(name, environment, length) == 0;
    return typed == (other[0] == '-') && from_environment == (strncmp(other, environment, length) == 0);
}

/* --depth and --bounces. */
static error_t check_depth(struct cli_job *job, const char *name, const char *value, uint64_t depth)
{
    if (job->depth_field[0] != '\0' && strcmp(job->depth_field, name) != 0 && depth != job->options.light.depth &&
        is_same_place(job->depth_field, name)) {
        cli_usage(job, name, "%s contradicts %s %u, which is the same", value, job->depth_field,
                  job->options.light.depth);
        fl_error_remedy(&job->error, "leave out one of them");
        return EINVAL;
    }
    snprintf(job->depth_field, sizeof(job->depth_field), "%s", name);
    return 0;
}

static error_t set_int(struct cli_job *job, const struct field_desc *field, const char *name, const char *value,
                       void *place)
{
    char allowed[96], usual[32];
    uint64_t number = 0;
    const bool is_auto = field->zero_is_default && field->default_int == 0 && strcmp(value, "auto") == 0;
    if (!is_auto && !fl_text_integer(value, field->zero_is_default ? 0 : field->min,
                                     field->zero_is_default ? UINT32_MAX : field->max, &number, &job->error))
        name_error(job, name);
    else if (!field_has_number(field, number))
        cli_usage(job, name, "%s is not allowed", value);
    if (job->error.code != FL_ERROR_NONE) {
        if (field->zero_is_default)
            fl_error_remedy(&job->error, field->default_int == 0 ? "known: %s" : "known: %s, or 0 for %s",
                            field_allowed_text(field, allowed, sizeof(allowed)),
                            field_default_text(field, usual, sizeof(usual)));
        return EINVAL;
    }
    if (strcmp(field->name, "depth") == 0 && check_depth(job, name, value, number) != 0)
        return EINVAL;
    field_store_int(field, place, number);
    return 0;
}

static error_t set_real(struct cli_job *job, const struct field_desc *field, const char *name, const char *value,
                        void *place)
{
    double real = 0;
    if (!fl_text_real(value, (double)field->real_min, (double)field->real_max, &real, &job->error))
        return name_error(job, name);
    const float stored = (float)real;
    memcpy(place, &stored, sizeof(stored));
    return 0;
}

static error_t set_enum(struct cli_job *job, const struct field_desc *field, const char *name, const char *value,
                        void *place)
{
    for (size_t i = 0; i < field->enumeration->value_count; i++) {
        if (strcmp(field->enumeration->values[i].text, value) != 0)
            continue;
        field_store_int(field, place, field->enumeration->values[i].number);
        return 0;
    }
    return cli_unknown_value(job, name, field->enumeration->name, value);
}

error_t cli_field_set(struct cli_job *job, const struct cli_field *option, const char *name, const char *value)
{
    const struct field_desc *field = option->field;
    void *place = (char *)&job->options + field->offset;
    const bool is_samples = strcmp(option->option, "samples") == 0;
    if (is_samples)
        job->sampling.is_auto = strcmp(value, "auto") == 0;
    if (option->given_offset != 0)
        *(bool *)((char *)job + option->given_offset) = true;
    if (is_samples && job->sampling.is_auto)
        return 0;
    return field->kind == FIELD_ENUM   ? set_enum(job, field, name, value, place)
           : field->kind == FIELD_REAL ? set_real(job, field, name, value, place)
                                       : set_int(job, field, name, value, place);
}
