// SPDX-License-Identifier: MIT
// Histogram of fragments per texel; the last bin has 255 and more.

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "common/dispatch.glsl"

uniform uint occupied_count;
uniform uint texels_along; // a side of the images

layout(binding = UNIT_LDC_COUNTS) uniform usamplerBuffer counts;
layout(binding = UNIT_LDC_OCCUPIED) uniform usamplerBuffer occupied;
layout(std430, binding = BIND_LDC_HISTOGRAM) buffer histogram_block { uint texels_with[LDC_HISTOGRAM_BINS]; };

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    uint bits = texelFetch(occupied, int(k)).x;
    uint texel = ((bits >> 24) * texels_along + (bits >> 12 & 4095u)) * texels_along + (bits & 4095u);
    uint count = texelFetch(counts, int(texel)).x;
    atomicAdd(texels_with[min(count, LDC_HISTOGRAM_BINS - 1u)], 1u);
}
