/* SPDX-License-Identifier: MIT */
/* Decisions about views that are made here: whether, of which camera the daemon is asked for a picture, when, and
 * in which quality views are made. Pure: times and places in, decisions out. Monotonic nanoseconds, metres. */
#ifndef FARLIGHT_CLIENT_VIEWER_PLAN_H
#define FARLIGHT_CLIENT_VIEWER_PLAN_H

#include "viewer/camera.h"
#include "warp/warp.h"

#include <stdbool.h>

#define PLAN_FRAME_NS UINT64_C(16666667) /* of a display, where nothing else is known */
#define PLAN_RADIUS_SHARE 0.1            /* of the distance of what is looked at: that of a key view's sphere */
#define PLAN_UNSEEN_MAX 0.03             /* share of a view's pixels */
#define PLAN_KEY_NS UINT64_C(250000000)  /* the oldest picture that views are made from while it moves */
/* Of a view in whose colours mirrors, glass and highlights have this share, or more: as often as pictures of
 * motion come at most. What sticks is wrong from the first step of the eye on, and by no stated bound. */
#define PLAN_STICKING_KEY_NS UINT64_C(100000000)
#define PLAN_STICKING_FULL 0.5

/* ---- whether ---- */

enum local_views { LOCAL_OFF, LOCAL_AUTO, LOCAL_ON, LOCAL_VIEWS_COUNT };
extern const char *const local_views_names[LOCAL_VIEWS_COUNT + 1]; /* ends with NULL */

/* LOCAL_AUTO; all zero at first. */
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
/* Where the camera will be `ahead_ns` after `now_ns` (250 ms at most) if it goes on as in the last tenth of a
 * second; with the lens and the distance of the newest one. No camera was added: *camera stays. */
void plan_motion_predict(const struct plan_motion *motion, uint64_t now_ns, uint64_t ahead_ns,
                         struct viewer_camera *camera);

/* ---- when ---- */

struct plan_need {
    uint64_t since_asked_ns; /* since the daemon was told of a camera */
    double gone;             /* of the eye, from the one that was asked for last */
    double radius;
    double unseen;   /* share of the last view's pixels */
    double sticking; /* likewise */
};

/* Whether a new picture is needed while it moves: else the link is spared. It is needed after PLAN_KEY_NS, when
 * the eye has gone half of the radius, and when more than PLAN_UNSEEN_MAX is unseen; both the first come sooner,
 * by the same factor, the more sticks: at PLAN_STICKING_FULL after PLAN_STICKING_KEY_NS. */
bool plan_is_due(const struct plan_need *need);

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
