// SPDX-License-Identifier: MIT
// Sorts lists that are too long for resolve.comp into runs.

#define SORT_ITEM uvec3
#include "common/dispatch.glsl"
#include "abuffer/list.glsl"
#include "abuffer/run.glsl"
#include "common/sort.glsl"

uniform uint first_item, end_item; // items of the list

layout(binding = UNIT_ABUFFER_LONGER) uniform usamplerBuffer longer;
layout(binding = UNIT_ABUFFER_TEXELS) uniform usamplerBuffer texels;

void main()
{
    uint k = first_item + item_index();
    if (k >= end_item)
        return;
    uint texel = texelFetch(longer, int(k)).x, node = head_of(texel);
    uvec2 words = texelFetch(texels, int(texel)).xy;
    run r = run(words.x, words.y);
    for (uint i = 0u; i < r.count; i++)
        store(r, i, take(node));
    sort(r);
    wind(r);
}
