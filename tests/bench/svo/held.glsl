// SPDX-License-Identifier: MIT
// What is in a leaf: primitive and instance. Of the instances the last whose first id is not behind (raster/layout.h).
#include "common/candidate.glsl"
#include "svo/svo.h"

layout(binding = UNIT_SVO_IDS) uniform usamplerBuffer ids;
layout(binding = UNIT_SVO_DRAWN) uniform usamplerBuffer drawn;

uniform uint drawn_count;

candidate candidate_of(int leaf, float distance_)
{
    uint id = texelFetch(ids, leaf).x, first = 0u, behind = drawn_count;
    while (behind - first > 1u) {
        uint middle = (first + behind) / 2u;
        if (texelFetch(drawn, int(middle)).x <= id)
            first = middle;
        else
            behind = middle;
    }
    uvec4 words = texelFetch(drawn, int(first));
    return candidate(distance_, id - words.y, words.z, vec2(0.0));
}
