// SPDX-License-Identifier: MIT
// From lists to runs: the nodes of a texel together and sorted, with the winding behind each.
// Paper, section 3.1: the second pass.

#include "common/dispatch.glsl"
#include "abuffer/run.glsl"

uniform uint occupied_count;

layout(binding = UNIT_ABUFFER_HEADS) uniform usamplerBuffer heads;
layout(binding = UNIT_ABUFFER_NODES) uniform usamplerBuffer nodes;
layout(binding = UNIT_ABUFFER_OCCUPIED) uniform usamplerBuffer occupied;
layout(binding = IMAGE_ABUFFER_TEXELS, rg32ui) writeonly uniform uimageBuffer texels;
layout(binding = IMAGE_ABUFFER_DEEP, r32ui) writeonly uniform uimageBuffer deep;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };

const uvec3 NOTHING = uvec3(0xffffffffu); // behind everything
const uint TOGETHER = 4u;

// The next node of a list, and on; NOTHING at its end.
uvec3 take(inout uint node)
{
    if (node == 0u)
        return NOTHING;
    uvec4 words = texelFetch(nodes, int(node) - 1);
    node = words.x;
    return words.ywz;
}

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

// Of at most TOGETHER.
void resolve_few(run r, uint node)
{
    uvec3 a = take(node), b = take(node), c = take(node), d = take(node);
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

// By insertion, as they come.
void resolve_some(run r, uint node)
{
    for (uint i = 0u; i < r.count; i++) {
        uvec3 item = take(node);
        uint k = i;
        for (; k > 0u; k--) {
            uvec3 above = load(r, k - 1u);
            if (!before(item, above))
                break;
            store(r, k, above);
        }
        store(r, k, item);
    }
    wind(r);
}

void resolve(run r, uint node)
{
    if (r.count <= TOGETHER)
        resolve_few(r, node);
    else if (r.count <= ABUFFER_RESOLVE_SORTS)
        resolve_some(r, node);
    else // sort.comp does
        for (uint i = 0u; i < r.count; i++)
            store(r, i, take(node));
}

// Whether there are no more than ABUFFER_LIST_MAX.
bool count_list(uint node, out uint count)
{
    count = 0u;
    for (; node != 0u && count < ABUFFER_LIST_MAX; count++)
        node = texelFetch(nodes, int(node) - 1).x;
    return node == 0u;
}

void main()
{
    uint first = item_index() * ABUFFER_RESOLVE_TEXELS;
    if (first >= occupied_count)
        return;
    uint end = first + ABUFFER_RESOLVE_TEXELS < occupied_count ? first + ABUFFER_RESOLVE_TEXELS : occupied_count;
    uint sum = 0u, most = 0u;
    for (uint k = first; k < end; k++) {
        uint texel = texelFetch(occupied, int(k)).x, count;
        if (count_list(texelFetch(heads, int(texel)).x, count)) {
            sum += count;
            most = count > most ? count : most;
        }
    }
    if (most > build.depth_max) // rarely; the atomic is dear
        atomicMax(build.depth_max, most);
    uint place = atomicAdd(build.samples, sum);
    for (uint k = first; k < end; k++) {
        uint texel = texelFetch(occupied, int(k)).x, node = texelFetch(heads, int(texel)).x, count;
        if (count_list(node, count)) {
            imageStore(texels, int(texel), uvec4(place, count, 0u, 0u));
            resolve(run(place, count), node);
            place += count;
        } else {
            imageStore(deep, int(atomicAdd(build.deep, 1u)), uvec4(texel));
        }
    }
}
