// SPDX-License-Identifier: MIT
// Marks samples with a ray that reached unknown space, by the share of that ray at the eye, in the layer `unknown`, after
// each wave of secondary rays. The maximum over a sample's rays counts, in whichever order they come.

#include "shared/hit.h"
#include "shared/layers.h"
#include "common/dispatch.glsl"
#include "common/math.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform uint first_sum; // first sum of the layer

layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;
layout(std430, binding = BIND_LAYER_SUMS) buffer layer_block { vec4 layer_sums[]; };

// First texel of a path: weights, and the sample.
uvec4 path_head(uint k)
{
    return texelFetch(paths, int(k) * PATH_TEXELS);
}

// The paths of a sample lie side by side; the first of them marks for all.
void main()
{
    uint k = item_index();
    if (k >= wave.rays.count)
        return;
    uint slot = path_head(k).w;
    if (k > 0u && path_head(k - 1u).w == slot)
        return;
    float share = layer_sums[first_sum + slot].r;
    for (; k < wave.rays.count && path_head(k).w == slot; k++)
        if ((texelFetch(hits, int(3u * k)).y & HIT_UNKNOWN) != 0u)
            share = max(share, min(max_component(uintBitsToFloat(path_head(k).xyz)), 1.0));
    layer_sums[first_sum + slot] = vec4(vec3(share), 1.0);
}
