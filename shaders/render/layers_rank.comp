// SPDX-License-Identifier: MIT
// Adds the objects that cover the samples of a slice to the ranks of their pixels, for Cryptomatte: two identifiers and
// their sums in each plane, the largest first. Each pixel is one invocation's, which adds in the order of its samples; so
// ranks do not depend on the division into slices. An object without a free rank is dropped: the others stay true.
// Defines: PLANES the number of planes, up to CRYPTO_PLANES; MATERIALS identifiers of materials, else of nodes;
// HAS_TILE_SAMPLES tiles may have stopped, and get no more samples (server/render/picture/noise.h).

#include "shared/hit.h"
#include "shared/layers.h"
#include "common/dispatch.glsl"
#include "common/geometry.glsl"
#include "render/wave.glsl"

#ifndef PLANES
#define PLANES CRYPTO_PLANES
#endif

layout(local_size_x = 64) in;

uniform uint slot_count, sample_shift, cover_waves;
uniform uint first_slot; // first slot of the slice, in its band

#ifdef HAS_TILE_SAMPLES
uniform uint first_picture_slot; // first slot of the slice, in the picture
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

layout(std430, binding = BIND_COVERS) readonly buffer cover_block { uvec4 covers[]; };
layout(std430, binding = BIND_ACCUMULATION) buffer plane_block_0 { vec4 plane_0[]; };
#if PLANES > 1
layout(std430, binding = BIND_PASS_1) buffer plane_block_1 { vec4 plane_1[]; };
#endif
#if PLANES > 2
layout(std430, binding = BIND_PASS_2) buffer plane_block_2 { vec4 plane_2[]; };
#endif

const int RANKS = 2 * PLANES;
vec2 ranks[RANKS]; // identifier, and its sum; 0: free

void load(uint place)
{
    vec4 two = plane_0[place];
    ranks[0] = two.xy;
    ranks[1] = two.zw;
#if PLANES > 1
    two = plane_1[place];
    ranks[2] = two.xy;
    ranks[3] = two.zw;
#endif
#if PLANES > 2
    two = plane_2[place];
    ranks[4] = two.xy;
    ranks[5] = two.zw;
#endif
}

void store(uint place)
{
    plane_0[place] = vec4(ranks[0], ranks[1]);
#if PLANES > 1
    plane_1[place] = vec4(ranks[2], ranks[3]);
#endif
#if PLANES > 2
    plane_2[place] = vec4(ranks[4], ranks[5]);
#endif
}

uint identifier_of(uvec4 cover)
{
#ifdef MATERIALS
    return material_at(cover.y & HIT_MATERIAL_MASK).id;
#else
    return cover.x == HIT_NO_PRIMITIVE ? 0u : instance_at(cover.x).node;
#endif
}

void add(float identifier, float share)
{
    int rank = 0;
    while (rank < RANKS && ranks[rank].y > 0.0 && ranks[rank].x != identifier)
        rank++;
    if (rank == RANKS)
        return;
    ranks[rank] = vec2(identifier, ranks[rank].y + share);
    for (; rank > 0 && ranks[rank].y > ranks[rank - 1].y; rank--) {
        vec2 other = ranks[rank - 1];
        ranks[rank - 1] = ranks[rank];
        ranks[rank] = other;
    }
}

void main()
{
    uint k = item_index();
    if (k >= slot_count || wave.stopped != 0u)
        return;
#ifdef HAS_TILE_SAMPLES
    if (texelFetch(tile_samples, int((first_picture_slot + k) / TILE_SLOTS)).x != 0u)
        return;
#endif
    load(first_slot + k);
    uint end = (k + 1u) << sample_shift;
    for (uint i = k << sample_shift; i < end; i++) {
        for (uint n = 0u; n < cover_waves; n++) {
            uvec4 cover = covers[n * (slot_count << sample_shift) + i];
            float share = uintBitsToFloat(cover.z);
            if (share > 0.0)
                add(float(identifier_of(cover)), share);
        }
    }
    store(first_slot + k);
}
