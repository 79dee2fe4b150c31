/* SPDX-License-Identifier: MIT */
/* What views are made from: a picture with depths, and layers of what it hides, one texel for each of its pixels.
 */
#ifndef FARLIGHT_VIEWER_VIEW_LAYER_H
#define FARLIGHT_VIEWER_VIEW_LAYER_H

#include "viewer/overlay/pixmap.h"

/* What views are made from. */
struct views_key {
    struct pixmap picture; /* a margin included */
    float *depth;          /* malloc'ed, as many, metres along the view; 0: nothing is there */
    uint8_t *sticking;     /* malloc'ed, as of struct fl_frame; NULL: nothing is known of it */
    struct fl_warp_camera camera;
    float depth_step; /* as of struct fl_frame */
    float radius;     /* metres round its eye */
    bool is_smeared;  /* as of struct fl_warp_key */
    bool is_moving;   /* of motion: smaller, with fewer samples */
    bool is_final;    /* nothing better of this camera will come */
    uint64_t came_ns; /* when it had arrived */
};

/* What surfaces hide from the camera of a key. */
struct views_layer {
    struct pixmap picture;
    float *depth; /* malloc'ed */
};

void views_layer_finish(struct views_layer *layer);
/* To the size of its picture: one of half the size, rounded up, has the same axis, and each pixel becomes two by
 * two. False: it is of another size, or there is no memory. */
bool views_layer_fit(struct views_layer *layer, int width, int height);

#endif
