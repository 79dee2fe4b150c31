// SPDX-License-Identifier: MIT
// Counts the shadow rays of a batch: the same number for each hit. Runs only where the host does not know the number of
// hits.
#include "render/wave_counts.glsl"

layout(local_size_x = 1) in;

uniform uint batch_rays;
uniform uint all_count; // 1: they count in the slice's sum as they are, dead ones included

void main()
{
    uint count = state.hits.count * batch_rays;
    state.shadow_rays = counts_of(count);
    state.all_shadow_rays += count * all_count;
}
