/* SPDX-License-Identifier: MIT */
/* Layers of a picture besides its light, in a slice. */
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
#define LAYER_BITS_SEEN 0xffu /* the beauty, and descriptions of first surfaces */
#define LAYER_BITS_CRYPTO_OBJECT 0x0700u
#define LAYER_BITS_CRYPTO_MATERIAL 0x3800u
#define LAYER_BITS_CRYPTO (LAYER_BITS_CRYPTO_OBJECT | LAYER_BITS_CRYPTO_MATERIAL)
#define LAYER_BIT_MOTION 0x4000u
#define LAYER_BIT_DIFFUSE_DIRECT (1u << 16)
#define LAYER_BIT_DIFFUSE_INDIRECT (1u << 17)
#define LAYER_BIT_SPECULAR_DIRECT (1u << 18)
#define LAYER_BIT_SPECULAR_INDIRECT (1u << 19)
#define LAYER_BIT_TRANSMISSION (1u << 20)
#define LAYER_BIT_EMISSION (1u << 21)
#define LAYER_BIT_BACKGROUND (1u << 22)
#define LAYER_BITS_LIGHT_PARTS (0x7fu << 16) /* parts of the beauty: render/light_layers.glsl */
#define LAYER_BIT_LIGHT_REST (1u << 23)
/* Parts of the beauty by the source of light: the rest, then groups from 1 on. */
#define LAYER_BITS_LIGHT_GROUPS (0xffu << 23)
#define LAYER_BITS_LIGHT (LAYER_BITS_LIGHT_PARTS | LAYER_BITS_LIGHT_GROUPS)
#define LAYER_BITS_ALL (LAYER_BITS_SEEN | LAYER_BITS_CRYPTO | LAYER_BIT_MOTION | LAYER_BITS_LIGHT)
/* Bit of an attachment that excludes all layers but the beauty: no LAYER. */
#define LAYER_BIT_STICKING (1u << 31)

/* Ways in which light reaches the eye: direct, if the first surface sends on light from a light source. */
#define LIGHT_DIRECT 0.0f
#define LIGHT_INDIRECT 1.0f
#define LIGHT_TRANSMITTED 2.0f
#define LIGHT_EMITTED 3.0f
#define LIGHT_BEHIND 4.0f
#define LIGHT_KINDS 8.0f /* kind plus this times a light group: one number */

/* Storage buffer: a plane for each layer of the frame except the beauty and Cryptomatte's, in their order; a
 * vec4 per sample of the slice in each. With layers of light there is another plane: what the first surface did
 * with the light of the sample's path, rgb the share that it mirrored, w 1: it let it pass. */
#define BIND_LAYER_SUMS BIND_PASS_0

/* Storage buffer: the surfaces that cover each sample of the slice, for Cryptomatte: a plane for each wave of
 * rays that go straight on, a uvec4 per sample in each: instance of a hit, material with its HIT bits, bits of
 * the share, 0. Share 0: nothing. */
#define BIND_COVERS BIND_PASS_4
#define COVERS_MAX 8u   /* waves; behind this number of blended surfaces little light is left */
#define CRYPTO_PLANES 3 /* per kind, with two identifiers each */

/* Places of an instance a frame earlier and a frame later; a storage buffer, in the order of the instances. The
 * vertices of its geometry, where that deforms, lie in another: three floats each, those of the previous frame,
 * then those of the next one. */
struct move {
    vec4 earlier[3]; /* rows of world_from_object */
    vec4 later[3];
    uint first_vertex; /* first vertex in that buffer, plus 1; 0: the geometry does not deform */
    uint pad0, pad1, pad2;
};
SHARED_SIZE(move, 112)
#define BIND_MOVES BIND_PASS_1
#define BIND_MOVED_VERTICES BIND_PASS_2

#endif
