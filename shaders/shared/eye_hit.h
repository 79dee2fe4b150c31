/* SPDX-License-Identifier: MIT */
/* clang-format off */
/* Intersection of an eye's ray with a layer of a view that is a picture of the scene (server/trace/tracer.h): one
 * RGBA32F texel per sample.
 *   x, y  texels of the layer, from its top left
 *   z     1 / distance along the view from its eye, 1 / metres; in an orthographic view the distance
 *   w     a number: EYE_LAYER times the layer from 1 on, 0: none was met; plus EYE_UNKNOWN where the view does not show
 *         what the ray meets, so that the rest is a guess; or EYE_DEAD */
/* clang-format on */
#ifndef FARLIGHT_SHARED_EYE_HIT_H
#define FARLIGHT_SHARED_EYE_HIT_H
#include "shared/types.h"

#define EYE_LAYER 1u
#define EYE_LAYER_MASK 3u
#define EYE_UNKNOWN 4u
#define EYE_DEAD 8u /* the pixel is beyond the picture's edge */

#endif
