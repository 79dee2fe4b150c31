// SPDX-License-Identifier: MIT
// From fragments to leaves: who is in each, and the running average of its normals, which goes round until nobody else
// has changed it meanwhile (Crassin and Green).
#include "common/dispatch.glsl"
#include "common/unit.glsl"
#include "svo/tiles.glsl"

layout(binding = UNIT_SVO_FRAGMENTS) uniform usamplerBuffer fragments;
layout(binding = IMAGE_SVO_RECORDS, r32ui) writeonly uniform uimageBuffer nodes;
layout(binding = IMAGE_SVO_IDS, r32ui) uniform uimageBuffer ids;
layout(binding = IMAGE_SVO_PLANES, r32ui) uniform uimageBuffer normals;

uniform uint fragment_count, first_leaf;
uniform int levels;

void main()
{
    int k = int(item_index());
    if (uint(k) >= fragment_count)
        return;
    uvec4 fragment = texelFetch(fragments, k);
    int node = node_of(unpack_cell(fragment.x), levels, levels), leaf = node - int(first_leaf);
    imageStore(nodes, node, uvec4(SVO_HOLDS));
    imageAtomicMin(ids, leaf, fragment.y);
    vec3 normal = unpack_unit(fragment.z) * 0.5 + 0.5;
    uint before = 0u, now = packUnorm4x8(vec4(normal, 1.0 / 255.0)), found;
    while ((found = imageAtomicCompSwap(normals, leaf, before, now)) != before) {
        before = found;
        vec4 average = unpackUnorm4x8(found);
        float count = round(average.w * 255.0);
        if (count == 255.0) // no more are told apart
            break;
        now = packUnorm4x8(vec4((average.xyz * count + normal) / (count + 1.0), (count + 1.0) / 255.0));
    }
}
