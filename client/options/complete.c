/* SPDX-License-Identifier: MIT */
/* Settings that depend on several options: derived defaults, and invalid combinations. */
#include "complete.h"
#include "image_path.h"
#include "models.h"
#include "progress.h"
#include "views.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define RADIANS_PER_DEGREE 0.017453292519943295
#define FRAME_BYTES_MAX (UINT64_C(4080) << 20) /* the daemon's limit */
#define AUTO_SAMPLES 256u                      /* --samples auto: maximum for a pixel */
#define AUTO_NOISE 0.03f                       /* --samples auto: hardly visible noise */
#define PATH_SAMPLES 64u                       /* default of the integrator path */
#define CLAMP 10.0f                            /* default clamp of indirect light, times white, as in Cycles */
/* Samples for the full clamp; with fewer it decreases in proportion, as each is more visible, .. */
#define CLAMP_SAMPLES 64.0f
#define CLAMP_MIN 1.25f     /* .. down to this */
#define NOISE_SAMPLES 4096u /* maximum with --noise: most pixels need far fewer */
#define AO_SAMPLES 16u      /* 8 rays each: 128 a pixel, as in the paper */

/* ---- where pictures go ---- */

bool cli_writes_to_stdout(const struct cli_job *job)
{
    for (size_t i = 0; i < job->output.count; i++)
        if (strcmp(job->output.list[i].path, "-") == 0)
            return true;
    return false;
}

static bool complete_output(struct cli_job *job, struct cli_output *output, bool is_series)
{
    const bool to_stdout = strcmp(output->path, "-") == 0;
    if (output->image == CLI_IMAGE_UNKNOWN && to_stdout)
        output->image = is_series ? CLI_IMAGE_Y4M : CLI_IMAGE_PNG;
    if (output->image == CLI_IMAGE_UNKNOWN)
        output->image = cli_image_by_path(output->path);
    if (output->image == CLI_IMAGE_UNKNOWN) {
        cli_usage(job, output->path, "its ending names no %sformat", is_series ? "" : "image ");
        return fl_error_remedy(&job->error,
                               "known: .png .jpg .jpeg .exr .hdr .webp .tiff .tif .gif%s, or --format",
                               is_series ? " .mp4 .mkv .y4m" : "");
    }
    if (is_series)
        output->image = cli_image_of_series(output->image, output->path);
    if (!is_series && cli_image_is_video(output->image)) {
        cli_usage(job, output->path, "one picture is no video");
        return fl_error_remedy(&job->error, "use 'farlight animate'");
    }
    if (to_stdout && is_series && !cli_image_is_video(output->image)) {
        cli_usage(job, "--output", "a series of %s files cannot go to standard output",
                  cli_image_name(output->image));
        return fl_error_remedy(&job->error, "-o - writes raw video (y4m); -o 'frames/%%04d.%s' writes files",
                               cli_image_name(output->image));
    }
    if (!cli_image_is_video(output->image))
        return true;
    if (job->series.resume || job->series.shard_parts > 1 || job->series.digests) {
        cli_usage(job,
                  job->series.resume     ? "--resume"
                  : job->series.digests  ? "--digests"
                  : job->series.is_chunk ? "--chunk"
                                         : "--shard",
                  "a video needs all frames in one command");
        return fl_error_remedy(&job->error,
                               "write images, such as 'frames/%%04d.png', and a video of all of them");
    }
    if (job->output.lossless && output->image != CLI_IMAGE_MKV && output->image != CLI_IMAGE_MOVING_WEBP) {
        cli_usage(job, "--lossless", "%s files are not lossless", cli_image_name(output->image));
        return fl_error_remedy(&job->error, "write an .mkv or .webp file");
    }
    return true;
}

static bool is_linear(enum cli_image image)
{
    return image == CLI_IMAGE_EXR || image == CLI_IMAGE_HDR;
}

/* Adds the layers of light groups to those of --layers, which default to the picture. */
static void add_light_groups(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    if (job->light_groups.count == 0)
        return;
    wanted->picture.layers |= wanted->picture.layers == 0 ? 1u << PROTOCOL_LAYER_BEAUTY : 0;
    wanted->picture.layers |= ((2u << job->light_groups.count) - 1) << PROTOCOL_LAYER_LIGHT_REST;
}

/* Checks layers: only EXR has named channels, and half floats are too imprecise for their contents. */
static bool complete_layers(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    const uint64_t bytes = (uint64_t)wanted->picture.width * wanted->picture.views_across *
                           wanted->picture.height * wanted->picture.views_down * 16;
    const char *option = wanted->picture.layers == 0 ? "--light-group" : "--layers";
    add_light_groups(job);
    if (wanted->picture.layers == 0)
        return true;
    for (size_t i = 0; i < job->output.count; i++) {
        if (job->output.list[i].image == CLI_IMAGE_EXR)
            continue;
        cli_usage(job, job->output.list[i].path, "%s files do not have the layers of %s",
                  cli_image_name(job->output.list[i].image), option);
        return fl_error_remedy(&job->error, "write an .exr file, or leave out %s", option);
    }
    if (wanted->encoding == PROTOCOL_ENCODING_JPEG) {
        cli_usage(job, "--encoding", "jpeg does not carry the layers of %s", option);
        return fl_error_remedy(&job->error, "choose raw, zstd or predicted");
    }
    if (bytes * (unsigned)__builtin_popcount(wanted->picture.layers) > FRAME_BYTES_MAX) {
        cli_usage(job, "--layers", "the number of layers of %ux%u pixels exceeds a frame's limit",
                  wanted->picture.width, wanted->picture.height);
        return fl_error_remedy(&job->error, "render some of them at a time, or a smaller --size");
    }
    wanted->picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    return true;
}

/* Checks colour options. The program that writes a picture of 8 bits derives it from linear light. */
static bool complete_colours(struct cli_job *job)
{
    const char *option = job->output.colour_space ? "--colour-space" : "--display-view",
               *configured = getenv("OCIO");
    if (!job->output.colour_space && !job->output.display_view)
        return true;
    if (!job->output.ocio && configured && configured[0] != '\0')
        job->output.ocio = configured;
    for (size_t i = 0; i < job->output.count; i++) {
        const enum cli_image image = job->output.list[i].image;
        if (job->output.colour_space && image != CLI_IMAGE_EXR) {
            cli_usage(job, option, "%s files do not have it", cli_image_name(image));
            return fl_error_remedy(&job->error, "write an .exr file, or choose a view by --display-view");
        }
        if (job->output.display_view && (is_linear(image) || cli_image_is_video(image))) {
            cli_usage(job, option, "%s files do not have it", cli_image_name(image));
            return fl_error_remedy(&job->error, "write pictures of 8 bits, such as .png");
        }
    }
    if (job->output.display_view && !job->output.ocio) {
        cli_usage(job, option, "there is no configuration that has views");
        return fl_error_remedy(&job->error, "name one by --ocio FILE or $OCIO");
    }
    job->options.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    return true;
}

/* Chooses the pixel format, since all outputs come from the same frames. */
static bool complete_pixels(struct cli_job *job)
{
    bool has[CLI_IMAGE_COUNT] = {false};
    for (size_t i = 0; i < job->output.count; i++) {
        has[job->output.list[i].image] = true;
        if (is_linear(job->output.list[i].image) != is_linear(job->output.list[0].image)) {
            cli_usage(job, job->output.list[i].path,
                      "one rendering cannot produce both 8-bit pictures and linear light");
            return fl_error_remedy(&job->error, "render once for EXR and HDR, and once for all else");
        }
    }
    if (job->output.float_pixels && job->output.half_pixels)
        return cli_usage(job, "--float", "cannot be combined with --half") == 0;
    if ((job->output.float_pixels && !has[CLI_IMAGE_EXR] && !has[CLI_IMAGE_HDR]) ||
        (job->output.half_pixels && !has[CLI_IMAGE_EXR]))
        return cli_usage(job, job->output.float_pixels ? "--float" : "--half", "%s files do not have such pixels",
                         cli_image_name(job->output.list[0].image)) == 0;
    if (job->output.dwaa && !has[CLI_IMAGE_EXR])
        return cli_usage(job, "--exr-compression", "%s files do not have it",
                         cli_image_name(job->output.list[0].image)) == 0;
    if (has[CLI_IMAGE_HDR] || job->output.float_pixels)
        job->options.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA32F;
    else if (has[CLI_IMAGE_EXR])
        job->options.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA16F;
    return complete_colours(job) && complete_layers(job);
}

/* Checks a format that is not a picture's: it is a model's, which only standard input needs. */
static bool complete_format(struct cli_job *job)
{
    const char *letters = "abcdefghijklmnopqrstuvwxyz0123456789";
    const size_t length = job->input.format ? strlen(job->input.format) : 1;
    if (!job->input.format ||
        (cli_has_input(job) && length > 0 && length < 8 && strspn(job->input.format, letters) == length))
        return true;
    return cli_usage(job, "--format",
                     "unknown format '%s' (known: png, jpeg, exr, hdr, webp, tiff, gif, mp4, mkv, y4m)",
                     job->input.format) == 0;
}

static bool complete_outputs(struct cli_job *job, bool is_series)
{
    if (job->output.path) {
        /* Standard output has no folder in which a finished file could replace it. */
        const char *path = strcmp(job->output.path, "/dev/stdout") == 0 ? "-" : job->output.path;
        job->output.list[0] = (struct cli_output){.path = path, .image = job->output.image};
        job->output.count = 1;
    }
    if (job->output.count == 0) {
        cli_usage(job, "--output", "no image file is named");
        return fl_error_remedy(&job->error, is_series ? "-o 'frames/%%04d.exr'" : "-o picture.png, or '-'");
    }
    for (size_t i = 0; i < job->output.count; i++)
        if (!complete_output(job, &job->output.list[i], is_series))
            return false;
    if (job->talk.has_progress && job->talk.progress == CLI_PROGRESS_OPENJD && cli_writes_to_stdout(job))
        return cli_usage(job, "--progress", "openjd is written to standard output, as the picture is") == 0;
    return complete_pixels(job);
}

static bool complete_encoding(struct cli_job *job)
{
    if (!job->given.encoding && job->daemon.server && strncmp(job->daemon.server, "unix:", 5) != 0)
        job->options.encoding = PROTOCOL_ENCODING_ZSTD;
    if (job->options.encoding == PROTOCOL_ENCODING_JPEG &&
        job->options.picture.format != PROTOCOL_PIXEL_FORMAT_RGBA8)
        return cli_usage(job, "--encoding", "jpeg carries 8-bit pictures only, %s files need more",
                         cli_image_name(job->output.list[0].image)) == 0;
    for (size_t i = 0; i < job->output.count; i++) {
        const enum cli_image image = job->output.list[i].image;
        const unsigned quality = job->output.quality > 0 ? job->output.quality : job->options.quality;
        const bool is_picture =
            image == CLI_IMAGE_JPEG || image == CLI_IMAGE_WEBP || image == CLI_IMAGE_MOVING_WEBP;
        if (image == CLI_IMAGE_MOVING_GIF || (!is_picture && !cli_image_is_video(image)))
            continue;
        if (!is_picture && quality > 51)
            return cli_usage(job, "--quality", "a video has 1 (best) to 51") == 0;
        job->output.quality = quality;
        if (job->options.encoding != PROTOCOL_ENCODING_JPEG)
            job->options.quality = 0; /* the quality applies to the file */
    }
    if (job->options.encoding == PROTOCOL_ENCODING_ZSTD && job->options.quality > 19)
        return cli_usage(job, "--quality", "zstd has levels 1 to 19") == 0;
    return true;
}

/* ---- camera ---- */

static bool is_zero(const float vector[3])
{
    return vector[0] == 0 && vector[1] == 0 && vector[2] == 0;
}

/* True if `up` and the view direction leave the picture's upright undefined. */
static bool is_degenerate(const struct cli_job *job)
{
    const struct record_camera_key *key = &job->camera.key;
    double view[3], cross = 0, lengths = 0, view2 = 0, up2 = 0;
    for (unsigned i = 0; i < 3; i++) {
        view[i] = (double)key->look_at_world[i] - (double)key->eye_world[i] + job->camera.look_at_rest[i] -
                  job->camera.eye_rest[i];
        view2 += view[i] * view[i];
        up2 += (double)key->up_world[i] * (double)key->up_world[i];
    }
    lengths = view2 * up2;
    for (unsigned i = 0; i < 3; i++) {
        const unsigned j = (i + 1) % 3, k = (i + 2) % 3;
        const double part = view[j] * (double)key->up_world[k] - view[k] * (double)key->up_world[j];
        cross += part * part;
    }
    return !(cross > lengths * 1e-12);
}

static bool complete_camera(struct cli_job *job)
{
    const bool has_key = job->camera.has_eye || job->camera.has_look_at;
    if (job->camera.has_eye != job->camera.has_look_at)
        return cli_usage(job, job->camera.has_eye ? "--eye" : "--look-at", "needs %s as well",
                         job->camera.has_eye ? "--look-at" : "--eye") == 0;
    if (has_key && job->camera.name)
        return cli_usage(job, "--camera", "cannot be combined with --eye and --look-at") == 0;
    if (!has_key && job->camera.has_up && !cli_turn_models(job))
        return false;
    if (job->camera.has_framing && (has_key || job->camera.name))
        return cli_usage(job, job->camera.name ? "--camera" : "--eye",
                         "cannot be combined with --view, --azimuth, --elevation, --frame, --zoom or --margin, "
                         "which place the "
                         "camera, too") == 0;
    if (job->camera.has_fov && job->camera.name)
        return cli_usage(job, "--fov", "cannot be combined with --camera, which has its own") == 0;
    if (!has_key) {
        if (job->camera.has_fov)
            job->options.camera.auto_fov = (float)((double)job->camera.key.fov_y / RADIANS_PER_DEGREE);
        job->camera.has_framing |= job->camera.has_fov;
        return true;
    }
    if (memcmp(job->camera.key.eye_world, job->camera.key.look_at_world, sizeof(job->camera.key.eye_world)) == 0 &&
        memcmp(job->camera.eye_rest, job->camera.look_at_rest, sizeof(job->camera.eye_rest)) == 0)
        return cli_usage(job, "--look-at", "is where --eye is") == 0;
    if (is_zero(job->camera.key.up_world) || is_degenerate(job))
        return cli_usage(job, "--up", "must not be parallel to the view direction") == 0;
    job->options.picture.ground_up_x = job->camera.key.up_world[0];
    job->options.picture.ground_up_y = job->camera.key.up_world[1];
    job->options.picture.ground_up_z = job->camera.key.up_world[2];
    job->options.camera.camera_path = PROTOCOL_CAMERA_KEYS;
    job->options.keys = &job->camera.key;
    job->options.keys_count = 1;
    return true;
}

static void move_place(float place[3], const double rest[3], const double by[3])
{
    for (unsigned i = 0; i < 3; i++)
        place[i] = (float)((double)place[i] + rest[i] - by[i]);
}

/* Moves the script's camera; tangents of splines are not positions. */
static void move_channel(const struct fl_channel *channel, const double by[3])
{
    static const double nothing[3];
    const bool has_tangents = channel->interpolation == PROTOCOL_INTERPOLATION_CUBIC_SPLINE;
    const uint32_t parts = has_tangents || channel->interpolation == PROTOCOL_INTERPOLATION_BEZIER ? 3 : 1;
    float *values = (float *)(uintptr_t)channel->values; /* owned by the script */
    for (uint32_t i = 0; i < channel->key_count * parts; i++)
        if (!has_tangents || i % 3 == 1)
            move_place(values + (size_t)i * 3, nothing, by);
}

void cli_move_camera(struct cli_job *job, const double origin[3])
{
    double by[3];
    bool moves = false;
    for (unsigned i = 0; i < 3; i++) {
        by[i] = origin[i] - job->camera.origin[i];
        moves = moves || by[i] < 0 || by[i] > 0;
        job->camera.origin[i] = origin[i];
    }
    if (!moves)
        return;
    move_place(job->camera.key.eye_world, job->camera.eye_rest, by);
    move_place(job->camera.key.look_at_world, job->camera.look_at_rest, by);
    memset(job->camera.eye_rest, 0, sizeof(job->camera.eye_rest));
    memset(job->camera.look_at_rest, 0, sizeof(job->camera.look_at_rest));
    for (uint32_t i = 0; job->series.keys && i < job->options.keys_count; i++) {
        static const double nothing[3];
        move_place(job->series.keys[i].eye_world, nothing, by);
        move_place(job->series.keys[i].look_at_world, nothing, by);
    }
    for (size_t i = 0; i < job->clips.channel_count; i++)
        if (job->clips.channels[i].channel.path == PROTOCOL_CHANNEL_VIEW_EYE ||
            job->clips.channels[i].channel.path == PROTOCOL_CHANNEL_VIEW_LOOK_AT)
            move_channel(&job->clips.channels[i].channel, by);
}

bool cli_find_camera(struct message_render *render, const char *camera, const char *framed, bool is_placed,
                     const struct fl_scene *scene, struct fl_error *error)
{
    if (framed && !fl_scene_find_object(scene, PROTOCOL_OBJECT_NODE, framed, &render->camera.auto_node, error))
        return false;
    if (render->keys_count > 0 || is_placed)
        return true;
    if (camera) {
        render->camera.camera_path = PROTOCOL_CAMERA_NODE;
        return fl_scene_find_camera(scene, camera, &render->camera.camera_node, error);
    }
    const struct fl_camera_info *first = fl_scene_camera(scene, 0);
    if (first) {
        render->camera.camera_path = PROTOCOL_CAMERA_NODE;
        render->camera.camera_node = first->node;
    }
    return true;
}

/* True if the pictures are for display, not linear light for programs. */
static bool is_shown(const struct cli_job *job)
{
    return job->options.picture.format == PROTOCOL_PIXEL_FORMAT_RGBA8 || job->output.display_view;
}

void cli_choose_ground(const struct cli_job *job, struct message_render *render, const struct fl_scene *scene)
{
    const bool shows = render->light.integrator == PROTOCOL_INTEGRATOR_WHITTED ||
                       render->light.integrator == PROTOCOL_INTEGRATOR_DISTRIBUTED ||
                       render->light.integrator == PROTOCOL_INTEGRATOR_PATH;
    if (job->sampling.filters && !job->input.without_studio && !job->input.scene && shows && is_shown(job) &&
        render->picture.background == PROTOCOL_BACKGROUND_ENVIRONMENT &&
        render->camera.camera_path != PROTOCOL_CAMERA_NODE &&
        render->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS && !fl_scene_is_lit(scene))
        render->picture.ground = 1;
}

/* Chooses the integrator: lenses, shutters and several samples need distributed; a single sharp sample needs no
 * random choices, so whitted gives no noise. */
static void complete_integrator(struct cli_job *job)
{
    const struct message_render *wanted = &job->options;
    const bool spreads = wanted->sampling.samples > 1 || wanted->camera.aperture > 0 ||
                         wanted->camera.shutter > 0 || job->clips.change_lens || job->sampling.endless;
    if (!job->given.integrator)
        job->options.light.integrator = spreads ? PROTOCOL_INTEGRATOR_DISTRIBUTED : PROTOCOL_INTEGRATOR_WHITTED;
}

static float usual_clamp(uint32_t samples)
{
    const float clamp = CLAMP * fminf((float)samples / CLAMP_SAMPLES, 1.0f);
    return fmaxf(clamp, CLAMP_MIN);
}

/* Chooses the number of samples: random choices show as noise in a single sample. Endlessly refined pictures
 * have no number. */
static void complete_samples(struct cli_job *job, bool is_series)
{
    struct message_render *wanted = &job->options;
    if (job->sampling.is_auto) {
        wanted->sampling.samples = AUTO_SAMPLES;
        wanted->sampling.noise = wanted->sampling.noise > 0.0f ? wanted->sampling.noise : AUTO_NOISE;
    }
    const bool by_error = wanted->sampling.noise > 0.0f;
    job->sampling.endless = job->sampling.progressive && !job->sampling.has_samples && !by_error;
    job->sampling.by_error = by_error && !is_series;
    if (!job->sampling.has_samples && by_error)
        wanted->sampling.samples = NOISE_SAMPLES;
    else if (!job->sampling.has_samples && wanted->light.integrator == PROTOCOL_INTEGRATOR_PATH)
        wanted->sampling.samples = PATH_SAMPLES;
    else if (!job->sampling.has_samples && wanted->light.integrator == PROTOCOL_INTEGRATOR_AO)
        wanted->sampling.samples = AO_SAMPLES;
    else if (!job->sampling.has_samples && !job->sampling.progressive && job->sampling.usual > 0)
        wanted->sampling.samples = job->sampling.usual;
    if (!job->given.clamp && !job->sampling.endless)
        wanted->light.clamp = usual_clamp(wanted->sampling.samples);
}

static bool complete_tracer(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    struct setting_fault fault;
    if (!tracer_settings_check(&wanted->tracing.settings, "--", &fault)) {
        cli_usage(job, fault.field, "%s", fault.text);
        return fl_error_remedy(&job->error, "%s", fault.remedy);
    }
    if (!job->given.primary)
        wanted->tracing.primary = PROTOCOL_PRIMARY_AUTO;
    return true;
}

static bool complete_clips(struct cli_job *job)
{
    for (size_t i = 0; i < job->clips.count; i++) {
        struct cli_clip *clip = &job->clips.list[i];
        if (clip->line == 0) {
            clip->start_s = (float)job->clips.start_s;
            clip->speed = job->clips.speed > 0 ? (float)job->clips.speed : 1;
            clip->loop = !job->clips.once;
        }
    }
    if (job->clips.count == 0 && (job->clips.once || job->clips.start_s != 0 || job->clips.speed > 0)) {
        cli_usage(job,
                  job->clips.once        ? "--clip-once"
                  : job->clips.speed > 0 ? "--clip-speed"
                                         : "--clip-start",
                  "no clip is played");
        return fl_error_remedy(&job->error, "add --clip NAME");
    }
    return true;
}

/* Checks options of a shared scene, which keeps its environment and needs a daemon with an address. */
static bool complete_scene(struct cli_job *job)
{
    if (!job->input.scene)
        return job->input.model || cli_usage(job, "MODEL", "no model file is named") == 0;
    if (job->input.model)
        return cli_usage(job, "--scene", "cannot be combined with the model %s: it is one or the other",
                         job->input.model) == 0;
    if (job->light_groups.count > 0) {
        cli_usage(job, "--light-group",
                  "cannot be combined with --scene: it would change the scene of all its clients");
        return fl_error_remedy(&job->error, "'farlight edit' sets light_group of its nodes, and --layers "
                                            "beauty,light_group has all of them");
    }
    if (job->input.edit_count > 0) {
        cli_usage(job, "--edit", "cannot be combined with --scene: it would change the scene of all its clients");
        return fl_error_remedy(&job->error, "'farlight edit' does that");
    }
    if (job->input.environment)
        return cli_usage(job, "--environment", "cannot be combined with --scene: that has its light already") == 0;
    if (job->daemon.server)
        return true;
    cli_usage(job, "--scene", "no address of a daemon is given, and a shared scene is on one");
    return fl_error_remedy(&job->error, "add --server ADDRESS");
}

/* Checks --noise: depth layers have a fixed number of samples. */
static bool complete_noise(struct cli_job *job)
{
    const struct message_render *wanted = &job->options;
    const bool is_made = wanted->picture.views_across * wanted->picture.views_down > 1 ||
                         wanted->camera.aperture > 0 || wanted->picture.upsample > 1;
    if (!(wanted->sampling.noise > 0.0f) || wanted->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS || !is_made)
        return true;
    cli_usage(job, "--noise", "pictures made from depth layers have a fixed number of samples");
    return fl_error_remedy(&job->error, "give --samples, or render them as they are: --views rays");
}

/* Checks ground and layers: layers hold only visible surfaces, and a ground is invisible. */
static bool complete_ground(struct cli_job *job)
{
    if (job->options.picture.ground == 0 || job->options.picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS)
        return true;
    cli_usage(job, "--ground", "pictures made from depth layers show no ground");
    return fl_error_remedy(&job->error, "render them as they are: --views rays, --lens rays");
}

static bool complete_crop(struct cli_job *job)
{
    const struct message_render *wanted = &job->options;
    if (wanted->picture.crop_width == 0)
        return true;
    if (wanted->picture.crop_x + wanted->picture.crop_width > wanted->picture.width ||
        wanted->picture.crop_y + wanted->picture.crop_height > wanted->picture.height) {
        cli_usage(job, "--crop", "%ux%u pixels from (%u, %u) on are not in a picture of %ux%u",
                  wanted->picture.crop_width, wanted->picture.crop_height, wanted->picture.crop_x,
                  wanted->picture.crop_y, wanted->picture.width, wanted->picture.height);
        return fl_error_remedy(&job->error, "--size gives the size of the whole picture");
    }
    const char *other = wanted->sampling.noise > 0.0f                                ? "--noise"
                        : wanted->picture.denoise != PROTOCOL_DENOISE_OFF            ? "--denoise"
                        : job->views.has_stereo                                      ? "--stereo"
                        : job->views.has_light_field                                 ? "--light-field"
                        : wanted->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS ? "--lens quadtree"
                                                                                     : NULL;
    if (!other)
        return true;
    cli_usage(job, "--crop", "cannot be combined with %s, which reads neighbouring pixels", other);
    return fl_error_remedy(&job->error, "leave out one of them");
}

/* Chooses the filter: files in linear light are for programs with filters of their own. */
static void complete_denoise(struct cli_job *job)
{
    if (!job->sampling.has_denoise && job->sampling.filters && is_shown(job) &&
        job->options.picture.crop_width == 0)
        job->options.picture.denoise = PROTOCOL_DENOISE_AUTO;
}

bool cli_job_complete(struct cli_job *job, bool is_series)
{
    if (!complete_scene(job) || !complete_format(job))
        return false;
    complete_samples(job, is_series);
    complete_integrator(job);
    if (!cli_views_complete(job, is_series) || !complete_noise(job) || !complete_crop(job) ||
        !complete_ground(job) || !complete_tracer(job) || !complete_clips(job) ||
        !complete_outputs(job, is_series) || !complete_encoding(job) || !complete_camera(job))
        return false;
    complete_denoise(job);
    return true;
}

bool cli_job_complete_view(struct cli_job *job)
{
    struct message_render *wanted = &job->options;
    if (!complete_scene(job))
        return false;
    if (!job->given.clamp)
        wanted->light.clamp = CLAMP;
    if (wanted->sampling.noise > 0.0f && !job->sampling.has_samples)
        wanted->sampling.samples = NOISE_SAMPLES;
    /* An integrator without noise is better while the camera moves. */
    if (!job->given.integrator && (wanted->camera.aperture > 0 || wanted->camera.shutter > 0))
        wanted->light.integrator = PROTOCOL_INTEGRATOR_DISTRIBUTED;
    if (wanted->encoding == PROTOCOL_ENCODING_ZSTD && wanted->quality > 19)
        return cli_usage(job, "--quality", "zstd has levels 1 to 19") == 0;
    return cli_views_complete(job, false) && complete_noise(job) && complete_tracer(job) && complete_clips(job) &&
           complete_camera(job);
}
