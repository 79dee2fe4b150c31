/* SPDX-License-Identifier: MIT */
/* Layers of a picture beside its light, in a slice. */
#ifndef FARLIGHT_SHARED_LAYERS_H
#define FARLIGHT_SHARED_LAYERS_H
#include "shared/path.h"

/* Sets of layers: 1 << LAYER_BEAUTY and so on (protocol/words.def). */
#define LAYER_BIT_BEAUTY 1u
#define LAYER_BIT_ALBEDO 2u
#define LAYER_BIT_NORMAL 4u
#define LAYER_BIT_DEPTH 8u
#define LAYER_BIT_POSITION 16u
#define LAYER_BIT_AO 32u
#define LAYER_BIT_ID 64u
#define LAYER_BIT_UNKNOWN 128u /* the last: its plane comes behind all others */
/* Of an attachment, which no layer beside the beauty goes with: no LAYER. */
#define LAYER_BIT_STICKING 256u

/* Storage buffer: a plane for each layer of the frame but the beauty, in their order; in it a vec4 for each sample
 * of the slice. */
#define BIND_LAYER_SUMS BIND_PASS_0

#endif
