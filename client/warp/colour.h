/* SPDX-License-Identifier: MIT */
/* Colours at places of a layer: bilinear if the four texels around a place show one surface, else the colour of
 * the texel that contains it, so that no colour crosses the edge of a surface. */
#ifndef FARLIGHT_CLIENT_WARP_COLOUR_H
#define FARLIGHT_CLIENT_WARP_COLOUR_H

#include "warp/lanes.h"
#include "warp/tree.h"

/* Places beyond the layer get the colour of its border. */
void warp_colour(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                 uint32_t colours[LANES]);

/* Shares of the texels that contain the places. */
void warp_sticking(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                   uint8_t sticking[LANES]);

#endif
