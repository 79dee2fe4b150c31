/* SPDX-License-Identifier: MIT */
/* Views warped locally while the camera moves: requests of key frames, and the choice of the picture that is
 * shown. */
#include "local.h"
#include "view.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <string.h>

#define MARGIN 0.1f        /* added at each side, as a share of the picture's edge */
#define DEPTH_PIXELS 0.25f /* largest error in pixels, due to rounded depths, for eyes within the radius */
/* The first layer holds most surfaces that appear behind edges: two thirds in a class room. A second one adds a
 * tenth. */
#define HIDDEN_LAYERS 1
#define RADIUS_FACTOR 4 /* change of the distance to the subject that needs another radius */
#define ROUNDS_MIN 3u   /* frames before the decision; the first ones build acceleration structures */
/* Difference in floats between the daemon's camera and the same one here: less than a hundredth of a pixel. */
#define SAME 1e-5

/* ---- conditions ---- */

bool view_has_local(const struct view *view)
{
    const enum local_views mode = view->settings.local;
    /* The daemon alone knows the camera's place when a clip moves it. */
    return (mode == LOCAL_ON || (mode == LOCAL_AUTO && view->local.switched.on)) && !view_follows(view);
}

void view_plan_local(struct view *view, uint64_t now_ns)
{
    struct metrics_summary summary;
    metrics_summarise(&view->frames.metrics, now_ns, &summary);
    if (view->frames.last.moving)
        plan_pace_add(&view->local.pace, view->frames.last.command_sent_ns, now_ns);
    if (view->frames.count == 1) /* a first key, so that the first drag has a picture to warp */
        view->local.switched.on = true;
    else if (summary.round_frames >= ROUNDS_MIN)
        plan_switch(&view->local.switched, summary.round_s, now_ns);
}

/* ---- requests to the daemon ---- */

/* Returns the distance between both eyes; 0: one view. */
static float baseline_of(const struct view *view)
{
    return view->settings.stereo ? view->options->stereo_m : 0;
}

static float radius_of(const struct view *view)
{
    return view->eye.has_camera
               ? (float)(PLAN_RADIUS_SHARE * camera_distance(&view->eye.camera)) + baseline_of(view) / 2
               : 0;
}

void view_ask_local(struct view *view, struct message_render *render)
{
    view->local.asked = view_has_local(view);
    view->local.granted = false;
    if (!view->local.asked)
        return;
    if (radius_of(view) > 0)
        render->view.depth_radius = radius_of(view);
    view->local.radius = render->view.depth_radius;
    render->view.attachments |= FL_ATTACH_DEPTH | FL_ATTACH_STICKING;
    render->view.depth_form = PROTOCOL_DEPTH_FORM_INVERSE;
    render->view.depth_pixels = DEPTH_PIXELS;
    render->view.margin = MARGIN;
    /* The daemon has no hidden layers for a lens or an open shutter. */
    render->view.hidden_layers = render->camera.aperture > 0 || render->camera.shutter > 0 ? 0 : HIDDEN_LAYERS;
}

bool view_asks_otherwise(const struct view *view)
{
    const float radius = radius_of(view), asked = view->local.radius;
    if (view_has_local(view) != view->local.asked)
        return true;
    return view->local.asked && radius > 0 && (radius > asked * RADIUS_FACTOR || radius < asked / RADIUS_FACTOR);
}

void view_refuse_local(struct view *view)
{
    if (view->local.asked && !view->local.granted)
        view->settings.local = LOCAL_OFF;
}

/* ---- of which camera, and when ---- */

static void follow_motion(struct view *view, uint64_t now_ns)
{
    if (!view->eye.has_camera ||
        memcmp(&view->local.followed_camera, &view->eye.camera, sizeof(view->eye.camera)) == 0)
        return;
    plan_motion_add(&view->local.motion, &view->eye.camera, now_ns);
    view->local.followed_camera = view->eye.camera;
}

void view_aim(const struct view *view, bool moving, uint64_t now_ns, struct viewer_camera *camera)
{
    *camera = view->eye.camera;
    if (moving && view->local.asked)
        plan_motion_predict(&view->local.motion, now_ns, plan_pace_ahead_ns(&view->local.pace), camera);
}

/* ---- received pictures ---- */

/* Crops the frame's size and field of view to the part inside the margin. */
static void leave_margin(struct fl_frame *frame)
{
    const double inner = (double)(frame->height - 2 * frame->margin_y) / frame->height;
    frame->width -= 2 * frame->margin_x;
    frame->height -= 2 * frame->margin_y;
    frame->fov_y = (float)(2 * atan(inner * tan((double)frame->fov_y / 2)));
    frame->ortho_height *= (float)inner;
}

/* Makes the picture the new key. The key takes the pixels if the picture itself is not shown. */
static bool give_key(struct view *view, struct fl_frame *frame, bool is_shown)
{
    struct views_key key = {.depth_step = frame->depth_step,
                            .radius = view->local.radius,
                            .is_smeared = frame->encoding == PROTOCOL_ENCODING_JPEG ||
                                          frame->encoding == PROTOCOL_ENCODING_H264,
                            .is_moving = frame->moving,
                            .is_final = !frame->moving && !frame->more_follows &&
                                        view_has_samples(view, frame, view->render.sampling.samples),
                            .came_ns = monotonic_now_ns()};
    if (!view->local.views)
        view->local.views = views_create(&view->failure);
    if (!view->local.views || (is_shown && !pixmap_copy(&key.picture, &view->frames.arrived, &view->failure)))
        return false;
    if (!is_shown)
        pixmap_exchange(&key.picture, &view->frames.arrived);
    memcpy(key.camera.world_from_view, frame->world_from_view, sizeof(key.camera.world_from_view));
    key.camera.fov_y = frame->fov_y;
    key.depth = frame->depth;
    key.sticking = frame->sticking;
    frame->depth = NULL;
    frame->sticking = NULL;
    views_give_key(view->local.views, &key);
    view->local.key_frame = frame->frame;
    view->local.has_keys = view->local.granted = true;
    return true;
}

bool view_take_picture(struct view *view, struct fl_frame *frame)
{
    const bool has_margin = frame->margin_x > 0 || frame->margin_y > 0;
    const bool is_key = frame->depth && frame->fov_y > 0 && view_has_local(view);
    /* A key for two eyes is seen from between them; the pictures of the eyes have no depth. */
    const bool is_middle = view->settings.stereo && frame->depth;
    const bool is_shown = !is_middle;
    if (is_middle && !is_key)
        return false; /* no views are made any more */
    view->frames.is_live = is_shown && (!frame->moving || !is_key);
    if (is_key && !give_key(view, frame, is_shown))
        return false;
    const int margin_x = (int)frame->margin_x, margin_y = (int)frame->margin_y;
    if (is_shown && has_margin &&
        !pixmap_crop(&view->frames.live, &view->frames.arrived, margin_x, margin_y, &view->failure))
        return false;
    if (is_shown && !has_margin)
        pixmap_exchange(&view->frames.live, &view->frames.arrived);
    leave_margin(frame);
    return true;
}

void view_take_hidden(struct view *view, struct fl_frame *frame)
{
    struct views_layer layer = {0};
    metrics_add_bytes(&view->frames.metrics, frame->wire_bytes);
    if (!view->local.has_keys || frame->of_frame != view->local.key_frame || !frame->depth || !frame->pixels)
        return;
    pixmap_take(&layer.picture, frame);
    layer.depth = frame->depth;
    frame->depth = NULL;
    views_give_layer(view->local.views, &layer);
}

/* ---- choice of the shown picture ---- */

void view_forget_local(struct view *view)
{
    view->screen->must_draw |= view->local.shows_made;
    view->local.has_keys = view->local.has_made = view->local.shows_made = false;
    view->local.request = 0;
    if (view->local.views)
        views_forget_keys(view->local.views);
}

static bool same_camera(const struct view *view)
{
    const struct fl_frame *frame = &view->frames.last;
    const double eye_scale = camera_distance(&view->eye.camera);
    float pose[12];
    camera_pose(&view->eye.camera, pose);
    bool same = fabs((double)frame->fov_y - view->eye.camera.fov_y) < SAME;
    for (int i = 0; i < 12; i++)
        same &= fabs((double)(pose[i] - frame->world_from_view[i])) < SAME * (i % 4 == 3 ? eye_scale : 1);
    return same;
}

/* The last frame already shows the newest camera. */
static bool is_newest(const struct view *view)
{
    const bool is_asked = view->frames.last.command == view->sent.command && !view->sent.must_send_camera;
    return view->frames.is_live && ((is_asked && !view->frames.last.moving) || same_camera(view));
}

static struct views_request request_of(const struct view *view)
{
    struct views_request request = {.holes = view->settings.holes,
                                    .baseline = baseline_of(view),
                                    .over = view->options->stereo_over,
                                    .frame_ns = view->screen->window ? window_frame_ns(view->screen->window)
                                                                     : PLAN_FRAME_NS,
                                    .moved_ns = view->eye.moved_ns};
    view_render_size(view, &request.width, &request.height);
    camera_pose(&view->eye.camera, request.camera.world_from_view);
    request.camera.fov_y = (float)view->eye.camera.fov_y;
    return request;
}

static bool is_wanted(const struct view *view, const struct views_request *request)
{
    const struct views_request *before = &view->local.requested;
    return view->local.request != 0 && memcmp(&request->camera, &before->camera, sizeof(request->camera)) == 0 &&
           request->width == before->width && request->height == before->height &&
           request->holes == before->holes && (request->baseline > 0) == (before->baseline > 0);
}

static void start_views(struct view *view)
{
    const struct views_request request = request_of(view);
    if (is_wanted(view, &request))
        return;
    view->local.requested = request;
    view->local.request = views_start(view->local.views, &request);
}

/* Difference between a picture of that camera and one of the present camera, in radians: the angle between
 * their directions plus the angle between their eyes as seen from the subject. Approximate. */
static double difference(const struct view *view, const float world_from_view[12])
{
    float now[12];
    double along = 0, aside = 0;
    camera_pose(&view->eye.camera, now);
    for (int i = 0; i < 3; i++) {
        along += (double)(now[i * 4 + 2] * world_from_view[i * 4 + 2]);
        aside = hypot(aside, (double)(now[i * 4 + 3] - world_from_view[i * 4 + 3]));
    }
    return acos(fmax(-1, fmin(1, along))) + aside / camera_distance(&view->eye.camera);
}

/* The warped view is better than the daemon's last picture: almost no holes, and not an older camera. For two
 * eyes the daemon sends no picture of its own. */
static bool is_better(const struct view *view)
{
    const struct views_made *made = &view->local.made_of;
    return view->settings.stereo ||
           (views_unseen(made) <= (float)PLAN_UNSEEN_MAX &&
            difference(view, made->camera.world_from_view) <= difference(view, view->frames.last.world_from_view));
}

static void show_view(struct view *view)
{
    const uint64_t before = view->local.has_made ? view->local.made_of.request : 0;
    const bool has_come = views_take(view->local.views, &view->local.made, &view->local.made_of),
               was_shown = view->local.shows_made;
    view->local.has_made |= has_come;
    view->local.shows_made = view->local.has_made && is_better(view);
    view->screen->must_draw |= view->local.shows_made ? has_come || !was_shown : was_shown;
    if (!has_come || !view->local.shows_made)
        return;
    /* A view of the same request from a newer key does not count as a response to a move. */
    const uint64_t moved_ns = view->local.made_of.request != before ? view->local.made_of.moved_ns : 0;
    metrics_add_view(&view->frames.metrics, moved_ns, monotonic_now_ns());
    view->local.count++;
}

void view_step_local(struct view *view, uint64_t now_ns)
{
    struct fl_warp_error why;
    follow_motion(view, now_ns);
    if (!view->local.views)
        return;
    if (view->local.has_keys && !view_has_local(view))
        view_forget_local(view); /* the views would be outdated when warping begins again */
    if (!view->eye.has_camera || !view->local.has_keys || is_newest(view)) {
        views_stop(view->local.views);
        view->local.request = 0;
        view->screen->must_draw |= view->local.shows_made;
        view->local.has_made = view->local.shows_made = false;
        return;
    }
    start_views(view);
    show_view(view);
    if (views_take_error(view->local.views, &why))
        screen_say(view->screen, "no view can be made: %s %s", why.field, why.text);
}

bool view_shows_camera(const struct view *view)
{
    const struct views_request request = request_of(view);
    if (view->local.shows_made)
        return is_wanted(view, &request) &&
               views_is_best(view->local.views, &view->local.made_of, view->local.request);
    return view->frames.count > 0 && is_newest(view);
}
