// SPDX-License-Identifier: MIT
// Finds, as the last pass of a build, the maximum w in the first layer of each face, before which rays need no nodes. An
// invocation does a face.
#define GROUP_SIZE 1
#include "common/dispatch.glsl"
#include "quadtree/node.glsl"

layout(binding = UNIT_QUADTREE_NODES) uniform usamplerBuffer nodes;
layout(binding = IMAGE_QUADTREE_NODES, rg32ui) writeonly uniform uimageBuffer made_nodes;

float greatest_w(uvec2 node)
{
    float half_side = 0.5 * float(1 << QUADTREE_TOP);
    vec2 slopes = abs(plane_slopes(node));
    return node_is_plane(node) ? plane_w(node) + half_side * (slopes.x + slopes.y) : box_range(node).x;
}

void main()
{
    uint face = item_index();
    if (face >= quadtree.faces)
        return;
    uint first = node_index(face * quadtree.layers, uint(QUADTREE_TOP), uvec2(0u));
    uint count = node_row(uint(QUADTREE_TOP)) * (quadtree.padded_height >> QUADTREE_TOP);
    float w = 0.0;
    for (uint i = 0u; i < count; i++)
        w = max(w, greatest_w(texelFetch(nodes, int(first + i)).xy));
    imageStore(made_nodes, int(face_index(face)), uvec4(floatBitsToUint(w * 1.0001), 0u, 0u, 0u));
}
