/* SPDX-License-Identifier: MIT */
/* Decisions about views made in the client: whether to make them, the camera of the daemon's next picture, and
 * the quality of views. Pure: times and places in, decisions out. Monotonic nanoseconds, metres. */
#ifndef FARLIGHT_VIEWER_VIEW_PLAN_H
#define FARLIGHT_VIEWER_VIEW_PLAN_H

#include "viewer/input/camera.h"
#include "warp/warp.h"

#include <stdbool.h>

#define PLAN_FRAME_NS UINT64_C(16666667) /* duration of a display frame, if unknown */
#define PLAN_RADIUS_SHARE 0.1            /* radius of a key view's sphere, as a share of the target's distance */
/* Maximum share of unseen pixels of a shown view; beyond it the daemon's own picture is closer to the truth. */
#define PLAN_UNSEEN_MAX 0.1
/* Maximum share of unseen pixels up to which views are made from a finished picture, although newer ones of
 * motion exist: those are smaller and have fewer samples. */
#define PLAN_UNSEEN_LITTLE 0.03

/* ---- decision to make views ---- */

/* For LOCAL_AUTO (settings.h); all zero at first. */
struct plan_switch {
    bool on;
    uint64_t fast_ns; /* time since which pictures are fast enough without views; 0: they are not */
};

/* Switches on if a picture takes more than a display frame from camera to client, and off if it has taken
 * clearly less for a while. `round_s` is this time of the last pictures; true: the state changed. */
bool plan_switch(struct plan_switch *plan, double round_s, uint64_t now_ns);

/* ---- of which camera ---- */

#define PLAN_STEPS 64u

/* Recent cameras; initially zero. */
struct plan_motion {
    struct {
        struct viewer_camera camera;
        uint64_t at_ns;
    } steps[PLAN_STEPS]; /* a ring */
    size_t next, count;
};

void plan_motion_add(struct plan_motion *motion, const struct viewer_camera *camera, uint64_t at_ns);

/* Timing of the last two pictures of motion; initially zero. */
struct plan_pace {
    /* From a camera to its picture, and from picture to picture; 0: unknown. Two values, because a single late
     * picture does not predict the next. */
    uint64_t rounds_ns[2], intervals_ns[2];
    uint64_t came_ns; /* time of the last one */
};

/* Adds a picture whose camera was sent at `sent_ns`. */
void plan_pace_add(struct plan_pace *pace, uint64_t sent_ns, uint64_t came_ns);
/* Time from sending a camera to the middle of the period in which views are made from its picture. */
uint64_t plan_pace_ahead_ns(const struct plan_pace *pace);

/* Predicts the camera `ahead_ns` after `now_ns` (at most 400 ms) by continuing the last tenth of a second: the
 * eye or the target, whichever has moved less, moves straight on, and the other one swings about it. The lens
 * is the newest one. Without cameras *camera is unchanged. */
void plan_motion_predict(const struct plan_motion *motion, uint64_t now_ns, uint64_t ahead_ns,
                         struct viewer_camera *camera);

/* ---- in which quality ---- */

struct plan_rung {
    enum fl_warp_quality quality;
    double slow;        /* frames by which the last consecutive views were too slow */
    uint64_t pause_ns;  /* pause before the tree is tried again; doubles after a failure */
    uint64_t retry_ns;  /* time of the next attempt */
    uint64_t steady_ns; /* time since which the tree is used */
};

/* Adjusts the quality after a view that took `took_ns`, for display frames of `frame_ns`. */
void plan_rung(struct plan_rung *rung, uint64_t took_ns, uint64_t frame_ns, uint64_t now_ns);

#endif
