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
#define LAYER_BIT_UNKNOWN 128u
#define LAYER_BITS_SEEN 0xffu /* the beauty, and what describes first surfaces */
#define LAYER_BIT_DIFFUSE_DIRECT (1u << 16)
#define LAYER_BIT_DIFFUSE_INDIRECT (1u << 17)
#define LAYER_BIT_SPECULAR_DIRECT (1u << 18)
#define LAYER_BIT_SPECULAR_INDIRECT (1u << 19)
#define LAYER_BIT_TRANSMISSION (1u << 20)
#define LAYER_BIT_EMISSION (1u << 21)
#define LAYER_BIT_BACKGROUND (1u << 22)
#define LAYER_BITS_LIGHT (0x7fu << 16) /* parts of the beauty: render/light_layers.glsl */
/* Of an attachment, which no layer beside the beauty goes with: no LAYER. */
#define LAYER_BIT_STICKING (1u << 28)

/* How light reaches the eye: directly, if the first surface sends on what a light has sent to it. */
#define LIGHT_DIRECT 0.0f
#define LIGHT_INDIRECT 1.0f
#define LIGHT_TRANSMITTED 2.0f
#define LIGHT_EMITTED 3.0f
#define LIGHT_BEHIND 4.0f

/* Storage buffer: a plane for each layer of the frame but the beauty, in their order; in it a vec4 for each sample
 * of the slice. With layers of light another: what the first surface did with the light of the sample's path, rgb
 * the share that it mirrored, w 1: it let it through. */
#define BIND_LAYER_SUMS BIND_PASS_0

#endif
