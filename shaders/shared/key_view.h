/* SPDX-License-Identifier: MIT */
/* Pictures of the layers of a key view, from which pictures for other eyes are made. */
#ifndef FARLIGHT_SHARED_KEY_VIEW_H
#define FARLIGHT_SHARED_KEY_VIEW_H
#include "shared/path.h"

/* Buffer of a layer: a vec4 per texel, row by row from the uppermost: radiance, and the distance of the surface
 * along the view, metres. Below 0: the layer holds nothing there; KEY_INFINITE, in the first: the environment. */
#define KEY_LAYERS_MAX 3
#define KEY_NOTHING (-1.0f)
#define KEY_INFINITE 0.0f

#define BIND_KEY_LAYER BIND_PASS_1 /* keep_layer.comp */
/* In keep_layer.comp: sums of LAYER_DEPTH; those of the beauty are BIND_ACCUMULATION. */
#define BIND_KEY_DEPTHS BIND_PASS_2
#define BIND_KEY_COUNTS BIND_PASS_3 /* gather_views.comp: one uint, the samples that no layer shows */
/* In gather_views.comp: a uint per texel, layer after layer, 1 where an eye reads it. */
#define BIND_KEY_MARKS BIND_PASS_1
/* Passes over those texels of a layer. Its picture has only the tiles of the layer that contain some, in their
 * order; tiles beyond the layer fill the last row of tiles. */
#define UNIT_KEY_MARKS UNIT_PASS_1
#define UNIT_KEY_TILES UNIT_RAY_TILES
#define UNIT_KEY_LAYER_0 UNIT_TRACER_1
#define UNIT_KEY_LAYER_1 UNIT_TRACER_2
#define UNIT_KEY_LAYER_2 UNIT_TRACER_3

#endif
