/* SPDX-License-Identifier: MIT */
/* Views that are made here while the camera moves: what the daemon is asked for, and which picture is shown. */
#include "viewer/viewer_state.h"
#include "protocol/common/clock.h"

#include <math.h>
#include <string.h>

#define MARGIN 0.1f        /* share of the picture's edges on each side */
#define DEPTH_PIXELS 0.25f /* that the rounding of depths may move what an eye within the radius sees */
#define HIDDEN_LAYERS                                                                                             \
    1 /* has most of what eyes see past edges: of a class room two thirds, a second one a tenth */
#define RADIUS_FACTOR 4 /* another distance of what is looked at is another radius, if it is so much */
#define ROUNDS_MIN 3u   /* frames before it is decided: the first ones are of structures that are built */
/* Between the daemon's camera and the same one here, both in floats: less than a hundredth of a pixel. */
#define SAME 1e-5

/* ---- whether ---- */

bool viewer_has_local(const struct viewer *viewer)
{
    const enum local_views mode = viewer->settings.local;
    /* Where a clip moves the camera, only the daemon knows where it is. */
    return (mode == LOCAL_ON || (mode == LOCAL_AUTO && viewer->local_switch.on)) && !viewer_follows(viewer);
}

void viewer_plan_local(struct viewer *viewer, uint64_t now_ns)
{
    struct metrics_summary summary;
    metrics_summarise(&viewer->metrics, now_ns, &summary);
    if (viewer->frame.moving)
        plan_pace_add(&viewer->pace, viewer->frame.command_sent_ns, now_ns);
    if (viewer->frames == 1) /* else the first drag would find no picture to make views from */
        viewer->local_switch.on = true;
    else if (summary.round_frames >= ROUNDS_MIN)
        plan_switch(&viewer->local_switch, summary.round_s, now_ns);
}

/* ---- what the daemon is asked for ---- */

/* Between both eyes; 0: there is one. */
static float baseline_of(const struct viewer *viewer)
{
    return viewer->settings.stereo ? viewer->options->stereo_m : 0;
}

static float radius_of(const struct viewer *viewer)
{
    return viewer->has_camera
               ? (float)(PLAN_RADIUS_SHARE * camera_distance(&viewer->camera)) + baseline_of(viewer) / 2
               : 0;
}

void viewer_ask_local(struct viewer *viewer, struct message_render *view)
{
    viewer->local_asked = viewer_has_local(viewer);
    viewer->local_granted = false;
    if (!viewer->local_asked)
        return;
    if (radius_of(viewer) > 0)
        view->depth_radius = radius_of(viewer);
    viewer->local_radius = view->depth_radius;
    view->attachments |= FL_ATTACH_DEPTH | FL_ATTACH_STICKING;
    view->depth_form = PROTOCOL_DEPTH_FORM_INVERSE;
    view->depth_pixels = DEPTH_PIXELS;
    view->margin = MARGIN;
    /* Of a lens or an open shutter the daemon has none. */
    view->hidden_layers = view->aperture > 0 || view->shutter > 0 ? 0 : HIDDEN_LAYERS;
}

bool viewer_asks_otherwise(const struct viewer *viewer)
{
    const float radius = radius_of(viewer), asked = viewer->local_radius;
    if (viewer_has_local(viewer) != viewer->local_asked)
        return true;
    return viewer->local_asked && radius > 0 && (radius > asked * RADIUS_FACTOR || radius < asked / RADIUS_FACTOR);
}

void viewer_refuse_local(struct viewer *viewer)
{
    if (viewer->local_asked && !viewer->local_granted)
        viewer->settings.local = LOCAL_OFF;
}

/* ---- of which camera, and when ---- */

static void follow_motion(struct viewer *viewer, uint64_t now_ns)
{
    if (!viewer->has_camera || memcmp(&viewer->followed_camera, &viewer->camera, sizeof(viewer->camera)) == 0)
        return;
    plan_motion_add(&viewer->motion, &viewer->camera, now_ns);
    viewer->followed_camera = viewer->camera;
}

void viewer_aim(const struct viewer *viewer, bool moving, uint64_t now_ns, struct viewer_camera *camera)
{
    *camera = viewer->camera;
    if (moving && viewer->local_asked)
        plan_motion_predict(&viewer->motion, now_ns, plan_pace_ahead_ns(&viewer->pace), camera);
}

/* ---- what comes ---- */

/* What is left without the margin. */
static void leave_margin(struct fl_frame *frame)
{
    const double inner = (double)(frame->height - 2 * frame->margin_y) / frame->height;
    frame->width -= 2 * frame->margin_x;
    frame->height -= 2 * frame->margin_y;
    frame->fov_y = (float)(2 * atan(inner * tan((double)frame->fov_y / 2)));
    frame->ortho_height *= (float)inner;
}

/* Leaves the picture to the key where it is not shown as well. */
static bool give_key(struct viewer *viewer, struct fl_frame *frame, bool is_shown)
{
    struct views_key key = {.depth_step = frame->depth_step,
                            .radius = viewer->local_radius,
                            .is_smeared = frame->encoding == PROTOCOL_ENCODING_JPEG ||
                                          frame->encoding == PROTOCOL_ENCODING_H264,
                            .is_moving = frame->moving,
                            .is_final = !frame->moving && !frame->more_follows &&
                                        viewer_has_samples(viewer, frame, viewer->view.samples),
                            .came_ns = monotonic_now_ns()};
    if (!viewer->views)
        viewer->views = views_create(&viewer->failure);
    if (!viewer->views || (is_shown && !pixmap_copy(&key.picture, &viewer->arrived, &viewer->failure)))
        return false;
    if (!is_shown)
        pixmap_exchange(&key.picture, &viewer->arrived);
    memcpy(key.camera.world_from_view, frame->world_from_view, sizeof(key.camera.world_from_view));
    key.camera.fov_y = frame->fov_y;
    key.depth = frame->depth;
    key.sticking = frame->sticking;
    frame->depth = NULL;
    frame->sticking = NULL;
    views_give_key(viewer->views, &key);
    viewer->key_frame = frame->frame;
    viewer->has_keys = viewer->local_granted = true;
    return true;
}

bool viewer_take_picture(struct viewer *viewer, struct fl_frame *frame)
{
    const bool has_margin = frame->margin_x > 0 || frame->margin_y > 0;
    const bool is_key = frame->depth && frame->fov_y > 0 && viewer_has_local(viewer);
    /* Of two eyes, whose own picture has no depth. */
    const bool is_middle = viewer->settings.stereo && frame->depth;
    const bool is_shown = !is_middle;
    if (is_middle && !is_key)
        return false; /* no view is made of it any more */
    viewer->is_live = is_shown && (!frame->moving || !is_key);
    if (is_key && !give_key(viewer, frame, is_shown))
        return false;
    const int margin_x = (int)frame->margin_x, margin_y = (int)frame->margin_y;
    if (is_shown && has_margin &&
        !pixmap_crop(&viewer->live, &viewer->arrived, margin_x, margin_y, &viewer->failure))
        return false;
    if (is_shown && !has_margin)
        pixmap_exchange(&viewer->live, &viewer->arrived);
    leave_margin(frame);
    return true;
}

void viewer_take_hidden(struct viewer *viewer, struct fl_frame *frame)
{
    struct views_layer layer = {0};
    metrics_add_bytes(&viewer->metrics, frame->wire_bytes);
    if (!viewer->has_keys || frame->of_frame != viewer->key_frame || !frame->depth || !frame->pixels)
        return;
    pixmap_take(&layer.picture, frame);
    layer.depth = frame->depth;
    frame->depth = NULL;
    views_give_layer(viewer->views, &layer);
}

/* ---- what is shown ---- */

void viewer_forget_local(struct viewer *viewer)
{
    viewer->must_draw |= viewer->shows_made;
    viewer->has_keys = viewer->has_made = viewer->shows_made = false;
    viewer->wish = 0;
    if (viewer->views)
        views_forget_keys(viewer->views);
}

static bool same_camera(const struct viewer *viewer)
{
    const struct fl_frame *frame = &viewer->frame;
    const double eye_scale = camera_distance(&viewer->camera);
    float pose[12];
    camera_pose(&viewer->camera, pose);
    bool same = fabs((double)frame->fov_y - viewer->camera.fov_y) < SAME;
    for (int i = 0; i < 12; i++)
        same &= fabs((double)(pose[i] - frame->world_from_view[i])) < SAME * (i % 4 == 3 ? eye_scale : 1);
    return same;
}

/* The last frame itself shows what the camera sees. */
static bool is_newest(const struct viewer *viewer)
{
    const bool is_asked = viewer->frame.command == viewer->command && !viewer->must_look;
    return viewer->is_live && ((is_asked && !viewer->frame.moving) || same_camera(viewer));
}

static struct views_wish wish_of(const struct viewer *viewer)
{
    struct views_wish wish = {.holes = viewer->settings.holes,
                              .baseline = baseline_of(viewer),
                              .over = viewer->options->stereo_over,
                              .frame_ns = viewer->window ? window_frame_ns(viewer->window) : PLAN_FRAME_NS,
                              .moved_ns = viewer->moved_ns};
    viewer_render_size(viewer, &wish.width, &wish.height);
    camera_pose(&viewer->camera, wish.camera.world_from_view);
    wish.camera.fov_y = (float)viewer->camera.fov_y;
    return wish;
}

static bool is_wanted(const struct viewer *viewer, const struct views_wish *wish)
{
    const struct views_wish *before = &viewer->wished;
    return viewer->wish != 0 && memcmp(&wish->camera, &before->camera, sizeof(wish->camera)) == 0 &&
           wish->width == before->width && wish->height == before->height && wish->holes == before->holes &&
           (wish->baseline > 0) == (before->baseline > 0);
}

static void want(struct viewer *viewer)
{
    const struct views_wish wish = wish_of(viewer);
    if (is_wanted(viewer, &wish))
        return;
    viewer->wished = wish;
    viewer->wish = views_want(viewer->views, &wish);
}

/* How much else a picture of that camera shows than one of the present camera: the angle between both views, and
 * that between their eyes as seen from what is looked at. Radians, about. */
static double off(const struct viewer *viewer, const float world_from_view[12])
{
    float now[12];
    double along = 0, aside = 0;
    camera_pose(&viewer->camera, now);
    for (int i = 0; i < 3; i++) {
        along += (double)(now[i * 4 + 2] * world_from_view[i * 4 + 2]);
        aside = hypot(aside, (double)(now[i * 4 + 3] - world_from_view[i * 4 + 3]));
    }
    return acos(fmax(-1, fmin(1, along))) + aside / camera_distance(&viewer->camera);
}

/* The view is nearer to the truth than the daemon's own last picture: hardly a hole, and no older camera. Of two
 * eyes there is no picture of the daemon's own. */
static bool is_better(const struct viewer *viewer)
{
    const struct views_made *made = &viewer->made_of;
    return viewer->settings.stereo ||
           (views_unseen(made) <= (float)PLAN_UNSEEN_MAX &&
            off(viewer, made->camera.world_from_view) <= off(viewer, viewer->frame.world_from_view));
}

static void show_view(struct viewer *viewer)
{
    const uint64_t before = viewer->has_made ? viewer->made_of.wish : 0;
    const bool has_come = views_take(viewer->views, &viewer->made, &viewer->made_of),
               was_shown = viewer->shows_made;
    viewer->has_made |= has_come;
    viewer->shows_made = viewer->has_made && is_better(viewer);
    viewer->must_draw |= viewer->shows_made ? has_come || !was_shown : was_shown;
    if (!has_come || !viewer->shows_made)
        return;
    /* One from a newer key is no answer to a move. */
    const uint64_t moved_ns = viewer->made_of.wish != before ? viewer->made_of.moved_ns : 0;
    metrics_add_view(&viewer->metrics, moved_ns, monotonic_now_ns());
    viewer->local_views++;
}

void viewer_step_local(struct viewer *viewer, uint64_t now_ns)
{
    struct fl_warp_error why;
    follow_motion(viewer, now_ns);
    if (!viewer->views)
        return;
    if (viewer->has_keys && !viewer_has_local(viewer))
        viewer_forget_local(viewer); /* they would be old when views are made again */
    if (!viewer->has_camera || !viewer->has_keys || is_newest(viewer)) {
        views_want_none(viewer->views);
        viewer->wish = 0;
        viewer->must_draw |= viewer->shows_made;
        viewer->has_made = viewer->shows_made = false;
        return;
    }
    want(viewer);
    show_view(viewer);
    if (views_take_error(viewer->views, &why))
        viewer_say(viewer, "no view can be made: %s %s", why.field, why.text);
}

bool viewer_shows_camera(const struct viewer *viewer)
{
    const struct views_wish wish = wish_of(viewer);
    if (viewer->shows_made)
        return is_wanted(viewer, &wish) && views_is_best(viewer->views, &viewer->made_of, viewer->wish);
    return viewer->frames > 0 && is_newest(viewer);
}
