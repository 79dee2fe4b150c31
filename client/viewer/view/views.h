/* SPDX-License-Identifier: MIT */
/* Views that are made here: a thread that makes pictures of the newest camera from the newest picture with depths.
 * Its calls are for one other thread, and never wait for a picture. */
#ifndef FARLIGHT_VIEWER_VIEW_VIEWS_H
#define FARLIGHT_VIEWER_VIEW_VIEWS_H

#include "layer.h"
#include "viewer/overlay/pixmap.h"
#include "plan.h"

struct views;

/* What is wanted. */
struct views_wish {
    uint32_t width, height; /* of the picture, all eyes; it comes smaller where its key shows no more */
    struct fl_warp_camera camera;
    float baseline; /* metres between both eyes, which the camera is in the middle of; 0: it is the only one */
    bool over;      /* the left one above the other, not beside it */
    enum fl_warp_holes holes;
    uint64_t frame_ns; /* of the display: at most one view is made in it */
    uint64_t moved_ns; /* when it was moved there */
};

/* Of the last view. */
struct views_made {
    uint64_t wish, key; /* their numbers, counted from 1 */
    struct fl_warp_camera camera;
    uint32_t layers; /* of the key, with which it was made */
    uint64_t moved_ns, key_came_ns;
    enum fl_warp_quality quality;
    struct fl_warp_counts counts;
    uint64_t took_ns, build_ns; /* it, from beginning to end; the work on its key, of all threads */
};

/* The share of its pixels that no picture shows. What the iteration has not found behind others may well be seen.
 */
static inline float views_unseen(const struct views_made *made)
{
    return made->counts.outside + (made->quality == FL_WARP_TREE ? made->counts.behind : 0);
}

struct views *views_create(struct fl_error *error);
void views_destroy(struct views *views);

/* Takes over the picture's pixels and the depths; what came before is outdated. Views go on to be made from a
 * final picture while they are within its radius and no more than PLAN_UNSEEN_LITTLE of them is unseen. */
void views_give_key(struct views *views, struct views_key *key);
/* Of the last key that was given; likewise. One that does not fit it is dropped. That of a picture at rest, which
 * takes longest, waits while views are wanted. */
void views_give_layer(struct views *views, struct views_layer *layer);
void views_forget_keys(struct views *views); /* of a connection that is gone */
/* Views of it are made until another is wanted or none: one for each key; first one in time, then the best.
 * Returns its number. */
uint64_t views_want(struct views *views, const struct views_wish *wish);
void views_want_none(struct views *views);
/* The newest view, once, in exchange for the memory of an older one. False: none since the last call. */
bool views_take(struct views *views, struct pixmap *picture, struct views_made *made);
/* It is of the newest key and the wish of that number, and will not become better. */
bool views_is_best(struct views *views, const struct views_made *made, uint64_t wish);
/* Why no view could be made since the last call; false: there is no reason. */
bool views_take_error(struct views *views, struct fl_warp_error *error);

#endif
