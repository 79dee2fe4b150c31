/* SPDX-License-Identifier: MIT */
#include "cli/job_options.h"

#include "lib/text.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295

static const struct argp_option options[] = {
    {"output", KEY_OUTPUT, "IMAGE", 0, "Image file; its ending is its format. '-' is standard output", 0},
    {"format", KEY_FORMAT, "FORMAT", 0, "png, jpeg, exr, hdr, where the ending does not say it", 0},
    {"half", KEY_HALF, NULL, 0, "EXR of half floats (default)", 0},
    {"float", KEY_FLOAT, NULL, 0, "EXR of 32-bit floats", 0},
    {"server", KEY_SERVER, "ADDRESS", 0,
     "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] (default: a private daemon for this command)", 0},
    {"key", KEY_KEY, "FILE", 0,
     "Key that the daemon has as well: the connection is sealed (default for tcp: FARLIGHT_KEY)", 0},
    {NULL, 0, NULL, 0, "Picture:", 1},
    {"size", KEY_SIZE, "WxH", 0, "Pixels (default 1280x720)", 0},
    {"samples", KEY_SAMPLES, "N", 0, "Samples per pixel (default 1; 16 for the integrator ao, 64 for path)", 0},
    {"filter", KEY_FILTER, "NAME", 0,
     "How samples are spread about a pixel: blackman-harris (default), gaussian, tent, box", 0},
    {"seed", KEY_SEED, "N", 0, "Same seed, same picture (default 0)", 0},
    {"environment", KEY_ENVIRONMENT, "FILE", 0, "Equirectangular image (HDR or EXR) that lights the scene", 0},
    {"exposure", KEY_EXPOSURE, "STOPS", 0, "Multiply the picture by 2 to this power (default 0)", 0},
    {"tone-map", KEY_TONE_MAP, "NAME", 0, "neutral, aces or none, for PNG and JPEG (default neutral)", 0},
    {"layers", KEY_LAYERS, "NAME,..", 0,
     "What an EXR file has: beauty (the picture, default), albedo, normal, depth, position, ao, id", 0},
    {NULL, 0, NULL, 0, "Camera (default: the model's first, else one that sees all of it):", 2},
    {"camera", KEY_CAMERA, "NAME|INDEX", 0, "A camera of the model ('farlight info' lists them)", 0},
    {"eye", KEY_EYE, "X,Y,Z", 0, "Place of the camera; needs --look-at", 0},
    {"look-at", KEY_LOOK_AT, "X,Y,Z", 0, "What is in the middle of the picture", 0},
    {"up", KEY_UP, "X,Y,Z", 0, "Upward direction (default 0,1,0)", 0},
    {"fov", KEY_FOV, "DEGREES", 0, "Vertical field of view (default 45)", 0},
    {"aperture", KEY_APERTURE, "METRES", 0,
     "Diameter of the lens: what is not at --focus is out of focus (default 0: all is sharp)", 0},
    {"focus", KEY_FOCUS, "METRES", 0, "Distance that is sharp (default: that of what is looked at)", 0},
    {"shutter", KEY_SHUTTER, "FRAMES", 0,
     "How long the shutter is open; 0.5 is a film camera's 180 degrees (default 0: nothing moves in a frame)", 0},
    {NULL, 0, NULL, 0, "Clips of the model ('farlight info' lists them):", 3},
    {"clip", KEY_CLIP, "NAME|INDEX", 0,
     "Play it; may be repeated, the later one counts where both move the same node", 0},
    {"clip-once", KEY_CLIP_ONCE, NULL, 0, "Stop at the clips' end (default: begin again)", 0},
    {"clip-start", KEY_CLIP_START, "SECONDS", 0, "When they begin (default 0; negative: they run already)", 0},
    {"clip-speed", KEY_CLIP_SPEED, "FACTOR", 0, "How fast they run (default 1)", 0},
    {NULL, 0, NULL, 0, "Method:", 4},
    {"tracer", KEY_TRACER, "NAME", 0, "bvh (default), naive, reference, ldc, abuffer", 0},
    {"primary", KEY_PRIMARY, "NAME", 0,
     "First hits: raster, trace (default: raster, but trace for the tracer reference)", 0},
    {"encoding", KEY_ENCODING, "NAME", 0,
     "How pixels travel: raw, zstd, predicted, jpeg (default: raw on this machine, zstd over a network)", 0},
    {"quality", KEY_QUALITY, "N", 0,
     "JPEG quality 1 to 100, zstd level 1 to 19, or rate factor of a video, 1 (best) to 51", 0},
    {NULL, 0, NULL, 0, "Light:", 5},
    {"integrator", KEY_INTEGRATOR, "NAME", 0,
     "whitted, distributed, raycast, ao, path (default: distributed for several samples, a lens or a shutter, "
     "else "
     "whitted)",
     0},
    {"depth", KEY_DEPTH, "N", 0, "Bounces after the first hit, 0 to 32 (default 8)", 0},
    {"bounces", KEY_BOUNCES, "N", 0, "The same as --depth", 0},
    {"brdf", KEY_BRDF, "NAME", 0, "How rough surfaces reflect, for path: ggx (default), ward", 0},
    {"ao-distance", KEY_AO_DISTANCE, "METRES", 0,
     "What is farther away does not occlude, for ao (default 0: a tenth of the scene's diagonal)", 0},
    {"ao-falloff", KEY_AO_FALLOFF, "POWER", 0,
     "How much less counts what is farther: a power of 1 - distance / --ao-distance, 0 to 64 (default 0: all the "
     "same)",
     0},
    {"ao-rays", KEY_AO_RAYS, "N", 0, "Rays for each sample, for ao, 1 to 256 (default 8)", 0},
    {"layer-opacity", KEY_LAYER_OPACITY, "SHARE", 0,
     "Of opaque surfaces, for raycast: how much of what lies behind they hide, up to 1 (default 0.5)", 0},
    {NULL, 0, NULL, 0, "Tracer bvh, a hierarchy of bounding volumes:", 6},
    {"bvh-bounds", KEY_BVH_BOUNDS, "NAME", 0, "auto (default), box, sphere", 0},
    {"bvh-rays", KEY_BVH_RAYS, "N", 0,
     "Rays that walk the bvh as one: 1, 2, 3, 4, 8 (default 0: chosen for each wave)", 0},
    {NULL, 0, NULL, 0, "Tracer ldc, surfaces sampled along three axes:", 7},
    {"ldc-resolution", KEY_LDC_RESOLUTION, "N", 0,
     "Cells along the longest side of the sampled box, 16 to 4096 (default 1024)", 0},
    {"ldc-tolerance", KEY_LDC_TOLERANCE, "METRES", 0,
     "Hit a sample where the ray comes this near to it (default 0: where it crosses the sample's plane)", 0},
    {"ldc-build", KEY_LDC_BUILD, "NAME", 0, "auto (default), peel: layer by layer, lists: all in one pass", 0},
    {"ldc-levels", KEY_LDC_LEVELS, "NAME", 0,
     "What leads over emptiness: auto (default), blocks of one size, pyramid of all sizes, cells: one tree of all "
     "three sides",
     0},
    {"ldc-images", KEY_LDC_IMAGES, "NAME", 0,
     "overlap (default): no cracks between the three images, one: a surface is in one of them alone", 0},
    {"ldc-block", KEY_LDC_BLOCK, "N", 0, "Texels along a side of a block: 2, 4, 8, 16, 32 (default 8)", 0},
    {"ldc-rays", KEY_LDC_RAYS, "N", 0, "Rays that walk as one: 1, 4 (default 0: chosen)", 0},
    {NULL, 0, NULL, 0, "Tracer abuffer, a voxel grid over lists of surfaces:", 8},
    {"abuffer-resolution", KEY_ABUFFER_RESOLUTION, "N", 0,
     "Texels along a side of the lists' images, 16 to 4096 (default 1280)", 0},
    {"voxels", KEY_VOXELS, "N", 0,
     "Along a side of the grid: auto (default: by the resolution), 16, 32, 64, 128, 256", 0},
    {"search", KEY_SEARCH, "NAME", 0,
     "How a crossing is found in a voxel: dda (default), the most exact, linear3, linear1, the fastest", 0},
    {NULL, 0, NULL, 0, "Talk:", 9},
    {"timings", KEY_TIMINGS, "json", OPTION_ARG_OPTIONAL,
     "Print the time of every stage, as a table or as JSON, one object a line", 0},
    {"trace-file", KEY_TRACE_FILE, "FILE", 0,
     "Write every stage to FILE as trace events, for ui.perfetto.dev or chrome://tracing", 0},
    {"quiet", KEY_QUIET, NULL, 0, "No progress, no notes about the model", 0},
    {0}};

error_t cli_usage(struct cli_job *job, const char *field, const char *format, ...)
{
    char text[600];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    fl_error_set(&job->error, FL_ERROR_ARGUMENT, field, "%s", text);
    return EINVAL;
}

/* An error of lib/text.h gets the option's name. */
static error_t name_field(struct cli_job *job, const char *field)
{
    snprintf(job->error.field, sizeof job->error.field, "%s", field);
    return EINVAL;
}

error_t job_unknown_value(struct cli_job *job, const char *field, const char *enum_name, const char *value)
{
    char known[200], words[40];
    size_t length = 0;
    for (const char *at = enum_name; *at != '\0' && length + 1 < sizeof words; at++)
        words[length++] = *at == '_' ? ' ' : *at;
    words[length] = '\0';
    cli_usage(job, field, "unknown %s '%s'", words, value);
    fl_error_remedy(&job->error, "known: %s", protocol_enum_list(enum_name, known, sizeof known));
    return EINVAL;
}

error_t job_set_integer(struct cli_job *job, const char *field, const char *value, uint64_t least,
                        uint64_t greatest, uint64_t *number)
{
    return fl_text_integer(value, least, greatest, number, &job->error) ? 0 : name_field(job, field);
}

static error_t set_vector(struct cli_job *job, const char *field, const char *value, float vector[3], bool *is_set)
{
    *is_set = true;
    return fl_text_vector(value, vector, &job->error) ? 0 : name_field(job, field);
}

/* Options whose value is a name. */
static error_t set_name(struct cli_job *job, int key, const char *field, const char *value)
{
    struct fl_job_options *wanted = &job->options;
    switch (key) {
    case KEY_PRIMARY:
        job->has_primary = true;
        return protocol_primary_parse(value, &wanted->primary) ? 0
                                                               : job_unknown_value(job, field, "primary", value);
    case KEY_TONE_MAP:
        return protocol_tone_map_parse(value, &wanted->tone_map)
                   ? 0
                   : job_unknown_value(job, field, "tone_map", value);
    case KEY_ENCODING:
        job->has_encoding = true;
        return protocol_encoding_parse(value, &wanted->encoding)
                   ? 0
                   : job_unknown_value(job, field, "encoding", value);
    case KEY_FILTER:
        return protocol_pixel_filter_parse(value, &wanted->pixel_filter)
                   ? 0
                   : job_unknown_value(job, field, "pixel_filter", value);
    case KEY_FORMAT:
        job->image = cli_image_by_name(value);
        return job->image != CLI_IMAGE_UNKNOWN
                   ? 0
                   : cli_usage(job, field, "unknown format '%s' (known: png, jpeg, exr, hdr, mp4, mkv, y4m)",
                               value);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

error_t job_set_real(struct cli_job *job, const char *field, const char *value, double least, double greatest,
                     double *number)
{
    return fl_text_real(value, least, greatest, number, &job->error) ? 0 : name_field(job, field);
}

/* Options of lens, shutter and clips whose value is a number. */
static error_t set_motion_number(struct cli_job *job, int key, const char *field, const char *value)
{
    struct fl_job_options *wanted = &job->options;
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_APERTURE:
        job->has_aperture = true;
        status = job_set_real(job, field, value, 0, 1e6, &real);
        wanted->aperture = (float)real;
        return status;
    case KEY_FOCUS:
        job->has_focus = true;
        status = job_set_real(job, field, value, 0, 1e12, &real);
        wanted->focus = (float)real;
        return status;
    case KEY_SHUTTER:
        status = job_set_real(job, field, value, 0, 64, &real);
        wanted->shutter = (float)real;
        return status;
    case KEY_CLIP_START:
        return job_set_real(job, field, value, -1e6, 1e6, &job->clip_start_s);
    case KEY_CLIP_SPEED:
        return job_set_real(job, field, value, 0.001, 1000, &job->clip_speed);
    default:
        return ARGP_ERR_UNKNOWN;
    }
}

/* Options whose value is a number. */
static error_t set_number(struct cli_job *job, int key, const char *field, const char *value)
{
    struct fl_job_options *wanted = &job->options;
    uint64_t number = 0;
    double real = 0;
    error_t status = 0;
    switch (key) {
    case KEY_SIZE:
        return fl_text_size(value, &wanted->width, &wanted->height, &job->error) ? 0 : name_field(job, field);
    case KEY_SAMPLES:
        status = job_set_integer(job, field, value, 1, 65536, &number);
        wanted->samples = (uint32_t)number;
        return status;
    case KEY_SEED:
        return job_set_integer(job, field, value, 0, UINT64_MAX, &wanted->seed);
    case KEY_QUALITY:
        job->has_quality = true;
        status = job_set_integer(job, field, value, 1, 100, &number);
        wanted->quality = (unsigned)number;
        return status;
    case KEY_EXPOSURE:
        if (!fl_text_real(value, -64, 64, &real, &job->error))
            return name_field(job, field);
        wanted->exposure_stops = (float)real;
        return 0;
    case KEY_FOV:
        if (!fl_text_real(value, 0.1, 177, &real, &job->error))
            return name_field(job, field);
        job->key.fov_y = (float)(real * RADIANS_PER_DEGREE);
        job->has_fov = true;
        return 0;
    default:
        return set_motion_number(job, key, field, value);
    }
}

static error_t set_option(struct cli_job *job, int key, const char *field, const char *value)
{
    switch (key) {
    case KEY_SERVER:
        job->server = value;
        return 0;
    case KEY_KEY:
        job->key_file = value;
        return 0;
    case KEY_OUTPUT:
        job->output = value;
        return 0;
    case KEY_ENVIRONMENT:
        job->environment = value;
        return 0;
    case KEY_CAMERA:
        job->camera = value;
        return 0;
    case KEY_EYE:
        return set_vector(job, field, value, job->key.eye_world, &job->has_eye);
    case KEY_LOOK_AT:
        return set_vector(job, field, value, job->key.look_at_world, &job->has_look_at);
    case KEY_UP:
        return set_vector(job, field, value, job->key.up_world, &job->has_up);
    case KEY_HALF:
        job->half_pixels = true;
        return 0;
    case KEY_FLOAT:
        job->float_pixels = true;
        return 0;
    case KEY_CLIP:
        if (job->clip_count == CLI_CLIPS_MAX)
            return cli_usage(job, field, "more than %d clips cannot be played at once", CLI_CLIPS_MAX);
        job->clips[job->clip_count++] = (struct cli_clip){.which = value};
        return 0;
    case KEY_CLIP_ONCE:
        job->clip_once = true;
        return 0;
    case KEY_QUIET:
        job->quiet = true;
        return 0;
    case KEY_TRACE_FILE:
        job->trace_file = value;
        return 0;
    case KEY_TIMINGS:
        if (value != NULL && strcmp(value, "json") != 0)
            return cli_usage(job, field, "'%s' is not known (known: json)", value);
        job->timings = value != NULL ? CLI_TIMINGS_JSON : CLI_TIMINGS_TABLE;
        return 0;
    default: {
        error_t status = set_name(job, key, field, value);
        status = status == ARGP_ERR_UNKNOWN ? job_set_tracer(job, key, field, value) : status;
        status = status == ARGP_ERR_UNKNOWN ? job_set_light(job, key, field, value) : status;
        return status == ARGP_ERR_UNKNOWN ? set_number(job, key, field, value) : status;
    }
    }
}

static const struct argp_option *find_option(int key)
{
    for (const struct argp_option *option = options; option->name != NULL || option->doc != NULL; option++)
        if (option->name != NULL && option->key == key)
            return option;
    return NULL;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    const struct argp_option *option = find_option(key);
    char field[40];
    if (option == NULL)
        return ARGP_ERR_UNKNOWN;
    snprintf(field, sizeof field, "--%s", option->name);
    return set_option(state->input, key, field, value);
}

error_t cli_job_set(struct cli_job *job, const char *name, const char *value)
{
    for (const struct argp_option *option = options; option->name != NULL || option->doc != NULL; option++)
        if (option->name != NULL && strcmp(option->name, name) == 0)
            return set_option(job, option->key, name, value);
    return ARGP_ERR_UNKNOWN;
}

const struct argp cli_job_argp = {.options = options, .parser = parse};

/* Some of the options are left out. */
static void keep(struct argp_option *kept, const int *left_out, size_t left_out_count)
{
    size_t count = 0;
    for (size_t i = 0; i < sizeof options / sizeof options[0]; i++) {
        bool is_kept = true;
        for (size_t k = 0; k < left_out_count; k++)
            is_kept = is_kept && options[i].key != left_out[k];
        if (is_kept)
            kept[count++] = options[i];
    }
}

const struct argp *cli_picture_argp(void)
{
    static const int left_out[] = {KEY_OUTPUT, KEY_FORMAT,  KEY_HALF,    KEY_FLOAT,      KEY_TONE_MAP,
                                   KEY_TRACER, KEY_PRIMARY, KEY_TIMINGS, KEY_TRACE_FILE, KEY_LAYERS};
    static struct argp_option kept[sizeof options / sizeof options[0]];
    static const struct argp argp = {.options = kept, .parser = parse};
    keep(kept, left_out, sizeof left_out / sizeof left_out[0]);
    return &argp;
}

const struct argp *cli_view_argp(void)
{
    static const int left_out[] = {KEY_OUTPUT,  KEY_FORMAT,     KEY_HALF,       KEY_FLOAT,
                                   KEY_SAMPLES, KEY_INTEGRATOR, KEY_TIMINGS,    KEY_TRACE_FILE,
                                   KEY_LAYERS,  KEY_CLIP_ONCE,  KEY_CLIP_START, KEY_ENCODING};
    static struct argp_option kept[sizeof options / sizeof options[0]];
    static const struct argp argp = {.options = kept, .parser = parse};
    keep(kept, left_out, sizeof left_out / sizeof left_out[0]);
    return &argp;
}

/* FARLIGHT_SIZE for --size, and so on. */
static bool read_environment(struct cli_job *job)
{
    static const int keys[] = {KEY_SERVER,      KEY_SIZE,           KEY_SAMPLES,
                               KEY_DEPTH,       KEY_SEED,           KEY_EXPOSURE,
                               KEY_TONE_MAP,    KEY_TRACER,         KEY_BVH_BOUNDS,
                               KEY_INTEGRATOR,  KEY_PRIMARY,        KEY_ENCODING,
                               KEY_QUALITY,     KEY_ENVIRONMENT,    KEY_APERTURE,
                               KEY_FOCUS,       KEY_SHUTTER,        KEY_FILTER,
                               KEY_BVH_RAYS,    KEY_LDC_RESOLUTION, KEY_LDC_TOLERANCE,
                               KEY_LDC_BUILD,   KEY_LDC_LEVELS,     KEY_LDC_IMAGES,
                               KEY_LDC_BLOCK,   KEY_LDC_RAYS,       KEY_ABUFFER_RESOLUTION,
                               KEY_VOXELS,      KEY_SEARCH,         KEY_BOUNCES,
                               KEY_AO_DISTANCE, KEY_AO_FALLOFF,     KEY_AO_RAYS,
                               KEY_BRDF,        KEY_LAYER_OPACITY};
    for (size_t i = 0; i < sizeof keys / sizeof keys[0]; i++) {
        char field[40] = "FARLIGHT_";
        size_t length = strlen(field);
        for (const char *at = find_option(keys[i])->name; *at != '\0'; at++)
            field[length++] = *at == '-' ? '_' : (char)toupper((unsigned char)*at);
        field[length] = '\0';
        const char *value = getenv(field);
        if (value != NULL && value[0] != '\0' && set_option(job, keys[i], field, value) != 0)
            return false;
    }
    return true;
}

bool cli_job_begin(struct cli_job *job)
{
    *job = (struct cli_job){.key = {.up_world = {0, 1, 0}, .fov_y = (float)(45 * RADIANS_PER_DEGREE)}};
    return read_environment(job);
}
