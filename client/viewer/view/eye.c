/* SPDX-License-Identifier: MIT */
/* Camera of the view: jumps, glides, and the camera of the scene that it follows. */
#include "eye.h"
#include "view.h"
#include "protocol/common/clock.h"

#define GLIDE_NS 350000000ull

bool view_follows(const struct view *view)
{
    return view->eye.followed != 0 && view->eye.tour.clip != TOUR_NONE && view->eye.glide_begin_ns == 0;
}

uint32_t view_home_node(const struct view *view)
{
    return view->render.camera.camera_path == PROTOCOL_CAMERA_NODE ? view->render.camera.camera_node : 0;
}

void view_go(struct view *view, const struct viewer_camera *camera, uint32_t node)
{
    struct view_eye *eye = &view->eye;
    eye->followed = node;
    if (!eye->has_camera || view->options->jumps) {
        eye->camera = *camera;
        eye->glide_begin_ns = 0;
        view->local.motion = (struct plan_motion){0}; /* a jump has no velocity */
    } else {
        eye->glide_from = eye->camera;
        eye->glide_to = *camera;
        eye->glide_begin_ns = monotonic_now_ns();
    }
    eye->has_camera = true;
    view->sent.must_send_camera = true;
    eye->moved_ns = monotonic_now_ns();
}

bool view_glide(struct view *view, uint64_t now_ns)
{
    struct view_eye *eye = &view->eye;
    if (eye->glide_begin_ns == 0)
        return false;
    const double share = (double)(now_ns - eye->glide_begin_ns) / GLIDE_NS;
    camera_between(&eye->glide_from, &eye->glide_to, share < 1 ? share : 1, &eye->camera);
    eye->glide_begin_ns = share < 1 ? eye->glide_begin_ns : 0;
    return true;
}
