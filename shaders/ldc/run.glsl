// SPDX-License-Identifier: MIT
// Fragments of a texel in `ordered`: those with slots, then those without. The host binds counts, places, occupied and
// ordered, and sets the uniforms below.
#include "ldc/layout.h"
#include "shared/bindings.h"

uniform uint occupied_count;
uniform uint texel_count;
uniform uint texels_along; // a side of the images
uniform uint slots;

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = UNIT_LDC_PLACES) uniform usamplerBuffer places;
layout(binding = UNIT_LDC_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = IMAGE_LDC_ORDERED, rg32ui) uniform uimageBuffer ordered;

struct run {
    uint bits; // texel, encoded as in `occupied`
    uint texel, place, count;
};

run run_of(uint number)
{
    uint bits = texelFetch(occupied, int(number)).x;
    uint texel = ((bits >> 24) * texels_along + (bits >> 12 & 4095u)) * texels_along + (bits & 4095u);
    uint count = texelFetch(counts, int(texel)).x;
    return run(bits, texel, slots * texel_count + texelFetch(places, int(texel)).x - slots, count);
}

int index_of(run r, uint i)
{
    return int(i < slots ? i * texel_count + r.texel : r.place + i);
}

uvec2 load(run r, uint i)
{
    return imageLoad(ordered, index_of(r, i)).xy;
}

void store(run r, uint i, uvec2 fragment)
{
    imageStore(ordered, index_of(r, i), uvec4(fragment, 0u, 0u));
}

bool before(uvec2 a, uvec2 b)
{
    return a.x < b.x || a.x == b.x && a.y < b.y; // depths are not negative: their bits ascend as they do
}
