/* SPDX-License-Identifier: MIT */
/* Layers of what a picture hides, as views are made from them: one texel for each pixel of the picture. */
#ifndef FARLIGHT_VIEWER_VIEW_LAYER_H
#define FARLIGHT_VIEWER_VIEW_LAYER_H

#include "viewer/overlay/pixmap.h"

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
