// SPDX-License-Identifier: MIT
// A pass: pairs of nodes and elements that may meet become pairs of their children that may. Test and stream reduction
// in one: an invocation takes RAYSPACE_CHUNK pairs and asks once for places for all that is left of them (section 4
// reduces the stream in passes of its own).
//
// The defines of rayspace/place.glsl, rayspace/meet.glsl, rayspace/tree.glsl, and HAS_MOTION.
#include "common/dispatch.glsl"
#include "rayspace/place.glsl"
#include "rayspace/tree.glsl"

layout(binding = UNIT_RAYSPACE_NODES) uniform samplerBuffer nodes;
layout(binding = UNIT_RAYSPACE_PAIRS) uniform usamplerBuffer pairs; // of the stack that is taken from
layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };
layout(std430, binding = BIND_RAYSPACE_LEAVES) writeonly buffer leaf_block { uvec4 leaves_written[]; };

uniform uint level_first[16]; // node of each level
uniform uint level_count[16];

// The node is divided while it is wider than a fraction of the element, by that factor (RAYSPACE.md measured it best
// for every wave): what is coarse on both sides costs tests and culls little.
const float SPLIT_FACTOR = 4.0;

bundle bundle_at(uint node)
{
    uint level = node >> RAYSPACE_LEVEL_SHIFT, index = node & RAYSPACE_INDEX_MASK;
    if (level == 0u)
        return bundle_of_ray(ray_at_place(index));
    int texel = int(level_first[level] + index) * RAYSPACE_NODE_TEXELS;
    vec4 centre_radius = texelFetch(nodes, texel), axis_secant = texelFetch(nodes, texel + 1);
    vec4 lower_tan = texelFetch(nodes, texel + 2), upper_end = texelFetch(nodes, texel + 3);
    return bundle(centre_radius.xyz, centre_radius.w, axis_secant.xyz, axis_secant.w, lower_tan.w, lower_tan.xyz,
                  upper_end.xyz, texelFetch(nodes, texel + 4).xyz, texelFetch(nodes, texel + 5).xyz, upper_end.w);
}

// Whether the node of a pair is to be divided, rather than the element.
bool divides_node(uint node, tree_element e, bounds b)
{
    if (node >> RAYSPACE_LEVEL_SHIFT == 0u)
        return false;
    if (is_leaf(e.link))
        return e.link >> BVH_LEAF_KIND_SHIFT != BVH_LEAF_INSTANCE;
    int texel = int(level_first[node >> RAYSPACE_LEVEL_SHIFT] + (node & RAYSPACE_INDEX_MASK)) * RAYSPACE_NODE_TEXELS;
    vec4 centre_radius = texelFetch(nodes, texel);
    float tangent = texelFetch(nodes, texel + 2).w, secant = texelFetch(nodes, texel + 1).w;
    float width = centre_radius.w + distance(b.centre, centre_radius.xyz) * tangent;
    return secant == 0.0 || width * SPLIT_FACTOR > b.radius;
}

const uint KEPT_MAX = RAYSPACE_CHUNK * (RAYSPACE_CHILDREN + 1u);

void main()
{
    uint begin = item_index() * RAYSPACE_CHUNK;
    if (begin >= control.taken)
        return;
    uvec4 kept[KEPT_MAX];
    uint kept_count = 0u, leaf_mask = 0u, tests = 0u;
    for (uint i = begin; i < min(begin + RAYSPACE_CHUNK, control.taken); i++) {
        uvec4 pair = texelFetch(pairs, int(control.first + i));
        tree_place tree = tree_of(pair.z);
        tree_element element = element_at(tree, pair.y);
        bounds bounds_ = bounds_of(tree, element);
        bool by_node = divides_node(pair.x, element, bounds_);
        uint level = pair.x >> RAYSPACE_LEVEL_SHIFT, index = pair.x & RAYSPACE_INDEX_MASK;
        uint end = element.link, next = pair.y + 1u, instance_index = pair.z;
        if (!by_node && is_leaf(element.link)) { // an instance: its tree's root is the one child
            instance_index = element.link & BVH_LEAF_FIRST_MASK;
            tree = tree_of(instance_index);
            next = 0u;
            end = min(1u, tree.count);
        }
        for (uint skip = pair.w; !by_node && skip > 0u && next < end; skip--) {
            uint link = element_at(tree, next).link;
            next = is_leaf(link) ? next + 1u : max(link, next + 1u);
        }
        bundle b;
        if (!by_node)
            b = bundle_at(pair.x);
        uint nodes_left = by_node ? min(level_count[level - 1u] - 4u * index, 4u) : 0u;
        for (uint child = 0u; child < RAYSPACE_CHILDREN; child++) {
            uvec4 made = uvec4(pair.x, pair.y, instance_index, 0u);
            if (by_node) {
                if (child >= nodes_left)
                    break;
                made.x = (level - 1u) << RAYSPACE_LEVEL_SHIFT | (4u * index + child);
                b = bundle_at(made.x);
            } else {
                if (next >= end)
                    break;
                made.y = next;
                element = element_at(tree, next);
                bounds_ = bounds_of(tree, element);
                next = is_leaf(element.link) ? next + 1u : max(element.link, next + 1u);
            }
            tests++;
            if (!may_meet(b, bounds_))
                continue;
            if (made.x >> RAYSPACE_LEVEL_SHIFT == 0u && is_leaf(element.link) &&
                element.link >> BVH_LEAF_KIND_SHIFT != BVH_LEAF_INSTANCE) {
                made.y = element.link;
                leaf_mask |= 1u << kept_count;
            }
            kept[kept_count++] = made;
        }
        if (!by_node && next < end) // the rest of many children
            kept[kept_count++] = uvec4(pair.xyz, pair.w + RAYSPACE_CHILDREN);
    }
    atomicAdd(control.cone_tests, tests);
    uint leaf_count = uint(bitCount(leaf_mask)), pair_count = kept_count - leaf_count;
    uint leaf_place = leaf_count > 0u ? atomicAdd(control.leaves_written, leaf_count) : 0u;
    uint pair_place = pair_count > 0u ? atomicAdd(control.written, pair_count) : 0u;
    bool leaves_fit = leaf_place + leaf_count <= control.leaves_room, pairs_fit = pair_place + pair_count <= control.room;
    uint leaf_base = control.leaves + leaf_place;
    uint pair_base = (control.from == 0u ? control.waiting_1 : control.waiting_0) + pair_place;
    for (uint k = 0u; k < kept_count; k++) {
        if ((leaf_mask >> k & 1u) != 0u) {
            if (leaves_fit)
                leaves_written[leaf_base++] = kept[k];
        } else if (pairs_fit) {
            pairs_written[pair_base++] = kept[k];
        }
    }
}
