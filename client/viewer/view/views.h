/* SPDX-License-Identifier: MIT */
/* Views made in the client: a thread makes pictures of the newest camera from the newest picture with depths.
 * All calls come from one other thread, and never wait for a picture. */
#ifndef FARLIGHT_VIEWER_VIEW_VIEWS_H
#define FARLIGHT_VIEWER_VIEW_VIEWS_H

#include "layer.h"
#include "viewer/overlay/pixmap.h"
#include "plan.h"

struct views;

/* A request for views. */
struct views_request {
    uint32_t width, height; /* size of the whole picture, all eyes; made smaller if its key has no more detail */
    struct fl_warp_camera camera;
    float baseline; /* metres between both eyes, around the camera; 0: a single eye */
    bool over;      /* the left eye is above the right one, not beside it */
    enum fl_warp_holes holes;
    uint64_t frame_ns; /* display frame, in which at most one view is made */
    uint64_t moved_ns; /* time of the camera's motion */
};

/* The last view. */
struct views_made {
    uint64_t request, key; /* numbers, counted from 1 */
    struct fl_warp_camera camera;
    uint32_t layers; /* layers of the key that it was made with */
    uint64_t moved_ns, key_came_ns;
    enum fl_warp_quality quality;
    struct fl_warp_counts counts;
    uint64_t took_ns, build_ns; /* duration of the view; processor time of all threads on its key */
};

/* The share of pixels that no picture shows. Pixels that the iteration has not found behind others may well be
 * visible. */
static inline float views_unseen(const struct views_made *made)
{
    return made->counts.outside + (made->quality == FL_WARP_TREE ? made->counts.behind : 0);
}

struct views *views_create(struct fl_error *error);
void views_destroy(struct views *views);

/* Takes over the picture's pixels and depths, which replace earlier ones. Views continue to be made from a
 * final picture while they are within its radius and at most PLAN_UNSEEN_LITTLE of them is unseen. */
void views_give_key(struct views *views, struct views_key *key);
/* Takes over a layer of the last key; one that does not fit is dropped. The layer of a picture at rest, which
 * takes longest, waits while views are made. */
void views_give_layer(struct views *views, struct views_layer *layer);
void views_forget_keys(struct views *views); /* drops the keys of a lost connection */
/* Requests views until the next call or views_stop: one for each key, first one in time, then the best. Returns
 * the request's number. */
uint64_t views_start(struct views *views, const struct views_request *request);
void views_stop(struct views *views);
/* Takes the newest view, once, in exchange for the memory of an older one. False: none since the last call. */
bool views_take(struct views *views, struct pixmap *picture, struct views_made *made);
/* True if the view has the newest key and this request, and will not improve. */
bool views_is_best(struct views *views, const struct views_made *made, uint64_t request);
/* Takes the reason of a failure since the last call; false: there was none. */
bool views_take_error(struct views *views, struct fl_warp_error *error);

#endif
