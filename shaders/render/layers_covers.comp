// SPDX-License-Identifier: MIT
// Notes what covers the samples of a slice (shared/layers.h), as far as it is known before their surfaces are shaded: the
// first surface where nothing shows through; otherwise nothing, and gather.comp continues.

#include "shared/hit.h"
#include "shared/layers.h"
#include "common/dispatch.glsl"

layout(local_size_x = 64) in;

uniform uint ray_count;
uniform uint cover_waves;
uniform uint are_known; // 1: nothing shows through

layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
layout(std430, binding = BIND_COVERS) writeonly buffer cover_block { uvec4 covers[]; };

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    uvec4 h = texelFetch(hits, int(3u * k));
    bool is_covered = are_known != 0u && uintBitsToFloat(h.x) >= 0.0 && (h.y & HIT_GROUND) == 0u;
    covers[k] = uvec4(h.w, h.y, is_covered ? floatBitsToUint(1.0) : 0u, 0u);
    for (uint wave_ = 1u; wave_ < cover_waves; wave_++)
        covers[wave_ * ray_count + k] = uvec4(0u);
}
