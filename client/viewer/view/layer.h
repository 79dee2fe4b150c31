/* SPDX-License-Identifier: MIT */
/* Sources of views: a picture with depths, and layers of the surfaces that it hides, one texel for each pixel. */
#ifndef FARLIGHT_VIEWER_VIEW_LAYER_H
#define FARLIGHT_VIEWER_VIEW_LAYER_H

#include "viewer/overlay/pixmap.h"

/* A picture with depths, the source of views. */
struct views_key {
    struct pixmap picture; /* includes a margin */
    float *depth;          /* malloc'ed, for each pixel, metres along the view; 0: no surface */
    uint8_t *sticking;     /* malloc'ed, see struct fl_frame; NULL: unknown */
    struct fl_warp_camera camera;
    float depth_step; /* see struct fl_frame */
    float radius;     /* metres around its eye */
    bool is_smeared;  /* see struct fl_warp_key */
    bool is_moving;   /* a picture of motion: smaller, with fewer samples */
    bool is_final;    /* nothing better will arrive for this camera */
    uint64_t came_ns; /* time of arrival */
};

/* A layer of surfaces behind those of the key's picture. */
struct views_layer {
    struct pixmap picture;
    float *depth; /* malloc'ed */
};

void views_layer_finish(struct views_layer *layer);
/* Enlarges a layer to the size of its picture: a layer of half the size, rounded up, has the same axis, and
 * each pixel becomes two by two. False: it has another size, or there is no memory. */
bool views_layer_fit(struct views_layer *layer, int width, int height);

#endif
