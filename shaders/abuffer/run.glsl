// SPDX-License-Identifier: MIT
// A texel's samples during the sort: depth, id, and bits of ABUFFER_NODE_*, which the last pass replaces by the sample's
// own.
#include "abuffer/layout.h"
#include "shared/bindings.h"

layout(binding = IMAGE_ABUFFER_SAMPLES, rg32ui) uniform uimageBuffer samples;
layout(binding = IMAGE_ABUFFER_IDS, r32ui) uniform uimageBuffer ids;

struct run {
    uint first, count;
};

uvec3 load(run r, uint i)
{
    int at = int(r.first + i);
    uvec2 words = imageLoad(samples, at).xy;
    return uvec3(words.x, imageLoad(ids, at).x, words.y);
}

void store(run r, uint i, uvec3 item)
{
    int at = int(r.first + i);
    imageStore(samples, at, uvec4(item.xz, 0u, 0u));
    imageStore(ids, at, uvec4(item.y));
}

bool before(uvec3 a, uvec3 b)
{
    return a.x < b.x || a.x == b.x && a.y < b.y; // depths are not negative: their bits ascend as they do
}

// Winding behind a node with these bits.
int winding_behind(int winding, uint bits)
{
    if ((bits & ABUFFER_NODE_CLOSED) == 0u)
        return winding;
    return (bits & ABUFFER_NODE_LEAVES) != 0u ? winding - 1 : winding + 1;
}

uint sample_bits(uint bits, int winding)
{
    uint stored = uint(clamp(winding + ABUFFER_WINDING_ZERO, 0, int(ABUFFER_WINDING_MASK)));
    return bits & ABUFFER_NODE_NORMAL | stored << ABUFFER_WINDING_SHIFT |
           ((bits & ABUFFER_NODE_CLOSED) != 0u ? ABUFFER_SAMPLE_BODY : 0u);
}

void wind(run r)
{
    int winding = 0;
    for (uint i = 0u; i < r.count; i++) {
        int at = int(r.first + i);
        uvec2 words = imageLoad(samples, at).xy;
        winding = winding_behind(winding, words.y);
        imageStore(samples, at, uvec4(words.x, sample_bits(words.y, winding), 0u, 0u));
    }
}
