// SPDX-License-Identifier: MIT
// Sorts the runs of texels that have many samples (resolve.comp does the others).

#define SORT_ITEM uvec3
#include "common/dispatch.glsl"
#include "abuffer/run.glsl"
#include "common/sort.glsl"

uniform uint occupied_count;

layout(binding = UNIT_ABUFFER_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = UNIT_ABUFFER_TEXELS) uniform usamplerBuffer texels;

void main()
{
    uint k = item_index();
    if (k >= occupied_count)
        return;
    uvec2 words = texelFetch(texels, int(texelFetch(occupied, int(k)).x)).xy; // nothing, of those left to the host
    run r = run(words.x, words.y);
    if (r.count <= ABUFFER_RESOLVE_SORTS)
        return;
    sort(r);
    wind(r);
}
