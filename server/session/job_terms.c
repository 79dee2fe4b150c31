/* SPDX-License-Identifier: MIT */
#include "session/job_terms.h"

#include "session/frames.h"
#include "session/jobs.h"
#include "session/session.h"
#include "protocol/common/margin.h"

#include <inttypes.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Maximum of frames that wait here: the engine renders the next ones meanwhile. */
#define WINDOW_FRAMES_MAX 4
#define ZSTD_LEVEL_MAX 19
/* Maximum of a frame, below the 4 GiB that a frame_begin may announce: zstd may enlarge noise. */
#define FRAME_BYTES_MAX (UINT64_C(4080) << 20)
#define BEAUTY_ALONE (1u << PROTOCOL_LAYER_BEAUTY)
#define ATTACHMENT_PIXEL_BYTES 4
#define WEIGHT_OF_VIEW 4 /* a person waits for each of its frames */
#define WEIGHT_OF_BATCH 1
#define QUALITY_OF_JPEG 90
#define QUALITY_OF_H264 80
#define LEVEL_OF_ZSTD 1

/* ---- checks ------------------------------------------------------------------------------------------ */

/* Pixels of a view's frame while the camera moves. */
static uint32_t with_margin(const struct message_render *render, uint32_t pixels)
{
    return pixels + 2 * margin_pixels(render->view.margin, pixels);
}

static uint64_t frame_bytes_of(const struct message_render *render)
{
    uint32_t layers = render->picture.layers ? render->picture.layers : BEAUTY_ALONE;
    uint32_t pixel_bytes =
        protocol_pixel_format_bytes(render->picture.format) * (uint32_t)__builtin_popcount(layers) +
        ATTACHMENT_PIXEL_BYTES * (uint32_t)__builtin_popcount(render->view.attachments);
    return (uint64_t)with_margin(render, render->picture.width * render->picture.views_across) *
           with_margin(render, render->picture.height * render->picture.views_down) * pixel_bytes;
}

static bool check_layers(const struct message_render *render, struct error *error)
{
    if (!render->picture.layers || render->picture.layers == BEAUTY_ALONE)
        return true;
    if (render->kind == PROTOCOL_JOB_VIEW) {
        error_set(error, ERROR_UNSUPPORTED, "render.layers", "a view shows the picture alone");
        return error_remedy(error, "a batch of one frame has layers; a view may have attachments");
    }
    if (render->picture.format != PROTOCOL_PIXEL_FORMAT_RGBA32F || render->encoding == PROTOCOL_ENCODING_JPEG) {
        error_set(error, ERROR_UNSUPPORTED, "render.layers", "%s in %s carries the beauty alone",
                  protocol_pixel_format_text(render->picture.format), protocol_encoding_text(render->encoding));
        return error_remedy(error, "layers need the format rgba32f and the encoding raw, zstd or predicted");
    }
    if (frame_bytes_of(render) > FRAME_BYTES_MAX) {
        error_set(error, ERROR_LIMIT, "render.layers", "frames of %" PRIu64 " bytes, the limit is %" PRIu64,
                  frame_bytes_of(render), FRAME_BYTES_MAX);
        return error_remedy(error, "ask for fewer layers, or for a smaller picture");
    }
    return true;
}

struct job *job_replaced_by(const struct session *session, const struct message_render *render)
{
    struct job *job = jobs_find(session, render->channel);
    return render->kind == PROTOCOL_JOB_VIEW && job && job->view && !job->cancelled ? job : NULL;
}

static bool has_views(const struct message_render *render)
{
    return render->picture.views_across > 1 || render->picture.views_down > 1;
}

/* Checks several views in a picture. */
static bool check_eyes(const struct message_render *render, struct error *error)
{
    if (render->picture.eyes_over && (render->picture.views_across != 1 || render->picture.views_down < 2)) {
        error_set(error, ERROR_INVALID, "render.eyes_over",
                  "%u x %u views; those of eyes side by side are one below the other",
                  render->picture.views_across, render->picture.views_down);
        return error_remedy(error, "set views_across to 1 and views_down to 2, or eyes_over to 0");
    }
    if (!has_views(render) || render->picture.baseline > 0.0f)
        return true;
    error_set(error, ERROR_INVALID, "render.baseline", "all %u views would be from one place",
              render->picture.views_across * render->picture.views_down);
    return error_remedy(error, "give the distance of neighbouring eyes in metres");
}

/* Checks frames that are made from rendered ones. */
static bool check_upsample(const struct message_render *render, struct error *error)
{
    if (render->picture.upsample == 1)
        return true;
    if (render->kind == PROTOCOL_JOB_VIEW) {
        error_set(error, ERROR_UNSUPPORTED, "render.upsample", "the next frames of a view are not known");
        return error_remedy(error, "set it to 1; a batch has frames between those that are rendered");
    }
    if (render->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS) {
        error_set(error, ERROR_INVALID, "render.upsample",
                  "frames between those that are rendered are not made of rays");
        return error_remedy(error, "set view_source to layers, or upsample to 1");
    }
    if (!render->sampling.accumulate)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.upsample", "such frames do not add to one another");
    return error_remedy(error, "set accumulate to off, or upsample to 1");
}

static bool check_hidden(const struct message_render *render, struct error *error)
{
    if (!render->view.hidden_layers)
        return true;
    if (render->kind == PROTOCOL_JOB_BATCH || (has_views(render) && !(render->view.margin > 0.0f))) {
        error_set(error, ERROR_UNSUPPORTED, "render.hidden_layers",
                  "a batch has none, nor have several views without a margin");
        return error_remedy(error, "set it to 0");
    }
    if (!(render->view.attachments & 1u << PROTOCOL_ATTACHMENT_DEPTH)) {
        error_set(error, ERROR_INVALID, "render.hidden_layers",
                  "they need depth, which says where there is a surface");
        return error_remedy(error, "add depth to attachments");
    }
    if (render->camera.aperture > 0.0f || render->camera.shutter > 0.0f || render->comparison.compare) {
        error_set(error, ERROR_UNSUPPORTED, "render.hidden_layers",
                  "what is hidden is that of one time and place of an eye, and is traced by no second tracer");
        return error_remedy(error, "set it to 0, or aperture, shutter and compare");
    }
    return true;
}

static bool is_made_of_layers(const struct message_render *render)
{
    return render->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS &&
           (has_views(render) || render->camera.aperture > 0.0f || render->picture.upsample > 1);
}

/* Checks sampling to a noise, in which tiles differ in their number of samples. */
static bool check_noise(const struct message_render *render, struct error *error)
{
    if (!(render->sampling.noise > 0.0f))
        return true;
    if (render->comparison.compare) {
        error_set(error, ERROR_UNSUPPORTED, "render.noise", "tracers are compared by a number of samples");
        return error_remedy(error, "set noise to 0, or compare to 0");
    }
    if (!is_made_of_layers(render))
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.noise",
              "pictures that are made of layers have a number of samples");
    return error_remedy(error, "set view_source to rays, or noise to 0");
}

/* Checks the ground, which pictures made of layers do not show: its pixels would lack their neighbours. */
static bool check_ground(const struct message_render *render, struct error *error)
{
    const double up = fabs((double)render->picture.ground_up_x) + fabs((double)render->picture.ground_up_y) +
                      fabs((double)render->picture.ground_up_z);
    if (!render->picture.ground)
        return true;
    if (!(up > 1e-6)) {
        error_set(error, ERROR_INVALID, "render.ground_up_y", "the ground's normal is zero");
        return error_remedy(error, "give a direction, such as 0, 1, 0");
    }
    if (render->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.ground", "pictures that are made of layers show no ground");
    return error_remedy(error, "set view_source to rays, or ground to 0");
}

static bool check_crop(const struct message_render *render, struct error *error)
{
    if (render->picture.crop_width == 0 && render->picture.crop_height == 0)
        return true;
    if (render->picture.crop_width == 0 || render->picture.crop_height == 0 ||
        render->picture.crop_x + render->picture.crop_width > render->picture.width ||
        render->picture.crop_y + render->picture.crop_height > render->picture.height) {
        error_set(error, ERROR_INVALID, "render.crop_width", "%u x %u pixels from (%u, %u) on are not in %u x %u",
                  render->picture.crop_width, render->picture.crop_height, render->picture.crop_x,
                  render->picture.crop_y, render->picture.width, render->picture.height);
        return error_remedy(error, "ask for a part of the picture, or set all four to 0");
    }
    if (render->kind == PROTOCOL_JOB_BATCH && !(render->sampling.noise > 0.0f) &&
        render->picture.denoise == PROTOCOL_DENOISE_OFF && !has_views(render) &&
        render->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS)
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.crop_width",
              "a part of a picture has one view, a number of samples, and no filter for noise");
    return error_remedy(error, "set crop_width and crop_height to 0, or leave out what needs all pixels");
}

static bool check_views(const struct message_render *render, struct error *error)
{
    if (!check_eyes(render, error) || !check_upsample(render, error) || !check_hidden(render, error))
        return false;
    if (render->picture.view_source != PROTOCOL_VIEW_SOURCE_LAYERS)
        return true;
    if (render->comparison.compare) {
        error_set(error, ERROR_UNSUPPORTED, "render.compare",
                  "tracers are not compared in pictures that are made of layers");
        return error_remedy(error, "set view_source to rays, or compare to 0");
    }
    if (!(render->camera.shutter > 0.0f))
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.shutter", "layers show the scene at one time");
    return error_remedy(error, "set view_source to rays, or shutter to 0");
}

/* Checks the width and height of the views together. */
static bool check_size(const struct session_limits *limits, const struct message_render *render,
                       struct error *error)
{
    const uint32_t width = with_margin(render, render->picture.width * render->picture.views_across);
    const uint32_t height = with_margin(render, render->picture.height * render->picture.views_down);
    const bool is_wide = width > limits->width_pixels;
    if (!is_wide && height <= limits->height_pixels)
        return true;
    if (render->view.margin > 0.0f) {
        error_set(error, ERROR_LIMIT, "render.margin", "%u x %u pixels with it, the limit is %u x %u", width,
                  height, limits->width_pixels, limits->height_pixels);
        return error_remedy(error, "ask for less, or raise [limits] in the daemon's configuration");
    }
    const char *field = is_wide ? "render.width" : "render.height";
    if (has_views(render)) {
        const uint32_t views = is_wide ? render->picture.views_across : render->picture.views_down;
        field = views > 1 ? is_wide ? "render.views_across" : "render.views_down" : field;
        error_set(error, ERROR_LIMIT, field, "%u x %u views of %u x %u pixels are %u x %u, the limit is %u x %u",
                  render->picture.views_across, render->picture.views_down, render->picture.width,
                  render->picture.height, width, height, limits->width_pixels, limits->height_pixels);
        return error_remedy(error,
                            "ask for fewer or smaller views, or raise [limits] in the daemon's configuration");
    }
    error_set(error, ERROR_LIMIT, field, "%u x %u pixels, the limit is %u x %u", width, height,
              limits->width_pixels, limits->height_pixels);
    return error_remedy(error, "ask for less, or raise [limits] in the daemon's configuration");
}

static bool check_limits(const struct session *session, const struct message_render *render, struct error *error)
{
    const struct session_limits *limits = &session->hub->options.limits;
    if (!check_size(limits, render, error))
        return false;
    if (render->sampling.samples > limits->samples) {
        error_set(error, ERROR_LIMIT, "render.samples", "%u, the limit is %u", render->sampling.samples,
                  limits->samples);
        return error_remedy(error, "ask for less, or raise [limits] in the daemon's configuration");
    }
    if (session->job_count >= limits->jobs_per_client && !job_replaced_by(session, render)) {
        error_set(error, ERROR_LIMIT, "render", "%u jobs are running, the limit", session->job_count);
        error_remedy(error, "wait for one to end, cancel one, or raise limits.jobs in the daemon's configuration");
        error->retryable = true;
        return false;
    }
    return true;
}

uint64_t job_window(const struct session *session, const struct message_render *render)
{
    uint64_t window = session->hub->options.limits.frame_window_bytes / frame_bytes_of(render);
    return window < 1 ? 1 : window > WINDOW_FRAMES_MAX ? WINDOW_FRAMES_MAX : window;
}

uint64_t job_bytes(const struct session *session, const struct message_render *render)
{
    uint64_t frame_bytes = frame_bytes_of(render);
    uint64_t in_engine = ENGINE_FRAME_WINDOW_BYTES / frame_bytes;
    uint64_t in_flight = session->hub->options.limits.frames_in_flight;
    in_engine = in_engine < 1 ? 1 : in_engine < in_flight ? in_engine : in_flight;
    return frame_bytes * (in_engine + job_window(session, render));
}

/* Checks memory for frames: a job starts only if there is memory for its frames, so a started job never lacks it.
 */
static bool check_room(const struct session *session, const struct message_render *render, struct error *error)
{
    const struct hub *hub = session->hub;
    const struct job *before = job_replaced_by(session, render);
    const struct session_limits *limits = &hub->options.limits;
    uint64_t bytes = job_bytes(session, render), limit_bytes = limits->frame_bytes;
    uint64_t before_bytes = before ? before->frame_bytes + frames_bytes_of_replaced(before) : 0;
    uint64_t used_bytes = hub->frame_bytes - before_bytes;
    if (!used_bytes || (bytes <= limit_bytes && used_bytes <= limit_bytes - bytes))
        return true;
    error_set(error, ERROR_BUSY, "render",
              "frames of this job may take %" PRIu64 " bytes; running jobs may take %" PRIu64 " of %" PRIu64,
              bytes, used_bytes, limit_bytes);
    return error_remedy(error,
                        "try again when jobs have ended, ask for smaller frames, or raise memory.frames in the "
                        "daemon's configuration");
}

static bool check_camera(const struct message_render *render, struct error *error)
{
    if (render->camera.camera_path == PROTOCOL_CAMERA_KEYS && !render->keys_count)
        return error_set(error, ERROR_INVALID, "render.keys", "camera path keys needs at least one key");
    if (render->camera.camera_path == PROTOCOL_CAMERA_NODE && !render->camera.camera_node)
        return error_set(error, ERROR_INVALID, "render.camera_node", "camera path node needs a node");
    for (uint32_t i = 1; i < render->keys_count; i++) {
        if (!(render->keys[i].time_s > render->keys[i - 1].time_s))
            return error_set(error, ERROR_INVALID, "render.keys",
                             "key %u is at %g s, not after the one before at %g s", i,
                             (double)render->keys[i].time_s, (double)render->keys[i - 1].time_s);
    }
    return true;
}

static bool check_encoding(const struct session *session, const struct message_render *render,
                           enum protocol_encoding encoding, const char *field, struct error *error)
{
    bool is_stream = encoding == PROTOCOL_ENCODING_H264;
    if (is_stream && render->kind != PROTOCOL_JOB_VIEW) {
        error_set(error, ERROR_UNSUPPORTED, field, "frames of a batch stand alone, and h264 is a stream");
        return error_remedy(error, "choose raw, zstd, predicted or jpeg");
    }
    if (is_stream && !session->can_h264) {
        error_set(error, ERROR_UNSUPPORTED, field, "h264 is not among the capabilities of this connection");
        return error_remedy(error,
                            "a client that decodes it says so in its handshake, and a daemon that encodes it "
                            "in the reply; choose jpeg otherwise");
    }
    uint32_t pixel_bytes = protocol_pixel_format_bytes(render->picture.format);
    if (is_stream ? pixel_bytes == 4 : encoder_supports((enum encoding)encoding, pixel_bytes))
        return true;
    error_set(error, ERROR_UNSUPPORTED, field, "%s does not carry %s", protocol_encoding_text(encoding),
              protocol_pixel_format_text(render->picture.format));
    return error_remedy(error, "raw, zstd and predicted carry every format");
}

static bool check_tracers(const struct message_render *render, struct error *error)
{
    struct setting_fault fault;
    if (tracer_settings_check(&render->tracing.settings, "render.", &fault))
        return true;
    error_set(error, ERROR_INVALID, fault.field, "%s", fault.text);
    return error_remedy(error, "%s", fault.remedy);
}

/* Checks options that differ between views and batches. */
static bool check_kind(const struct session *session, const struct message_render *render, struct error *error)
{
    if (render->view.margin > 0.0f && render->kind == PROTOCOL_JOB_BATCH) {
        error_set(error, ERROR_UNSUPPORTED, "render.margin", "only a view has it, while it moves");
        return error_remedy(error, "set it to 0, or ask for a larger picture and field of view");
    }
    if (render->kind == PROTOCOL_JOB_BATCH) {
        if (render->view.attachments) {
            error_set(error, ERROR_UNSUPPORTED, "render.attachments", "frames of a batch have none");
            return error_remedy(error, "a batch has layers");
        }
        if (render->last_frame < render->first_frame)
            return error_set(error, ERROR_INVALID, "render.last_frame", "%u is before the first frame %u",
                             render->last_frame, render->first_frame);
        return true;
    }
    if (!check_encoding(session, render, render->view.still_encoding, "render.still_encoding", error))
        return false;
    if (!encoder_loses((enum encoding)render->view.still_encoding) ||
        encoder_loses((enum encoding)render->encoding))
        return true;
    error_set(error, ERROR_UNSUPPORTED, "render.still_encoding", "%s goes by a quality, and that of %s is none",
              protocol_encoding_text(render->view.still_encoding), protocol_encoding_text(render->encoding));
    return error_remedy(error, "let what moves lose as much, or what rests nothing");
}

bool job_check(const struct session *session, const struct message_render *render, struct error *error)
{
    enum session_scene_state state = session_scene(session, render->scene);
    if (state != SCENE_OPENING && state != SCENE_OPEN)
        return error_set(error, ERROR_UNKNOWN_ID, "render.scene", "there is no scene %u", render->scene);
    if (jobs_find(session, render->channel) && !job_replaced_by(session, render))
        return error_set(error, ERROR_INVALID, "render.channel", "a running job has channel %u", render->channel);
    if (!check_kind(session, render, error) || !check_noise(render, error) || !check_crop(render, error) ||
        !check_ground(render, error) || !check_views(render, error) || !check_layers(render, error))
        return false;
    if (!check_encoding(session, render, render->encoding, "render.encoding", error))
        return false;
    bool has_level = render->encoding == PROTOCOL_ENCODING_ZSTD || render->encoding == PROTOCOL_ENCODING_PREDICTED;
    if (has_level && render->quality > ZSTD_LEVEL_MAX)
        return error_set(error, ERROR_INVALID, "render.quality", "%s has levels up to %u, not %u",
                         protocol_encoding_text(render->encoding), ZSTD_LEVEL_MAX, render->quality);
    return check_tracers(render, error) && check_limits(session, render, error) && check_camera(render, error) &&
           check_room(session, render, error);
}

/* Quality of the encoding, a default where the client sets none. */
static uint32_t job_quality(const struct message_render *render)
{
    if (render->quality)
        return render->quality;
    return render->encoding == PROTOCOL_ENCODING_JPEG   ? QUALITY_OF_JPEG
           : render->encoding == PROTOCOL_ENCODING_H264 ? QUALITY_OF_H264
                                                        : LEVEL_OF_ZSTD;
}

/* ---- for the engine ---------------------------------------------------------------------------------- */

static struct tracer_options options_of(const struct session *session, const struct message_render *render)
{
    const uint64_t pixels = (uint64_t)render->picture.width * render->picture.height *
                            render->picture.views_across * render->picture.views_down;
    struct tracer_options options =
        tracer_options_of(&render->tracing.settings, &session->hub->options.limits.tracers);
    tracer_options_note_picture(&options, render->tracing.tracer, pixels);
    if (render->comparison.compare)
        tracer_options_note_picture(&options, render->comparison.compare_with, pixels);
    return options;
}

/* Copies an array of `count` records; NULL: there are none, or no memory. */
static void *copy_of(const void *records, uint32_t count, size_t record_bytes)
{
    void *copy = count > 0 ? malloc(count * record_bytes) : NULL;
    if (copy)
        memcpy(copy, records, count * record_bytes);
    return copy;
}

bool job_fill(struct engine_job *job, const struct session *session, const struct message_render *render)
{
    const bool is_view = render->kind == PROTOCOL_JOB_VIEW;
    *job = (struct engine_job){
        .kind = (enum job_kind)render->kind,
        .scene = render->scene,
        .first_frame = render->first_frame,
        .last_frame = is_view ? UINT32_MAX : render->last_frame,
        .frame_step = is_view ? 1 : render->frame_step,
        .frames_per_second = render->frames_per_second,
        .time_origin_frame = render->time_origin_frame,
        .frame =
            {
                .picture = render->picture,
                .sampling = render->sampling,
                .light = render->light,
                .comparison = render->comparison,
                .tracing = render->tracing,
                .tracer_options = options_of(session, render),
                .attachments = render->view.attachments,
                .starts_anew = !is_view && render->sampling.accumulate == PROTOCOL_ACCUMULATION_ANEW,
            },
        .encoding = (enum encoding)render->encoding,
        .quality = job_quality(render),
        .camera = render->camera,
        .view = render->view,
        .keys = copy_of(render->keys, render->keys_count, sizeof(*render->keys)),
        .key_count = render->keys_count,
        .clips = copy_of(render->clips, render->clips_count, sizeof(*render->clips)),
        .clip_count = render->clips_count,
        .weight = render->weight ? render->weight
                  : is_view      ? WEIGHT_OF_VIEW
                                 : WEIGHT_OF_BATCH,
    };
    job->frame.picture.width *= render->picture.views_across;
    job->frame.picture.height *= render->picture.views_down;
    return (job->keys || job->key_count == 0) && (job->clips || job->clip_count == 0);
}
