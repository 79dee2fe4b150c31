/* SPDX-License-Identifier: MIT */
/* Paths and their children: the state of rays between the waves of a slice. */
#ifndef FARLIGHT_SHARED_PATH_H
#define FARLIGHT_SHARED_PATH_H
#include "shared/bindings.h"
#include "shared/types.h"

/* Path of ray k of a closest-hit wave: its state besides the ray itself.
 *
 * A slice holds one sample of each of its pixels, or several (frame.sample_shift), those of a pixel side by side.
 * The paths of one sample lie side by side in their wave, in an order that never changes: children take their
 * places by a prefix sum over their parents, never by an atomic counter. So the pass that sums radiance assigns
 * each sample to one invocation, which adds in that order; samples are added to their pixel in their order, too,
 * and a picture is the same, to the bit, whatever its slices. Where a sample has at most one path, waves may be
 * sorted by direction (compact_sample.comp); else they are in the order of their samples. */
struct path {
    float weight_r, weight_g, weight_b; /* share of this ray's radiance that reaches the eye */
    uint sample_slot;                   /* in the slice: pixel times the number of samples together, plus sample */
    float cone_width, cone_spread;      /* at the origin, and per metre: common/cone.glsl */
    uint flags;                         /* PATH_* */
    float time;                         /* 0: the shutter opens .. 1: it closes */
    /* path and distributed: weights of lights that the ray hits, as shares of their radiance */
    /* path: number of the light that it hits, plus 1; 0: none counts. With emitters PATH_LIGHT_BITS, and above
     * them the code of how its origin has sampled these: PATH_RATIO_*. distributed: below that code the normal
     * with which its origin has */
    uint light_number;
    float light_distance; /* its distance, if nothing is hit before */
    float light_share, environment_share;
};
SHARED_SIZE(path, 48)
#define PATH_TEXELS 3 /* RGBA32UI */
#define PATH_BOUNCES_MASK 0x3fu
#define PATH_STRAIGHT 0x40u /* only blended surfaces lie before it: the path counts for the picture's alpha */
#define PATH_ASKED 0x80u    /* path: its origin has sampled lights and environment */
#define PATH_COVERED 0x100u /* path: such an origin has sampled that light already, through the current glass */
/* path and distributed, bits 9..11: maximum roughness of the surfaces that sent it on, in steps, rounded down.
 * 0: all were smooth or nearly so. */
#define PATH_STEP_SHIFT 9u
#define PATH_STEP_MASK 0xe00u
#define PATH_STEPS 7.0f
#define PATH_STEPS_ROUGHNESS 0.55f /* roughness of the last step: alpha is 0.3 */
/* Bits 16..31: distributed: that roughness, 65535: 1. */
#define PATH_ROUGHNESS_SHIFT 16u
/* Bits 12..31: path, with emitters: normal with which its origin has sampled them, octahedral. */
#define PATH_NORMAL_SHIFT 12u
#define PATH_NORMAL_BITS 10u /* bits per coordinate; signed */
#define PATH_NORMAL_MAX 511.0f
#define PATH_LIGHT_BITS 20u
#define PATH_LIGHT_MASK 0xfffffu
/* Ratio of the probability with which its origin samples emitters, not other lights, to the density with which
 * it was scattered: steps of the logarithm to the base 2, PATH_RATIO_ONE is 1. 0: everything that it hits
 * counts. Both ways of finding an emitter round it, so their weights add up to 1. */
#define PATH_RATIO_STEPS 64.0f
#define PATH_RATIO_ONE 2048.0f
#define PATH_RATIO_MAX 4095.0f

/* Minimum weight with which a path of whitted, raycast and ao continues: a third of a step of an 8-bit picture. */
#define PATH_WEIGHT_MIN (1.0f / 1024.0f)
/* Offset of a ray's start from the surface, as a share of its origin's coordinates (and of the distance to it):
 * some hundred times the rounding error. */
#define PATH_OFFSET (1.0f / 65536.0f)

/* A ray of the next wave in its parent's place, before it is moved to its own. */
struct child {
    vec4 origin_t_min;
    vec4 direction_t_max;
    float weight_r, weight_g, weight_b;
    uint sample_slot;
    float cone_width, cone_spread;
    uint flags;
    float time;
    uint light_number;
    float light_distance, light_share, environment_share;
};
SHARED_SIZE(child, 80)
#define CHILD_TEXELS 5  /* RGBA32UI */
#define CHILDREN_MAX 3u /* whitted: straight on, reflected, refracted */
/* A hit's children and live shadow rays in one word: number of children, signs of the last one's direction (one
 * of OCTANTS), number of shadow rays. */
#define CHILDREN_MASK 3u
#define CHILD_OCTANT_SHIFT 2u
#define SHADOW_RAYS_SHIFT 5u
#define OCTANTS 8u
#define COMPACT_BLOCK 16u /* paths whose hits, and then children, are counted together */
/* Invocations of the single group that scans the counts: every device has as many. */
#define COMPACT_SCAN_SIZE 1024

/* Values of the visibility buffer's first word: an instance + 1, or one of these. */
#define VISIBLE_NOTHING 0u
#define VISIBLE_DISC 0xffffffffu

#define HIT_PLACE_NONE 0xffffffffu /* replaces a list index: the path left the scene */

/* Storage buffers of the passes of a wave. */
#define BIND_PATHS BIND_PASS_0
#define BIND_RADIANCE BIND_PASS_1         /* vec4 per path: its contribution to the pixel, coverage in w */
#define BIND_CHILDREN BIND_PASS_2         /* struct child, the integrator's number per hit */
#define BIND_CHILD_COUNTS BIND_PASS_3     /* uint per hit: CHILDREN_MASK .. */
#define BIND_LIGHT_SAMPLES BIND_PASS_4    /* vec4 per shadow ray: its contribution if nothing is in the way */
#define BIND_SHADOW_RAYS BIND_VISIBILITY  /* struct ray; no pass both makes them and reads the answers */
#define BIND_HIT_LIST BIND_WAVE           /* uint per hit: its path; in order */
#define BIND_HIT_PLACES BIND_CHILD_COUNTS /* uint per path: its place in the list; where children are unused */
#define BIND_SLICE_SUMS BIND_PASS_2       /* vec4 per sample of the slice; where children are unused */
/* Uvec2 per block of COMPACT_BLOCK, of a sorted wave OCTANTS times as many; where light samples are not used. */
#define BIND_BLOCK_OFFSETS BIND_PASS_4
#define BIND_ACCUMULATION BIND_PASS_0 /* vec4 per pixel slot of the picture's band; sum of the samples */
#define BIND_RESOLVED BIND_PASS_1     /* pixels of the output's format, rows from the top */
/* Buffers of pictures whose tiles stop one by one, see server/render/picture/noise.h. */
#define BIND_HALVES BIND_PASS_1       /* vec4 like BIND_ACCUMULATION */
#define BIND_TILE_ERRORS BIND_PASS_2  /* float per tile */
#define TILE_SLOTS 64u                /* 8 x 8 pixels, consecutive in the order of slots */
#define UNIT_TILE_SAMPLES UNIT_PASS_1 /* uint per tile: samples where it has stopped; 0: it continues */

#endif
