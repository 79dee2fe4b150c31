/* SPDX-License-Identifier: MIT */
/* Hits and intersections: answers to rays of closest-hit waves. */
#ifndef FARLIGHT_SHARED_HIT_H
#define FARLIGHT_SHARED_HIT_H
#include "shared/types.h"

/* Answer to a ray of a closest-hit wave. Exact tracers make it from triangle and barycentrics, sampled ones
 * from a stored surface sample. */
struct hit {
    float distance;        /* in lengths of the direction; < 0: the ray left the scene */
    uint material;         /* bits 0..23 index into the materials; then HIT_* flags */
    uint primitive;        /* scene-wide triangle or sphere number (see geometry.h), HIT_NO_PRIMITIVE if sampled */
    uint instance;         /* index into the instances, HIT_NO_PRIMITIVE: the discs */
    uvec4 uv01_or_sample;  /* bits of texture coordinate sets 0 and 1, u0 v0 u1 v1 */
    uint normal_geometric; /* octahedral, 2 x 16 bit snorm, world space, on the outer side (winding) */
    uint normal_shading;   /* same encoding; interpolated, in the same hemisphere as the geometric one */
    uint tangent;          /* same encoding with 15 bits for y; lowest bit: handedness is negative */
    uint colour; /* vertex colour, or colour stored by a sampled tracer, unorm 4x8: square roots of linear
                    light, alpha */
};
SHARED_SIZE(hit, 48)
#define HIT_TEXELS 3u /* RGBA32UI */
/* An intersection is a hit with only its first four words: distance (< 0: a miss), HIT_UNKNOWN and HIT_LAYER
 * bits or 0, primitive (the number of a disc; HIT_NO_PRIMITIVE: a miss), instance. */

#define HIT_MATERIAL_MASK 0x00ffffffu
#define HIT_BACK_FACE 0x01000000u /* the ray came from inside */
#define HIT_HAS_TANGENT 0x02000000u
/* A stored sample: `uv01_or_sample` has its four words of `surface` (shared/surface_sample.h) in place of
 * texture coordinates; textures are applied already. The words are no floats: a device may change bits that are
 * carried in one, flush them to zero or make one NaN of another. `primitive` and `instance` are
 * HIT_NO_PRIMITIVE, `colour` is white. */
#define HIT_SAMPLED 0x04000000u
/* Bits of a tracer whose structure is the visible surfaces of a view: the ray reached a place that the view
 * does not see, and the answer is a guess from where it continued behind the last visible surface; and the
 * layer of the view that has the surface, from 1 on. */
#define HIT_UNKNOWN 0x08000000u
#define HIT_LAYER_SHIFT 28u
#define HIT_LAYER_MASK 0x30000000u
/* A ray of the eye that meets only the ground (server/render/passes/ground/ground.h); the material is the default
 * one, primitive and instance are HIT_NO_PRIMITIVE. */
#define HIT_GROUND 0x40000000u
#define HIT_NO_PRIMITIVE 0xffffffffu

#endif
