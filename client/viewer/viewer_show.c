/* SPDX-License-Identifier: MIT */
/* The view: its settings as sent to the daemon, and its frames. */
#include "viewer/viewer_state.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <string.h>

#define LOOK_PAUSE_NS 4000000ull   /* between cameras: no screen shows more */
#define REST_PAUSE_NS 120000000ull /* without movement: that was all of it */
#define EDGE_MIN 16u
#define EDGE_MAX 8192u
#define FRAMES_AT_ONCE 4u /* then people have their turn */
/* Where a frame takes so long to come, its first parts are worth decoding by themselves, and making a key of. */
#define PARTS_NS 100000000ull

/* Of `views` beside one another, each with an even edge: the chroma of a video is subsampled by 2. */
static uint32_t edge_of(uint32_t pixels, uint32_t views)
{
    const uint32_t edge = (pixels / views) & ~1u, maximum = EDGE_MAX / views;
    return views * (edge > EDGE_MIN ? edge < maximum ? edge : maximum : EDGE_MIN);
}

void viewer_render_size(const struct viewer *viewer, uint32_t *width, uint32_t *height)
{
    const bool stereo = viewer->settings.stereo, over = viewer->options->stereo_over;
    const uint32_t divisor = 1u << viewer->settings.coarser;
    *width = edge_of((uint32_t)viewer->width / divisor, stereo && !over ? 2 : 1);
    *height = edge_of((uint32_t)viewer->height / divisor, stereo && over ? 2 : 1);
}

void viewer_use_eyes(const struct viewer *viewer, struct message_render *view)
{
    const struct viewer_options *options = viewer->options;
    if (!viewer->settings.stereo)
        return;
    view->eyes_over = options->stereo_over;
    view->views_across = options->stereo_over ? 1 : 2;
    view->views_down = options->stereo_over ? 2 : 1;
    view->width /= view->views_across;
    view->height /= view->views_down;
    view->baseline = options->stereo_m;
    view->view_source = viewer->settings.views;
    if (view->view_source == PROTOCOL_VIEW_SOURCE_LAYERS)
        view->ground = 0; /* pictures that are made of layers have none */
}

/* On this machine pixels travel as they are; over a network as video while they move, and without loss at rest. */
static void choose_encodings(const struct viewer *viewer, struct message_render *view)
{
    const struct viewer_options *options = viewer->options;
    const bool is_local = session_is_local(viewer->session);
    if (!options->has_encoding)
        view->encoding = is_local                            ? PROTOCOL_ENCODING_RAW
                         : session_can_h264(viewer->session) ? PROTOCOL_ENCODING_H264
                                                             : PROTOCOL_ENCODING_JPEG;
    if (!options->has_still_encoding)
        view->still_encoding = is_local ? PROTOCOL_ENCODING_RAW : PROTOCOL_ENCODING_PREDICTED;
    view->adapt = options->always_adapt || (!is_local && !options->never_adapt);
    view->parts = !is_local;
}

static void show(struct viewer *viewer)
{
    struct message_render view = viewer->view;
    const struct settings *settings = &viewer->settings;
    struct record_clip_use use = {.speed = 1, .loop = 1};
    const struct fl_clip_info *clip =
        viewer->tour.clip != TOUR_NONE ? fl_scene_clip(session_scene(viewer->session), (size_t)viewer->tour.clip)
                                       : NULL;
    viewer_render_size(viewer, &view.width, &view.height);
    viewer_use_eyes(viewer, &view);
    choose_encodings(viewer, &view);
    view.tracer = settings->tracer;
    view.integrator = settings->integrator;
    view.settings = settings->tracers;
    view.tone_map = settings->tone_map;
    view.exposure_stops += (float)settings->exposure_thirds / 3;
    view.primary = viewer_primary(viewer);
    if (clip && clip->clip != 0) {
        use.clip = clip->clip;
        view.clips = &use;
        view.clips_count = 1;
    }
    viewer_ask_local(viewer, &view);
    view.moving_rate = viewer->options->moving_rate;
    viewer->must_show = !session_show(viewer->session, &view, &viewer->change);
    viewer->must_look = true; /* frames name a camera from which on they are the new ones */
}

static void look(struct viewer *viewer, bool moving, uint64_t now_ns)
{
    struct fl_view_camera camera = {.time_s = (float)viewer->tour.time_s, .moving = moving};
    struct viewer_camera aimed;
    viewer_aim(viewer, moving, now_ns, &aimed);
    camera_export(&aimed, &camera);
    camera.node = viewer_follows(viewer) ? viewer->followed : 0;
    if (!session_look(viewer->session, &camera, &viewer->command))
        return;
    viewer->must_look = false;
    viewer->has_looked = true;
    viewer->told_moving = moving;
    viewer->looked_ns = now_ns;
}

void viewer_tell(struct viewer *viewer, uint64_t now_ns)
{
    const bool is_moving = viewer->moved_ns + REST_PAUSE_NS > now_ns;
    /* Another stream begins the picture at rest from new, which matters little while it has its first samples. */
    const bool is_young = viewer->frame.samples <= viewer->view.pass_samples;
    if (viewer->must_show || ((is_moving || is_young) && viewer_asks_otherwise(viewer)))
        show(viewer);
    if (!viewer->has_camera)
        return;
    if (viewer->must_look && now_ns >= viewer->looked_ns + LOOK_PAUSE_NS)
        look(viewer, is_moving, now_ns);
    else if (viewer->told_moving && !is_moving)
        look(viewer, false, now_ns);
}

/* ---- frames ---- */

static bool decode(struct viewer *viewer, struct fl_frame *frame)
{
    struct fl_error error = {0};
    if (!frame->encoded) {
        pixmap_take(&viewer->arrived, frame);
        return true;
    }
    if (!viewer->decoder)
        viewer->decoder = decoder_create(&viewer->failure);
    if (viewer->decoder && decoder_decode(viewer->decoder, frame, &viewer->arrived, &error))
        return true;
    session_want_key_frame(viewer->session);
    return false;
}

static void take_structure(struct viewer *viewer, const struct fl_frame *frame)
{
    struct fl_structure_part part;
    viewer->structure_count = 0;
    for (size_t at = 0; viewer->structure_count < HUD_STRUCTURE_MAX && fl_structure_next(frame, &at, &part);)
        snprintf(viewer->structure[viewer->structure_count++], HUD_STRUCTURE_TEXT_MAX, "%.20s%s%.200s", part.name,
                 part.name[0] != '\0' ? ": " : "", part.text);
}

static void take(struct viewer *viewer, struct fl_frame *frame)
{
    if (frame->hidden_layer > 0) {
        if (!frame->more_follows)
            viewer_take_hidden(viewer, frame);
        return;
    }
    if (!decode(viewer, frame) || !viewer_take_picture(viewer, frame))
        return;
    if (!frame->more_follows) { /* it is one frame, whose costs come with its end */
        metrics_add(&viewer->metrics, frame, monotonic_now_ns());
        take_structure(viewer, frame);
        session_deliver_parts(viewer->session, frame->receive_ns > PARTS_NS);
        viewer->frames++;
    }
    viewer->frame = *frame;
    viewer->frame.stages = NULL;
    viewer->frame.wave_comparisons = NULL;
    viewer->frame.structure = NULL;
    viewer->frame.encoded = NULL;
    viewer->frame.depth = NULL;
    viewer->frame.normals = NULL;
    viewer->frame.pixels = NULL;
    if (viewer_follows(viewer)) /* for a hand to begin there */
        camera_from_frame(&viewer->camera, frame, camera_distance(&viewer->camera));
    viewer->taken = viewer->settings;
    viewer->must_draw = true;
    viewer_plan_local(viewer, monotonic_now_ns());
}

/* A change that the daemon refuses is reverted. */
static void refuse(struct viewer *viewer, const struct fl_error *refusal)
{
    if (viewer->frames == 0) {
        viewer_refuse_scene(viewer, refusal);
        return;
    }
    viewer_say(viewer, "not possible: %s", refusal->text);
    viewer->settings = viewer->taken;
    viewer_refuse_local(viewer);
    viewer->followed = 0; /* somebody may have taken its node away */
    viewer->must_show = true;
}

void viewer_receive(struct viewer *viewer, unsigned timeout_ms)
{
    struct fl_error refusal = {0};
    struct fl_frame *frame = session_next(viewer->session, timeout_ms, &refusal);
    for (unsigned count = 1; frame; count++) {
        take(viewer, frame);
        fl_frame_destroy(frame);
        frame = count < FRAMES_AT_ONCE ? session_next(viewer->session, 0, &refusal) : NULL;
    }
    if (refusal.code != FL_ERROR_NONE)
        refuse(viewer, &refusal);
}

bool viewer_has_samples(const struct viewer *viewer, const struct fl_frame *frame, unsigned enough)
{
    const float noise = viewer->view.noise;
    return frame->samples >= enough || (noise > 0.0f && frame->noise <= noise);
}

bool viewer_is_at_rest(const struct viewer *viewer, unsigned samples)
{
    const unsigned maximum = viewer->view.samples, enough = samples > 0 && samples < maximum ? samples : maximum;
    const struct fl_scene *scene = session_scene(viewer->session);
    return viewer->has_camera && viewer->has_looked && !viewer->must_show && !viewer->must_look &&
           (!scene || viewer->frame.revision >= fl_scene_revision(scene)) && !viewer->told_moving &&
           viewer->glide_begin_ns == 0 && viewer->frames > 0 && viewer->frame.command == viewer->command &&
           viewer->frame.change == viewer->change && !viewer->frame.moving && !viewer->frame.more_follows &&
           viewer_has_samples(viewer, &viewer->frame, enough);
}
