/* SPDX-License-Identifier: MIT */
/* Stream of the view: its settings as sent to the daemon, and its frames. */
#include "view.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <string.h>

#define CAMERA_PAUSE_NS 4000000ull /* between cameras; no screen refreshes faster */
#define REST_PAUSE_NS 120000000ull /* without movement, after which the view is at rest */
#define EDGE_MIN 16u
#define EDGE_MAX 8192u
#define FRAMES_AT_ONCE 4u /* per turn of the loop; then input is handled */
/* Frames that take longer to arrive than this are decoded by parts, and each part becomes a key. */
#define PARTS_NS 100000000ull

/* Returns an edge for `views` pictures side by side, each with an even edge since video subsamples chroma by 2. */
static uint32_t edge_of(uint32_t pixels, uint32_t views)
{
    const uint32_t edge = (pixels / views) & ~1u, maximum = EDGE_MAX / views;
    return views * (edge > EDGE_MIN ? edge < maximum ? edge : maximum : EDGE_MIN);
}

void view_render_size(const struct view *view, uint32_t *width, uint32_t *height)
{
    const bool stereo = view->settings.stereo, over = view->options->stereo_over;
    const uint32_t divisor = 1u << view->settings.coarser;
    *width = edge_of((uint32_t)view->screen->width / divisor, stereo && !over ? 2 : 1);
    *height = edge_of((uint32_t)view->screen->height / divisor, stereo && over ? 2 : 1);
}

void view_use_eyes(const struct view *view, struct message_render *render)
{
    const struct view_options *options = view->options;
    if (!view->settings.stereo)
        return;
    render->picture.eyes_over = options->stereo_over;
    render->picture.views_across = options->stereo_over ? 1 : 2;
    render->picture.views_down = options->stereo_over ? 2 : 1;
    render->picture.width /= render->picture.views_across;
    render->picture.height /= render->picture.views_down;
    render->picture.baseline = options->stereo_m;
    render->picture.view_source = view->settings.views;
    if (render->picture.view_source == PROTOCOL_VIEW_SOURCE_LAYERS)
        render->picture.ground = 0; /* the ground is not supported in pictures made from layers */
}

/* Chooses encodings. Pixels stay uncompressed on the same machine. A network gets video in motion, and lossless
 * pictures at rest. */
static void choose_encodings(const struct view *view, struct message_render *render)
{
    const struct view_options *options = view->options;
    const bool is_local = session_is_local(view->session);
    if (!options->has_encoding)
        render->encoding = is_local                          ? PROTOCOL_ENCODING_RAW
                           : session_can_h264(view->session) ? PROTOCOL_ENCODING_H264
                                                             : PROTOCOL_ENCODING_JPEG;
    if (!options->has_still_encoding)
        render->view.still_encoding = is_local ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_PREDICTED;
    render->view.adapt = options->always_adapt || (!is_local && !options->never_adapt);
    render->view.parts = !is_local;
}

static void send_view(struct view *view)
{
    struct message_render render = view->render;
    const struct settings *settings = &view->settings;
    struct record_clip_use use = {.speed = 1, .loop = 1};
    const struct fl_clip_info *clip =
        view->eye.tour.clip != TOUR_NONE ? fl_scene_clip(session_scene(view->session), (size_t)view->eye.tour.clip)
                                         : NULL;
    view_render_size(view, &render.picture.width, &render.picture.height);
    view_use_eyes(view, &render);
    choose_encodings(view, &render);
    render.tracing.tracer = settings->tracer;
    render.light.integrator = settings->integrator;
    render.tracing.settings = settings->tracers;
    render.picture.tone_map = settings->tone_map;
    render.picture.exposure_stops += (float)settings->exposure_thirds / 3;
    render.tracing.primary = view_primary(view);
    if (clip && clip->clip != 0) {
        use.clip = clip->clip;
        render.clips = &use;
        render.clips_count = 1;
    }
    view_ask_local(view, &render);
    render.view.moving_rate = view->options->moving_rate;
    view->sent.must_send_view = !session_show(view->session, &render, &view->sent.change);
    view->sent.must_send_camera = true; /* the new stream's frames carry the number of the camera sent after it */
}

static void send_camera(struct view *view, bool moving, uint64_t now_ns)
{
    struct fl_view_camera camera = {.time_s = (float)view->eye.tour.time_s, .moving = moving};
    struct viewer_camera aimed;
    view_aim(view, moving, now_ns, &aimed);
    camera_export(&aimed, &camera);
    camera.node = view_follows(view) ? view->eye.followed : 0;
    if (!session_set_camera(view->session, &camera, &view->sent.command))
        return;
    view->sent.must_send_camera = false;
    view->sent.has_sent_camera = true;
    view->sent.moving = moving;
    view->sent.camera_ns = now_ns;
}

void view_send(struct view *view, uint64_t now_ns)
{
    const bool is_moving = view->eye.moved_ns + REST_PAUSE_NS > now_ns;
    /* Another stream restarts the accumulation at rest, which costs little while it has few samples. */
    const bool is_young = view->frames.last.samples <= view->render.view.pass_samples;
    if (view->sent.must_send_view || ((is_moving || is_young) && view_asks_otherwise(view)))
        send_view(view);
    if (!view->eye.has_camera)
        return;
    if (view->sent.must_send_camera && now_ns >= view->sent.camera_ns + CAMERA_PAUSE_NS)
        send_camera(view, is_moving, now_ns);
    else if (view->sent.moving && !is_moving)
        send_camera(view, false, now_ns);
}

/* ---- frames ---- */

static bool decode(struct view *view, struct fl_frame *frame)
{
    struct fl_error error = {0};
    if (!frame->encoded) {
        pixmap_take(&view->frames.arrived, frame);
        return true;
    }
    if (!view->frames.decoder)
        view->frames.decoder = decoder_create(&view->failure);
    if (view->frames.decoder && decoder_decode(view->frames.decoder, frame, &view->frames.arrived, &error))
        return true;
    session_want_key_frame(view->session);
    return false;
}

static void take_structure(struct view *view, const struct fl_frame *frame)
{
    struct fl_structure_part part;
    view->frames.structure_count = 0;
    for (size_t at = 0; view->frames.structure_count < HUD_STRUCTURE_MAX && fl_structure_next(frame, &at, &part);)
        snprintf(view->frames.structure[view->frames.structure_count++], HUD_STRUCTURE_TEXT_MAX, "%.20s%s%.200s",
                 part.name, part.name[0] != '\0' ? ": " : "", part.text);
}

static void take(struct view *view, struct fl_frame *frame)
{
    if (frame->hidden_layer > 0) {
        if (!frame->more_follows)
            view_take_hidden(view, frame);
        return;
    }
    if (!decode(view, frame) || !view_take_picture(view, frame))
        return;
    if (!frame->more_follows) { /* parts count as one frame, whose last one has the costs */
        metrics_add(&view->frames.metrics, frame, monotonic_now_ns());
        take_structure(view, frame);
        session_deliver_parts(view->session, frame->receive_ns > PARTS_NS);
        view->frames.count++;
    }
    view->frames.last = *frame;
    view->frames.last.stages = NULL;
    view->frames.last.wave_comparisons = NULL;
    view->frames.last.structure = NULL;
    view->frames.last.encoded = NULL;
    view->frames.last.depth = NULL;
    view->frames.last.normals = NULL;
    view->frames.last.pixels = NULL;
    if (view_follows(view)) /* so that input continues from there */
        camera_from_frame(&view->eye.camera, frame, camera_distance(&view->eye.camera));
    view->taken = view->settings;
    view->screen->must_draw = true;
    view_plan_local(view, monotonic_now_ns());
}

void view_refuse_scene(struct view *view, const struct fl_error *refusal)
{
    if (view->is_dropped)
        snprintf(view->refused, sizeof(view->refused), "%.120s", refusal->text);
    else
        view->failure = *refusal;
    view->screen->must_draw = true;
}

/* Reverts a change that the daemon refuses. */
static void refuse(struct view *view, const struct fl_error *refusal)
{
    if (view->frames.count == 0) {
        view_refuse_scene(view, refusal);
        return;
    }
    screen_say(view->screen, "not possible: %s", refusal->text);
    view->settings = view->taken;
    view_refuse_local(view);
    view->eye.followed = 0; /* another client may have removed the node */
    view->sent.must_send_view = true;
}

void view_receive(struct view *view, unsigned timeout_ms)
{
    struct fl_error refusal = {0};
    struct fl_frame *frame = session_next(view->session, timeout_ms, &refusal);
    for (unsigned count = 1; frame; count++) {
        take(view, frame);
        fl_frame_destroy(frame);
        frame = count < FRAMES_AT_ONCE ? session_next(view->session, 0, &refusal) : NULL;
    }
    if (refusal.code != FL_ERROR_NONE)
        refuse(view, &refusal);
}

bool view_has_samples(const struct view *view, const struct fl_frame *frame, unsigned enough)
{
    const float noise = view->render.sampling.noise;
    return frame->samples >= enough || (noise > 0.0f && frame->noise <= noise);
}

bool view_is_at_rest(const struct view *view, unsigned samples)
{
    const unsigned maximum = view->render.sampling.samples,
                   enough = samples > 0 && samples < maximum ? samples : maximum;
    const struct fl_scene *scene = session_scene(view->session);
    return view->eye.has_camera && view->sent.has_sent_camera && !view->sent.must_send_view &&
           !view->sent.must_send_camera && (!scene || view->frames.last.revision >= fl_scene_revision(scene)) &&
           !view->sent.moving && view->eye.glide_begin_ns == 0 && view->frames.count > 0 &&
           view->frames.last.command == view->sent.command && view->frames.last.change == view->sent.change &&
           !view->frames.last.moving && !view->frames.last.more_follows &&
           !(view->frames.is_live && view->local.shows_made) && /* until the next step */
           view_has_samples(view, &view->frames.last, enough);
}

const struct pixmap *view_picture(const struct view *view)
{
    if (view_outline_is_shown(view))
        return &view->outline.picture;
    return view->heat.is_there ? &view->heat.map : view->local.shows_made ? &view->local.made : &view->frames.live;
}

void view_finish(struct view *view)
{
    session_destroy(view->session);
    decoder_destroy(view->frames.decoder);
    views_destroy(view->local.views);
    pixmap_finish(&view->frames.arrived);
    pixmap_finish(&view->local.made);
    pixmap_finish(&view->frames.live);
    pixmap_finish(&view->heat.compared);
    pixmap_finish(&view->heat.map);
    view_outline_forget(view);
}
