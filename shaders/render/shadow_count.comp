// SPDX-License-Identifier: MIT
// The number of shadow rays of a batch: so many of each hit. Only where the host does not know how many hits there are.
#include "render/wave_counts.glsl"

layout(local_size_x = 1) in;

uniform uint batch_rays;
uniform uint all_count; // 1: they count in the slice's sum as they are, dead ones too

void main()
{
    uint count = state.hits.count * batch_rays;
    state.shadow_rays = counts_of(count);
    state.all_shadow_rays += count * all_count;
}
