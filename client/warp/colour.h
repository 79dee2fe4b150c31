/* SPDX-License-Identifier: MIT */
/* Colours of places in a layer: bilinear where the four texels round one show one surface, else that of the texel
 * that it lies in, so that no colour crosses the edge of a surface. */
#ifndef FARLIGHT_CLIENT_WARP_COLOUR_H
#define FARLIGHT_CLIENT_WARP_COLOUR_H

#include "warp/lanes.h"
#include "warp/tree.h"

/* Beyond the layer: its border. */
void warp_colour(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                 uint32_t colours[LANES]);

/* Of the texel that each place lies in. */
void warp_sticking(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                   uint8_t sticking[LANES]);

#endif
