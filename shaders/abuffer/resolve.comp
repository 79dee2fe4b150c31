// SPDX-License-Identifier: MIT
// Turns lists into runs: the nodes of a texel become contiguous and sorted, with the winding behind each. The second pass
// of the paper's section 3.1. A list of up to four is sorted as it is read; longer ones get their places, and are listed
// for later passes. Define: RESOLVE_EIGHT sorts the listed ones of five to eight nodes

#include "common/dispatch.glsl"
#include "abuffer/list.glsl"
#include "abuffer/run.glsl"

uniform uint first_item, end_item; // items of the list

#ifdef RESOLVE_EIGHT
layout(binding = UNIT_ABUFFER_LONGER) uniform usamplerBuffer longer;
layout(binding = UNIT_ABUFFER_TEXELS) uniform usamplerBuffer texels;
#else
uniform uint longer_max;
layout(binding = UNIT_ABUFFER_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = IMAGE_ABUFFER_TEXELS, rg32ui) writeonly uniform uimageBuffer texels;
layout(binding = IMAGE_ABUFFER_LONGER, r32ui) writeonly uniform uimageBuffer longer;
layout(binding = IMAGE_ABUFFER_DEEP, r32ui) writeonly uniform uimageBuffer deep;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };
#endif

void exchange(inout uvec3 a, inout uvec3 b)
{
    bool swap = before(b, a);
    uvec3 first = swap ? b : a;
    b = swap ? a : b;
    a = first;
}

void finish(run r, uint i, uvec3 item, inout int winding)
{
    if (i >= r.count)
        return;
    winding = winding_behind(winding, item.z);
    store(r, i, uvec3(item.xy, sample_bits(item.z, winding)));
}

#ifndef RESOLVE_EIGHT
// Counts the nodes of a list beyond those already read, up to the limit.
uint count_rest(uint node, uint count)
{
    for (; node != 0u && count <= ABUFFER_LIST_MAX; count++)
        node = next_of(node);
    return count;
}

// Lists a texel for a later pass: lists of up to eight nodes from the first place upward, longer ones from the last
// downward.
void list_longer(uint texel, uint count)
{
    if (count > ABUFFER_LIST_MAX)
        imageStore(deep, int(atomicAdd(build.deep, 1u)), uvec4(texel));
    else if (count <= ABUFFER_EIGHT)
        imageStore(longer, int(atomicAdd(build.up_to_eight, 1u)), uvec4(texel));
    else
        imageStore(longer, int(longer_max - 1u - atomicAdd(build.beyond_eight, 1u)), uvec4(texel));
}

void main()
{
    uint k = first_item + item_index();
    if (k >= end_item)
        return;
    uint texel = texelFetch(occupied, int(k)).x, node = head_of(texel);
    uvec3 a = take(node), b = take(node), c = take(node), d = take(node);
    uint count = b.x == ABUFFER_NO_DEPTH ? 1u : c.x == ABUFFER_NO_DEPTH ? 2u : d.x == ABUFFER_NO_DEPTH ? 3u : 4u;
    if (node != 0u) {
        count = count_rest(node, count);
        list_longer(texel, count);
        if (count > ABUFFER_LIST_MAX)
            return;
    }
    if (count > build.depth_max) // rare, so the atomic's cost does not matter
        atomicMax(build.depth_max, count);
    run r = run(atomicAdd(build.samples, count), count);
    imageStore(texels, int(texel), uvec4(r.first, count, 0u, 0u));
    if (count > ABUFFER_FOUR)
        return;
    exchange(a, b);
    exchange(c, d);
    exchange(a, c);
    exchange(b, d);
    exchange(b, c);
    int winding = 0;
    finish(r, 0u, a, winding);
    finish(r, 1u, b, winding);
    finish(r, 2u, c, winding);
    finish(r, 3u, d, winding);
}
#else
// Batcher's sorting network for eight.
void main()
{
    uint k = first_item + item_index();
    if (k >= end_item)
        return;
    uint texel = texelFetch(longer, int(k)).x, node = head_of(texel);
    uvec2 words = texelFetch(texels, int(texel)).xy;
    run r = run(words.x, words.y);
    uvec3 a = take(node), b = take(node), c = take(node), d = take(node);
    uvec3 e = take(node), f = take(node), g = take(node), h = take(node);
    exchange(a, b);
    exchange(c, d);
    exchange(e, f);
    exchange(g, h);
    exchange(a, c);
    exchange(b, d);
    exchange(e, g);
    exchange(f, h);
    exchange(b, c);
    exchange(f, g);
    exchange(a, e);
    exchange(b, f);
    exchange(c, g);
    exchange(d, h);
    exchange(c, e);
    exchange(d, f);
    exchange(b, c);
    exchange(d, e);
    exchange(f, g);
    int winding = 0;
    finish(r, 0u, a, winding);
    finish(r, 1u, b, winding);
    finish(r, 2u, c, winding);
    finish(r, 3u, d, winding);
    finish(r, 4u, e, winding);
    finish(r, 5u, f, winding);
    finish(r, 6u, g, winding);
    finish(r, 7u, h, winding);
}
#endif
