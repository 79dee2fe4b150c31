/* SPDX-License-Identifier: MIT */
/* Options of render, animate, view and compare: those that are fields of `render` (fields.h), and those that
 * are more than a field. */
#include "arguments.h"
#include "fields.h"
#include "lib/text.h"
#include "image_path.h"
#include "models.h"
#include "progress.h"
#include "retry.h"
#include "views.h"

#include <ctype.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295
#define TURN_DEGREES 360.0
#define OPTIONS_MAX 160

enum key {
    KEY_SERVER = 's',
    KEY_OUTPUT = 'o',
    KEY_QUIET = 'q',
    KEY_KEY = 0x100,
    KEY_SIZE,
    KEY_CROP,
    KEY_ENVIRONMENT,
    KEY_ENVIRONMENT_ROTATION,
    KEY_VARIANT,
    KEY_EDIT,
    KEY_POINT_SIZE,
    KEY_BACKGROUND,
    KEY_GROUND,
    KEY_STUDIO,
    KEY_DENOISE,
    KEY_CAMERA,
    KEY_EYE,
    KEY_LOOK_AT,
    KEY_UP,
    KEY_FOV,
    KEY_VIEW,
    KEY_FRAME,
    KEY_FORMAT,
    KEY_HALF,
    KEY_FLOAT,
    KEY_EXR_COMPRESSION,
    KEY_COLOUR_SPACE,
    KEY_DISPLAY_VIEW,
    KEY_OCIO,
    KEY_TIMINGS,
    KEY_TRACE_FILE,
    KEY_PROGRESS,
    KEY_CLIP,
    KEY_CLIP_ONCE,
    KEY_CLIP_START,
    KEY_CLIP_SPEED,
    KEY_LAYERS,
    KEY_LIGHT_GROUP,
    KEY_LOST_AFTER,
    KEY_RETRY_FOR,
    KEY_RETRIES,
    KEY_METADATA,
    KEY_PARENTS,
    KEY_AT,
    KEY_VIEWS, /* cli_views_set() has the options that follow */
    KEY_VIEWS_END = KEY_VIEWS + 6,
    KEY_FIELD = 0x200 /* plus the index of the field */
};

/* Options that are more than a field of `render`. */
static const struct argp_option special[] = {
    {"output", KEY_OUTPUT, "IMAGE", 0, "Image file; its ending is its format. '-' is standard output",
     CLI_GROUP_OUTPUT},
    {"parents", KEY_PARENTS, NULL, 0, "Create the folder of --output and its parents if they are missing",
     CLI_GROUP_OUTPUT},
    {"at", KEY_AT, "X,Y,Z[:RX,RY,RZ[:SCALE]]", 0,
     "Place the MODEL named before: metres, degrees about x, then y, then z, and a factor; repeat it for a copy",
     CLI_GROUP_OUTPUT},
    {"format", KEY_FORMAT, "FORMAT", 0,
     "png, jpeg, exr, hdr, webp, tiff or gif, if the ending does not name it; also that of a model from standard "
     "input",
     CLI_GROUP_OUTPUT},
    {"half", KEY_HALF, NULL, 0, "EXR of half floats (default)", CLI_GROUP_OUTPUT},
    {"float", KEY_FLOAT, NULL, 0, "EXR of 32-bit floats", CLI_GROUP_OUTPUT},
    {"exr-compression", KEY_EXR_COMPRESSION, "zip|dwaa", 0,
     "EXR without loss (default), or smaller files: colours lose barely visible detail, other layers nothing",
     CLI_GROUP_OUTPUT},
    {"colour-space", KEY_COLOUR_SPACE, "NAME", 0,
     "Colours of an EXR file: ACEScg, ACES2065-1, Linear Rec.2020, Linear P3-D65, or a space of --ocio (default: "
     "linear Rec.709)",
     CLI_GROUP_OUTPUT},
    {"display-view", KEY_DISPLAY_VIEW, "[DISPLAY/]VIEW", 0,
     "Make pictures of 8 bits by this view of --ocio, such as AgX or an ACES one, in place of --tone-map",
     CLI_GROUP_OUTPUT},
    {"ocio", KEY_OCIO, "FILE", 0, "Configuration of OpenColorIO (default: $OCIO)", CLI_GROUP_OUTPUT},
    {"metadata", KEY_METADATA, "stable|full", 0,
     "Metadata of files: nothing that differs between runs (default), or also times and paths", CLI_GROUP_OUTPUT},
    {"server", KEY_SERVER, "ADDRESS", 0,
     "unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET] (default: a private daemon for this command)",
     CLI_GROUP_OUTPUT},
    {"key", KEY_KEY, "FILE", 0,
     "Key shared with the daemon, which seals the connection (default for tcp: FARLIGHT_KEY)", CLI_GROUP_OUTPUT},
    {"lost-after", KEY_LOST_AFTER, "DURATION", 0,
     "Regard a daemon as lost if it answers nothing for this long, not even a ping, in seconds or as 5m or 2h "
     "(default 1m)",
     CLI_GROUP_OUTPUT},
    {"retry-for", KEY_RETRY_FOR, "DURATION", 0,
     "Reconnect to a lost daemon for this long, in seconds or as 5m or 2h (default 5m, view: until it ends; 0: "
     "never)",
     CLI_GROUP_OUTPUT},
    {"retries", KEY_RETRIES, "N", 0, "Reconnect at most N times in a row, 0 to 1000 (default: no limit)",
     CLI_GROUP_OUTPUT},
    {NULL, 0, NULL, 0, "Picture:", CLI_GROUP_PICTURE},
    {"size", KEY_SIZE, "WxH", 0, "Pixels (default 1280x720)", CLI_GROUP_OUTPUT},
    {"crop", KEY_CROP, "X,Y,W,H", 0,
     "Render and write only these W x H pixels of the picture, from X to the right and Y down", CLI_GROUP_OUTPUT},
    {"environment", KEY_ENVIRONMENT, "FILE", 0, "Equirectangular image (HDR or EXR) that lights the scene",
     CLI_GROUP_OUTPUT},
    {"environment-rotation", KEY_ENVIRONMENT_ROTATION, "DEGREES", 0,
     "Turn the environment about +y by -360 to 360 (default 0: its middle column is +x)", CLI_GROUP_OUTPUT},
    {"variant", KEY_VARIANT, "NAME", 0, "Materials of this variant of a glTF model ('farlight info' lists them)",
     CLI_GROUP_OUTPUT},
    {"edit", KEY_EDIT, "ASSIGNMENT", 0,
     "Change the model, as in material.Steel.roughness=0.2 or hide=Roof; may be repeated ('farlight help edit')",
     CLI_GROUP_OUTPUT},
    {"point-size", KEY_POINT_SIZE, "METRES", 0,
     "Show points as spheres, and lines as tubes, of this diameter (default: by their distances)",
     CLI_GROUP_OUTPUT},
    {"background", KEY_BACKGROUND, "NAME|#RRGGBB", 0,
     "Background behind all surfaces: the environment (default), transparent, or a colour such as '#ffffff'",
     CLI_GROUP_OUTPUT},
    {"ground", KEY_GROUND, NULL, 0,
     "Show the shadows of the model on an invisible ground beneath it; also over a transparent background",
     CLI_GROUP_OUTPUT},
    {"studio", KEY_STUDIO, "on|off", 0,
     "Complete a model for a picture: a ground where it has no light, else a sky beside its lights, except in "
     "rooms (default on)",
     CLI_GROUP_OUTPUT},
    {"denoise", KEY_DENOISE, "on|off|auto", OPTION_ARG_OPTIONAL,
     "Filter the noise of few samples out of the picture (default: auto, up to 64 samples; off for EXR and HDR "
     "files, --crop and comparisons)",
     CLI_GROUP_OUTPUT},
    {"layers", KEY_LAYERS, "NAME,..", 0,
     "Layers of an EXR file: beauty (the picture, default), albedo, normal, depth, position, ao, id, unknown, "
     "crypto-object and crypto-material (Cryptomatte, with names), motion (vectors to the next frame and the one "
     "before); light: the parts that add up to the beauty",
     CLI_GROUP_OUTPUT},
    {"light-group", KEY_LIGHT_GROUP, "NAME=NODE,..", 0,
     "Give an EXR file the layer light_NAME: the light of these nodes and their descendants, lights and glowing "
     "surfaces, and of `environment`; * stands for any characters. May be repeated: up to 7 groups, which add up "
     "to the picture with light_rest, all other light",
     CLI_GROUP_OUTPUT},
    {NULL, 0, NULL, 0, "Camera (default: the model's first, else one that frames all of it):", CLI_GROUP_CAMERA},
    {"camera", KEY_CAMERA, "NAME|INDEX", 0, "A camera of the model ('farlight info' lists them)",
     CLI_GROUP_OUTPUT},
    {"eye", KEY_EYE, "X,Y,Z", 0, "Place of the camera; needs --look-at", CLI_GROUP_OUTPUT},
    {"look-at", KEY_LOOK_AT, "X,Y,Z", 0, "Place in the middle of the picture", CLI_GROUP_OUTPUT},
    {"up", KEY_UP, "X,Y,Z|x|y|z", 0,
     "Upward direction (default y); without --eye, models made with such an axis up are turned", CLI_GROUP_OUTPUT},
    {"fov", KEY_FOV, "DEGREES", 0, "Vertical field of view (default 45; 40 for a camera that frames all)",
     CLI_GROUP_OUTPUT},
    {"view", KEY_VIEW, "NAME", 0,
     "Frame the whole model from the front (+z), back, left (-x), right (+x), top, bottom, or iso: the front "
     "right above",
     CLI_GROUP_OUTPUT},
    {"frame", KEY_FRAME, "NODE", 0, "Frame this node and its descendants ('farlight info' lists them)",
     CLI_GROUP_OUTPUT},
    {NULL, 0, NULL, 0, "Several views in one picture, each of --size:", CLI_GROUP_VIEWS},
    {"stereo", KEY_VIEWS, "METRES", 0, "Two views, from eyes this far apart, such as 0.065", CLI_GROUP_OUTPUT},
    {"stereo-layout", KEY_VIEWS + 1, "side|over|files", 0,
     "Arrangement: side by side (default), the left one above, or separate files: pair-left.png, pair-right.png",
     CLI_GROUP_OUTPUT},
    {"light-field", KEY_VIEWS + 2, "NxM", 0,
     "N x M views, up to 64 each way, from a grid of eyes; needs --baseline", CLI_GROUP_OUTPUT},
    {"baseline", KEY_VIEWS + 3, "METRES", 0, "Distance of neighbouring eyes of --light-field", CLI_GROUP_OUTPUT},
    {"views", KEY_VIEWS + 4, "rays|quadtree", 0,
     "Render every view, or make all of them from one and its depth layers, by the tracer quadtree (default, "
     "except with --denoise and layers of motion or light)",
     CLI_GROUP_OUTPUT},
    {"lens", KEY_VIEWS + 5, "rays|quadtree", 0,
     "Trace rays through the lens of --aperture in the scene (default), or in depth layers of a sharp picture",
     CLI_GROUP_OUTPUT},
    {NULL, 0, NULL, 0, "Clips of the model ('farlight info' lists them):", CLI_GROUP_CLIPS},
    {"clip", KEY_CLIP, "NAME|INDEX", 0,
     "Play this clip; may be repeated, and the later clip wins where both move the same node", CLI_GROUP_OUTPUT},
    {"clip-once", KEY_CLIP_ONCE, NULL, 0, "Stop at the clips' end (default: begin again)", CLI_GROUP_OUTPUT},
    {"clip-start", KEY_CLIP_START, "SECONDS", 0,
     "Time at which clips begin (default 0; negative: they are already running)", CLI_GROUP_OUTPUT},
    {"clip-speed", KEY_CLIP_SPEED, "FACTOR", 0, "Speed of clips (default 1)", CLI_GROUP_OUTPUT},
    {NULL, 0, NULL, 0, "Method:", CLI_GROUP_METHOD},
    {NULL, 0, NULL, 0, "Light:", CLI_GROUP_LIGHT},
    {NULL, 0, NULL, 0, "Talk:", CLI_GROUP_TALK},
    {"timings", KEY_TIMINGS, "json", OPTION_ARG_OPTIONAL,
     "Print the time of every stage, as a table or as JSON, one object a line", CLI_GROUP_OUTPUT},
    {"trace-file", KEY_TRACE_FILE, "FILE", 0,
     "Write every stage to FILE as trace events, for ui.perfetto.dev or chrome://tracing", CLI_GROUP_OUTPUT},
    {"progress", KEY_PROGRESS, "bar|lines|openjd", 0,
     "Form of progress: a bar (default on a terminal), lines, or messages for Open Job Description",
     CLI_GROUP_OUTPUT},
    {"quiet", KEY_QUIET, NULL, 0, "Print no progress and no notes about the model", CLI_GROUP_OUTPUT},
    {0}};

/* Adds the option's name to an error of lib/text.h. */
static error_t name_field(struct cli_job *job, const char *field)
{
    snprintf(job->error.field, sizeof(job->error.field), "%s", field);
    return EINVAL;
}

static error_t set_progress(struct cli_job *job, const char *value)
{
    static const char *const forms[] = {
        [CLI_PROGRESS_LINES] = "lines", [CLI_PROGRESS_BAR] = "bar", [CLI_PROGRESS_OPENJD] = "openjd"};
    for (size_t i = 0; i < sizeof(forms) / sizeof(forms[0]); i++)
        if (strcmp(value, forms[i]) == 0) {
            job->talk.has_progress = true;
            job->talk.progress = (enum cli_progress_form)i;
            return 0;
        }
    cli_usage(job, "--progress", "'%s' is none of bar, lines and openjd", value);
    return EINVAL;
}

static error_t set_vector(struct cli_job *job, const char *field, const char *value, float vector[3], bool *is_set)
{
    *is_set = true;
    return fl_text_vector(value, vector, &job->error) ? 0 : name_field(job, field);
}

/* Reads a position in doubles and stores the rest that a float loses, as models may be far from the origin. */
static error_t set_place(struct cli_job *job, const char *field, const char *value, float place[3], double rest[3],
                         bool *is_set)
{
    double read[3] = {0, 0, 0};
    *is_set = true;
    if (!fl_text_place(value, read, &job->error))
        return name_field(job, field);
    for (unsigned i = 0; i < 3; i++) {
        place[i] = (float)read[i];
        rest[i] = read[i] - (double)place[i];
    }
    return 0;
}

/* Converts "z" and "-z" to vectors. */
static const char *axis_of(const char *value)
{
    static const char *const axes[][2] = {{"x", "1,0,0"},   {"y", "0,1,0"},   {"z", "0,0,1"},
                                          {"-x", "-1,0,0"}, {"-y", "0,-1,0"}, {"-z", "0,0,-1"}};
    for (size_t i = 0; i < sizeof(axes) / sizeof(axes[0]); i++)
        if (strcmp(value, axes[i][0]) == 0)
            return axes[i][1];
    return value;
}

/* Formats of pictures and of models have no name in common. */
static error_t set_format(struct cli_job *job, const char *value)
{
    const enum cli_image image = cli_image_by_name(value);
    if (image == CLI_IMAGE_UNKNOWN)
        job->input.format = value; /* cli_job_complete() checks it */
    else
        job->output.image = image;
    return 0;
}

static error_t set_real(struct cli_job *job, const char *field, const char *value, double minimum, double maximum,
                        double *number)
{
    return fl_text_real(value, minimum, maximum, number, &job->error) ? 0 : name_field(job, field);
}

/* Parses an edit, so that a wrong syntax is reported early; its names are looked up in the scene later. */
static error_t add_edit(struct cli_job *job, const char *field, const char *value)
{
    if (job->input.edit_count == CLI_EDITS_MAX)
        return cli_usage(job, field, "more than %d assignments cannot be given", CLI_EDITS_MAX);
    return fl_assignment_parse(value, &job->input.edits[job->input.edit_count++], &job->error) ? 0 : EINVAL;
}

/* The number of the group whose name is the first `length` bytes of `value`; a new name gets a new number. 0:
 * there are too many groups. */
static unsigned light_group_of(struct cli_job *job, const char *value, size_t length)
{
    char name[CLI_LIGHT_GROUP_NAME] = "";
    memcpy(name, value, length);
    for (unsigned i = 0; i < job->light_groups.count; i++)
        if (strcmp(job->light_groups.names[i], name) == 0)
            return i + 1;
    if (job->light_groups.count == CLI_LIGHT_GROUPS)
        return 0;
    memcpy(job->light_groups.names[job->light_groups.count++], name, sizeof(name));
    return job->light_groups.count;
}

static error_t add_to_group(struct cli_job *job, const char *field, unsigned group, const char *node,
                            size_t length)
{
    if (job->input.edit_count == CLI_EDITS_MAX)
        return cli_usage(job, field, "with all of --edit more than %d names cannot be given", CLI_EDITS_MAX);
    struct fl_assignment *edit = &job->input.edits[job->input.edit_count];
    *edit = (struct fl_assignment){
        .kind = PROTOCOL_OBJECT_NODE, .field = "light_group", .count = 1, .values = {group}};
    if (length == 0 || length >= sizeof(edit->which))
        return cli_usage(job, field, "'%.*s' is no name of a node", (int)length, node);
    memcpy(edit->which, node, length);
    if (strcmp(edit->which, "environment") == 0)
        edit->kind = PROTOCOL_OBJECT_ENVIRONMENT;
    job->input.edit_count++;
    return 0;
}

/* Records edits that add nodes to a group, for the scene; the group's name appears in the file only. */
static error_t set_light_group(struct cli_job *job, const char *field, const char *value)
{
    static const char allowed[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_";
    const size_t length = strspn(value, allowed);
    if (value[length] != '=' || length == 0 || length >= CLI_LIGHT_GROUP_NAME) {
        cli_usage(job, field, "'%s' is no light group, such as key=Sun,Lamp*", value);
        return fl_error_remedy(&job->error, "name it with up to %d letters, digits and _, and after = its nodes",
                               CLI_LIGHT_GROUP_NAME - 1)
                   ? 0
                   : EINVAL;
    }
    if (strncmp(value, "rest=", 5) == 0)
        return cli_usage(job, field, "'rest' is the layer of all other light: choose another name");
    const unsigned group = light_group_of(job, value, length);
    if (group == 0)
        return cli_usage(job, field, "'%s' is one group too many: there may be %d", value, CLI_LIGHT_GROUPS);
    for (const char *at = value + length; *at != '\0';) {
        const size_t bytes = strcspn(++at, ",");
        const error_t status = add_to_group(job, field, group, at, bytes);
        if (status != 0)
            return status;
        at += bytes;
    }
    return 0;
}

static error_t set_crop(struct cli_job *job, const char *field, const char *value)
{
    struct message_render *options = &job->options;
    int length = 0;
    if (sscanf(value, "%4u,%4u,%4u,%4u%n", &options->picture.crop_x, &options->picture.crop_y,
               &options->picture.crop_width, &options->picture.crop_height, &length) == 4 &&
        value[length] == '\0' && strspn(value, "0123456789,") == strlen(value) &&
        options->picture.crop_width > 0 && options->picture.crop_height > 0)
        return 0;
    return cli_usage(job, field, "'%s' is no part of a picture: use X,Y,W,H as in 640,0,320,180", value);
}

static error_t set_fov(struct cli_job *job, const char *field, const char *value)
{
    double degrees = 0;
    const error_t status = set_real(job, field, value, 0.1, 177, &degrees);
    job->camera.key.fov_y = (float)(degrees * RADIANS_PER_DEGREE);
    job->camera.has_fov = true;
    return status;
}

static error_t set_view(struct cli_job *job, const char *field, const char *value)
{
    static const struct {
        const char *name;
        float azimuth, elevation;
    } views[] = {{"front", 0, 0}, {"back", 180, 0},   {"left", -90, 0},      {"right", 90, 0},
                 {"top", 0, 90},  {"bottom", 0, -90}, {"iso", 45, 35.26439f}}; /* diagonal of a cube */
    for (size_t i = 0; i < sizeof(views) / sizeof(views[0]); i++) {
        if (strcmp(value, views[i].name) != 0)
            continue;
        job->options.camera.auto_azimuth = views[i].azimuth;
        job->options.camera.auto_elevation = views[i].elevation;
        job->camera.has_framing = true;
        return 0;
    }
    return cli_usage(job, field, "'%s' is not known (known: front, back, left, right, top, bottom, iso)", value);
}

error_t cli_set_background(struct cli_job *job, const char *field, const char *value)
{
    struct message_render *options = &job->options;
    float colour[3];
    if (fl_text_colour(value, colour, NULL)) {
        options->picture.background = PROTOCOL_BACKGROUND_COLOUR;
        memcpy(options->picture.background_colour, colour, sizeof(colour));
        return 0;
    }
    if (protocol_background_parse(value, &options->picture.background) &&
        options->picture.background != PROTOCOL_BACKGROUND_COLOUR)
        return 0;
    return cli_usage(job, field, "'%s' is no background: use environment, transparent or a colour as #ffffff",
                     value);
}

error_t cli_set_environment_rotation(struct cli_job *job, const char *field, const char *value)
{
    return set_real(job, field, value, -360, 360, &job->input.environment_degrees);
}

/* The layers whose sum is the beauty. */
#define LIGHT_LAYERS ((1u << (PROTOCOL_LAYER_BACKGROUND + 1)) - (1u << PROTOCOL_LAYER_DIFFUSE_DIRECT))

/* Reads "beauty,depth". The picture alone is 0, as without the option. */
static error_t set_layers(struct cli_job *job, const char *field, const char *value)
{
    unsigned layers = 0;
    const char *at = value;
    for (;;) {
        char name[24];
        const size_t length = strcspn(at, ",");
        snprintf(name, sizeof(name), "%.*s", (int)(length < sizeof(name) ? length : sizeof(name)), at);
        const bool all_light = strcmp(name, "light") == 0;
        if (!all_light && !protocol_layers_parse(name, &layers))
            return cli_unknown_value(job, field, "layer", name);
        layers |= all_light ? LIGHT_LAYERS : 0;
        if (at[length] == '\0')
            break;
        at += length + 1;
    }
    job->options.picture.layers = layers == 1u << PROTOCOL_LAYER_BEAUTY ? 0 : layers;
    return 0;
}

static error_t set_retries(struct cli_job *job, const char *field, const char *value)
{
    uint64_t number = 0;
    if (!fl_text_integer(value, 0, 1000, &number, &job->error))
        return name_field(job, field);
    job->daemon.retries.has_count = true;
    job->daemon.retries.count = (unsigned)number;
    return 0;
}

static error_t set_retry_duration(struct cli_job *job, const char *field, const char *value)
{
    return cli_read_retry_for(value, &job->daemon.retries, &job->error) ? 0 : name_field(job, field);
}

static error_t set_lost_after(struct cli_job *job, const char *field, const char *value)
{
    return cli_read_lost_after(value, &job->daemon.retries, &job->error) ? 0 : name_field(job, field);
}

static error_t set_option(struct cli_job *job, int key, const char *field, const char *value)
{
    switch (key) {
    case KEY_SERVER:
        job->daemon.server = value;
        return 0;
    case KEY_KEY:
        job->daemon.key_file = value;
        return 0;
    case KEY_AT:
        return cli_set_place(job, field, value);
    case KEY_PARENTS:
        job->output.parents = true;
        return 0;
    case KEY_OUTPUT:
        job->output.path = value;
        return 0;
    case KEY_ENVIRONMENT:
        job->input.environment = value;
        return 0;
    case KEY_ENVIRONMENT_ROTATION:
        return cli_set_environment_rotation(job, field, value);
    case KEY_VARIANT:
        job->input.variant = value;
        return 0;
    case KEY_EDIT:
        return add_edit(job, field, value);
    case KEY_POINT_SIZE:
        return set_real(job, field, value, 1e-6, 1e6, &job->input.point_size);
    case KEY_BACKGROUND:
        return cli_set_background(job, field, value);
    case KEY_GROUND:
        job->options.picture.ground = 1;
        return 0;
    case KEY_STUDIO:
        job->input.without_studio = strcmp(value, "off") == 0;
        return job->input.without_studio || strcmp(value, "on") == 0
                   ? 0
                   : cli_unknown_value(job, field, "studio", value);
    case KEY_DENOISE:
        job->sampling.has_denoise = true;
        return protocol_denoise_parse(value ? value : "on", &job->options.picture.denoise)
                   ? 0
                   : cli_unknown_value(job, field, "denoise", value);
    case KEY_CAMERA:
        job->camera.name = value;
        return 0;
    case KEY_EYE:
        return set_place(job, field, value, job->camera.key.eye_world, job->camera.eye_rest, &job->camera.has_eye);
    case KEY_LOOK_AT:
        return set_place(job, field, value, job->camera.key.look_at_world, job->camera.look_at_rest,
                         &job->camera.has_look_at);
    case KEY_UP:
        value = axis_of(value);
        return set_vector(job, field, value, job->camera.key.up_world, &job->camera.has_up);
    case KEY_HALF:
        job->output.half_pixels = true;
        return 0;
    case KEY_FLOAT:
        job->output.float_pixels = true;
        return 0;
    case KEY_EXR_COMPRESSION:
        job->output.dwaa = strcmp(value, "dwaa") == 0;
        return job->output.dwaa || strcmp(value, "zip") == 0
                   ? 0
                   : cli_usage(job, field, "'%s' is not known (known: zip, dwaa)", value);
    case KEY_COLOUR_SPACE:
        job->output.colour_space = value;
        return 0;
    case KEY_DISPLAY_VIEW:
        job->output.display_view = value;
        return 0;
    case KEY_OCIO:
        job->output.ocio = value;
        return 0;
    case KEY_CLIP:
        if (job->clips.count == CLI_CLIPS_MAX)
            return cli_usage(job, field, "at most %d clips can be played at once", CLI_CLIPS_MAX);
        job->clips.list[job->clips.count++] = (struct cli_clip){.which = value};
        return 0;
    case KEY_CLIP_ONCE:
        job->clips.once = true;
        return 0;
    case KEY_PROGRESS:
        return set_progress(job, value);
    case KEY_QUIET:
        job->talk.quiet = true;
        return 0;
    case KEY_TRACE_FILE:
        job->talk.trace_file = value;
        return 0;
    case KEY_TIMINGS:
        if (value && strcmp(value, "json") != 0)
            return cli_usage(job, field, "'%s' is not known (known: json)", value);
        job->talk.timings = value ? CLI_TIMINGS_JSON : CLI_TIMINGS_TABLE;
        return 0;
    case KEY_SIZE:
        return fl_text_size(value, &job->options.picture.width, &job->options.picture.height, &job->error)
                   ? 0
                   : name_field(job, field);
    case KEY_CROP:
        return set_crop(job, field, value);
    case KEY_FORMAT:
        return set_format(job, value);
    case KEY_FOV:
        return set_fov(job, field, value);
    case KEY_VIEW:
        return set_view(job, field, value);
    case KEY_FRAME:
        job->camera.framed = value;
        job->camera.has_framing = true;
        return 0;
    case KEY_CLIP_START:
        return set_real(job, field, value, -1e6, 1e6, &job->clips.start_s);
    case KEY_CLIP_SPEED:
        return set_real(job, field, value, 0.001, 1000, &job->clips.speed);
    case KEY_LAYERS:
        return set_layers(job, field, value);
    case KEY_LIGHT_GROUP:
        return set_light_group(job, field, value);
    case KEY_METADATA:
        job->output.full_metadata = strcmp(value, "full") == 0;
        return job->output.full_metadata || strcmp(value, "stable") == 0
                   ? 0
                   : cli_usage(job, field, "'%s' is not known (known: stable, full)", value);
    case KEY_LOST_AFTER:
        return set_lost_after(job, field, value);
    case KEY_RETRY_FOR:
        return set_retry_duration(job, field, value);
    case KEY_RETRIES:
        return set_retries(job, field, value);
    default:
        if (key >= KEY_VIEWS && key < KEY_VIEWS_END)
            return cli_views_set(job, field, value);
        return key >= KEY_FIELD && cli_field_at((size_t)(key - KEY_FIELD))
                   ? cli_field_set(job, cli_field_at((size_t)(key - KEY_FIELD)), field, value)
                   : ARGP_ERR_UNKNOWN;
    }
}

/* ---- all of them ---- */

static struct argp_option options[OPTIONS_MAX];

static void add_option(const struct argp_option *option)
{
    size_t count = 0;
    while (options[count].name || options[count].doc)
        count++;
    if (count + 1 < OPTIONS_MAX)
        options[count] = *option;
}

/* Adds a heading "Tracer ldc, layered depth cubes: .." above each tracer's settings. */
static void add_tracer_headers(void)
{
    static char titles[PROTOCOL_TRACER_COUNT][200];
    for (size_t i = 0; i < tracer_desc_count; i++) {
        const struct tracer_desc *tracer = &tracer_descs[i];
        const int group = CLI_GROUP_TRACERS + (int)tracer->number;
        bool has_settings = false;
        for (size_t k = 0; k < cli_field_count(); k++)
            has_settings = has_settings || cli_field_at(k)->group == group;
        snprintf(titles[i], sizeof(titles[i]), "Tracer %s, %s:", tracer->name, tracer->doc);
        if (has_settings)
            add_option(&(struct argp_option){.doc = titles[i], .group = group});
    }
}

static const struct argp_option *all_options(void)
{
    if (options[0].name)
        return options;
    for (const struct argp_option *option = special; option->name || option->doc; option++)
        add_option(option);
    add_tracer_headers();
    for (size_t i = 0; i < cli_field_count(); i++) {
        const struct cli_field *field = cli_field_at(i);
        add_option(&(struct argp_option){.name = field->option,
                                         .key = KEY_FIELD + (int)i,
                                         .arg = field->argument,
                                         .doc = field->help,
                                         .group = field->group});
    }
    return options;
}

static const struct argp_option *find_option(int key)
{
    for (const struct argp_option *option = all_options(); option->name || option->doc; option++)
        if (option->name && option->key == key)
            return option;
    return NULL;
}

static error_t parse(int key, char *value, struct argp_state *state)
{
    const struct argp_option *option = find_option(key);
    char field[40];
    if (!option)
        return ARGP_ERR_UNKNOWN;
    snprintf(field, sizeof(field), "--%s", option->name);
    return set_option(state->input, key, field, value);
}

error_t cli_job_set(struct cli_job *job, const char *name, const char *value)
{
    for (const struct argp_option *option = all_options(); option->name || option->doc; option++)
        if (option->name && strcmp(option->name, name) == 0)
            return set_option(job, option->key, name, value);
    return ARGP_ERR_UNKNOWN;
}

/* Options that a set lacks, between blanks; NULL: it has all. */
static const char *const left_out[CLI_OPTIONS_COUNT] = {
    [CLI_OPTIONS_PICTURE] =
        " parents output format tone-map tracer primary timings trace-file layers light-group "
        "retry-for retries metadata stereo stereo-layout light-field baseline views lens noise ",
    [CLI_OPTIONS_VIEWS] =
        " parents output format timings trace-file layers light-group retry-for retries metadata "
        "stereo-layout noise crop ",
    [CLI_OPTIONS_THUMBNAIL] = " output timings trace-file layers light-group retry-for retries metadata "
                              "stereo-layout noise stereo baseline light-field views lens clip-once clip-start "
                              "clip-speed clip at variant frame ",
    [CLI_OPTIONS_WINDOW] = " parents output format samples integrator timings trace-file layers light-group "
                           "clip-once clip-start encoding retries metadata light-field baseline views crop ",
    [CLI_OPTIONS_PAGE] =
        " parents output format samples integrator timings trace-file layers light-group clip-once "
        "retry-for clip-start clip-speed clip encoding retries light-field metadata stereo-layout "
        "baseline views crop stereo lens size ",
};
/* No set that lacks options has those of image files. */
static const char of_files[] = " half float exr-compression colour-space display-view ocio ";

static bool is_among(const struct argp_option *option, const char *names)
{
    char name[40];
    snprintf(name, sizeof(name), " %s ", option->name ? option->name : "");
    return strstr(names, name);
}

const struct argp *cli_options_argp(enum cli_options set)
{
    static struct argp_option kept[CLI_OPTIONS_COUNT][OPTIONS_MAX];
    static struct argp argps[CLI_OPTIONS_COUNT];
    size_t count = 0;
    for (const struct argp_option *option = all_options(); option->name || option->doc; option++) {
        if (!left_out[set] || !(is_among(option, left_out[set]) || is_among(option, of_files)))
            kept[set][count++] = *option;
    }
    argps[set] = (struct argp){.options = kept[set], .parser = parse};
    return &argps[set];
}

/* Reads FARLIGHT_SIZE for --size, and so on. */
static bool read_variable(struct cli_job *job, const struct argp_option *option)
{
    char field[64] = "FARLIGHT_";
    size_t length = strlen(field);
    for (const char *at = option->name; *at != '\0' && length + 1 < sizeof(field); at++)
        field[length++] = *at == '-' ? '_' : (char)toupper((unsigned char)*at);
    field[length] = '\0';
    const char *value = getenv(field);
    return !value || value[0] == '\0' || set_option(job, option->key, field, value) == 0;
}

static bool read_environment(struct cli_job *job)
{
    for (const struct argp_option *option = all_options(); option->name || option->doc; option++) {
        const bool has_variable = option->key == KEY_SERVER || option->key == KEY_SIZE ||
                                  option->key == KEY_ENVIRONMENT || option->key == KEY_ENVIRONMENT_ROTATION ||
                                  option->key >= KEY_FIELD;
        if (option->name && has_variable && !read_variable(job, option))
            return false;
    }
    return true;
}

bool cli_job_begin(struct cli_job *job, struct message_render defaults)
{
    *job = (struct cli_job){.camera.key = {.up_world = {0, 1, 0}, .fov_y = (float)(45 * RADIANS_PER_DEGREE)},
                            .series = {.orbit_degrees = TURN_DEGREES},
                            .options = defaults};
    return read_environment(job);
}
