/* SPDX-License-Identifier: MIT */
/* Decisions about views that are made here: whether, of which camera the daemon is asked for a picture, and
 * in which quality views are made. Pure: times and places in, decisions out. Monotonic nanoseconds, metres. */
#ifndef FARLIGHT_VIEWER_VIEW_PLAN_H
#define FARLIGHT_VIEWER_VIEW_PLAN_H

#include "viewer/input/camera.h"
#include "warp/warp.h"

#include <stdbool.h>

#define PLAN_FRAME_NS UINT64_C(16666667) /* of a display, where nothing else is known */
#define PLAN_RADIUS_SHARE 0.1            /* of the distance of what is looked at: that of a key view's sphere */
/* A view of which a larger share of pixels is unseen is not shown: the daemon's own picture is nearer to the
 * truth. */
#define PLAN_UNSEEN_MAX 0.1
/* Views are made from a finished picture up to this share, though newer ones of motion are there: those are
 * smaller and have fewer samples. */
#define PLAN_UNSEEN_LITTLE 0.03

/* ---- whether ---- */

/* For LOCAL_AUTO (settings.h); all zero at first. */
struct plan_switch {
    bool on;
    uint64_t fast_ns; /* since then pictures come soon enough without; 0: they do not */
};

/* On where a picture takes more than a display's frame from camera to client, off where it has taken clearly less
 * for a while. `round_s` of the last pictures; true: it changed. */
bool plan_switch(struct plan_switch *plan, double round_s, uint64_t now_ns);

/* ---- of which camera ---- */

#define PLAN_STEPS 64u

/* Where the camera has been lately. All zero at first. */
struct plan_motion {
    struct {
        struct viewer_camera camera;
        uint64_t at_ns;
    } steps[PLAN_STEPS]; /* a ring */
    size_t next, count;
};

void plan_motion_add(struct plan_motion *motion, const struct viewer_camera *camera, uint64_t at_ns);

/* How the last two pictures of motion came. All zero at first. */
struct plan_pace {
    /* From a camera to its picture, from picture to picture; 0: unknown. A single late one says nothing of the
     * next. */
    uint64_t rounds_ns[2], intervals_ns[2];
    uint64_t came_ns; /* the last one */
};

/* A picture of a camera that was sent then has come. */
void plan_pace_add(struct plan_pace *pace, uint64_t sent_ns, uint64_t came_ns);
/* From sending a camera to the middle of the time in which views are made of its picture. */
uint64_t plan_pace_ahead_ns(const struct plan_pace *pace);

/* Where the camera will be `ahead_ns` after `now_ns` (400 ms at most) if it goes on as in the last tenth of a
 * second: the eye or what is looked at, whichever has moved less, goes straight on, and the other one swings about
 * it. With the lens of the newest one. No camera was added: *camera stays. */
void plan_motion_predict(const struct plan_motion *motion, uint64_t now_ns, uint64_t ahead_ns,
                         struct viewer_camera *camera);

/* ---- in which quality ---- */

struct plan_rung {
    enum fl_warp_quality quality;
    double slow;        /* frames that the last views in a row have taken too long */
    uint64_t pause_ns;  /* before the tree is tried again; doubles when that was in vain */
    uint64_t retry_ns;  /* when it is tried */
    uint64_t steady_ns; /* since when the tree is used */
};

/* Of a view of that quality that was just made in `took_ns`, for frames of `frame_ns`. */
void plan_rung(struct plan_rung *rung, uint64_t took_ns, uint64_t frame_ns, uint64_t now_ns);

#endif
