// SPDX-License-Identifier: MIT
// Descends a level: pairs of nodes and elements that may meet become pairs of their children that may. Test and stream
// reduction are one pass: an invocation takes RAYSPACE_CHUNK pairs and reserves places for all remaining children at
// once.
//
// Defines: those of rayspace/place.glsl, rayspace/meet.glsl and rayspace/tree.glsl, HAS_MOTION, and
//   RAYSPACE_TO_SLOTS  separate passes reduce the stream (section 4, rayspace/reduce.h)
//   RAYSPACE_FLAT      elements are primitives, and nodes alone are divided (section 3.3)
#include "common/dispatch.glsl"
#include "rayspace/control.glsl"
#include "rayspace/node.glsl"
#include "rayspace/place.glsl"
#include "rayspace/reduce.h"
#include "rayspace/item.glsl"
#include "rayspace/tree.glsl"

layout(binding = UNIT_RAYSPACE_PAIRS) uniform usamplerBuffer pairs; // pairs of the stack that is read
#ifdef RAYSPACE_TO_SLOTS
layout(std430, binding = BIND_RAYSPACE_SLOTS) writeonly buffer slot_block { uvec4 slots_written[]; };
#else
layout(std430, binding = BIND_RAYSPACE_PAIRS) writeonly buffer pair_block { uvec4 pairs_written[]; };
layout(std430, binding = BIND_RAYSPACE_LEAVES) writeonly buffer leaf_block { uvec4 leaves_written[]; };
#endif

uniform uint level_first[16]; // RAYSPACE_LEVELS: node of each level
uniform uint level_count[16];
uniform uint to; // number of the stack that is written

// Factor of the element's size above which the wider node is divided: a test that is coarse on both sides costs time and
// culls little.
uniform float split_factor;

bundle bundle_at(uint node)
{
    uint level = node >> RAYSPACE_LEVEL_SHIFT, index = node & RAYSPACE_INDEX_MASK;
    return level == 0u ? bundle_of_ray(ray_at_place(index)) : bundle_of_node(level_first[level] + index);
}

#ifndef RAYSPACE_FLAT

// Whether a ray that meets the element continues alone, as in a pair of a ray and a leaf (rayspace/subtree.glsl).
bool is_for_one_ray(bool is_top, uint element, uint link)
{
    return is_leaf(link) ? !is_instance(link) : !is_top && link - element <= RAYSPACE_SUBTREE_MAX;
}

// Whether the node of a pair is divided rather than the element; whatever its width where its rays may continue alone, so
// that each has few pairs. On software GL a pair of a pass takes as long as a ray's whole way through a tree.
bool divides_node(uint level, bundle node, bool for_one, uint link, bounds b)
{
    if (level == 0u)
        return false;
    if (is_leaf(link))
        return !is_instance(link);
    float width = node.radius + distance(b.centre, node.centre) * node.tangent;
    return for_one || node.secant == 0.0 || width * split_factor > b.radius;
}

uint after(uint element, uint link)
{
    return is_leaf(link) ? element + 1u : max(link, element + 1u);
}

#endif

const uint KEPT_MAX = RAYSPACE_CHUNK_SLOTS;

// Pairs that this invocation keeps. They are no parameter: software GL takes minutes to compile an array that is passed
// on.
uvec4 kept[KEPT_MAX];
uint kept_count = 0u;
uint leaf_mask = 0u; // a bit for each kept pair
uint tests = 0u;

void test(uvec4 pair, bool is_ray_leaf, bundle b, bounds what)
{
    tests++;
    if (!may_meet(b, what))
        return;
    if (is_ray_leaf)
        leaf_mask |= 1u << kept_count;
    kept[kept_count++] = pair;
}

void take(uvec4 pair)
{
    uint level = pair.x >> RAYSPACE_LEVEL_SHIFT, index = pair.x & RAYSPACE_INDEX_MASK;
    uvec4 made = pair;
    bundle b;
#ifdef RAYSPACE_FLAT
    bounds bounds_ = bounds_of_item(pair.y);
    bool itself = level == 0u, by_node = true;
    if (itself)
        b = bundle_at(pair.x);
    uint link = pair.y, next = 0u, end = 0u;
#else
    b = bundle_at(pair.x);
    if (b.end < 0.0)
        return;
    tree_place tree = tree_of(pair.z);
    tree_element element = element_at(tree, pair.y);
    bounds bounds_ = bounds_of(tree, element);
    uint link = element.link, next = pair.y + 1u, end = link;
    bool for_one = is_for_one_ray(tree.is_top, pair.y, link);
    bool itself = level == 0u && for_one;
    bool by_node = itself || divides_node(level, b, for_one, link, bounds_);
    if (!by_node && is_leaf(link)) { // a scene with one instance: the root of its tree is the only child
        made.z = link & BVH_LEAF_FIRST_MASK;
        tree = tree_of(made.z);
        next = 0u;
        end = min(1u, tree.count);
    }
    for (uint skip = made.w; !by_node && skip > 0u && next < end; skip--)
        next = after(next, element_at(tree, next).link);
#endif
    uint nodes_left = itself ? 1u : by_node ? min(level_count[level - 1u] - 4u * index, 4u) : 0u;
    for (uint child = 0u; child < RAYSPACE_CHILDREN; child++) {
        uvec4 one = made;
        if (by_node) {
            if (child >= nodes_left)
                break;
            if (!itself) {
                one.xw = uvec2((level - 1u) << RAYSPACE_LEVEL_SHIFT | (4u * index + child), 0u);
                b = bundle_at(one.x);
            }
        }
#ifndef RAYSPACE_FLAT
        else {
            if (next >= end)
                break;
            one.yw = uvec2(next, 0u);
            element = element_at(tree, next);
            bounds_ = bounds_of(tree, element);
            link = element.link;
            next = after(next, link);
        }
        bool is_top = tree.is_top;
        if (is_instance(link)) { // the root of its tree is as large, and is tested at once
            one.yz = uvec2(0u, link & BVH_LEAF_FIRST_MASK);
            is_top = false;
            if (!root_link_of(one.z, link))
                continue;
        }
        bool is_ray_leaf = one.x >> RAYSPACE_LEVEL_SHIFT == 0u && is_for_one_ray(is_top, one.y, link);
#else
        bool is_ray_leaf = one.x >> RAYSPACE_LEVEL_SHIFT == 0u;
#endif
        test(one, is_ray_leaf, b, bounds_);
    }
    if (!by_node && next < end) // remaining children
        kept[kept_count++] = uvec4(pair.xyz, made.w + RAYSPACE_CHILDREN);
}

void main()
{
    uint begin = item_index() * RAYSPACE_CHUNK;
    if (begin >= control.taken)
        return;
    for (uint i = begin; i < min(begin + RAYSPACE_CHUNK, control.taken); i++)
        take(texelFetch(pairs, int(control.first + i)));
    atomicAdd(control.cone_tests, tests);
#ifdef RAYSPACE_TO_SLOTS
    for (uint k = 0u; k < KEPT_MAX; k++) {
        uvec4 slot = uvec4(RAYSPACE_SLOT_EMPTY);
        if (k < kept_count)
            slot = uvec4(kept[k].xyz, (leaf_mask >> k & 1u) != 0u ? RAYSPACE_SLOT_LEAF : kept[k].w);
        slots_written[begin * (RAYSPACE_CHILDREN + 1u) + k] = slot;
    }
#else
    uint leaf_count = uint(bitCount(leaf_mask)), pair_count = kept_count - leaf_count;
    uint leaf_place = leaf_count > 0u ? atomicAdd(control.leaves_written, leaf_count) : 0u;
    uint place = pair_count > 0u ? atomicAdd(control.written, pair_count) : 0u;
    bool leaves_fit = leaf_place + leaf_count <= control.leaves_room, pairs_fit = place + pair_count <= control.room;
    leaf_place += control.leaves;
    place += waiting_on(to);
    for (uint k = 0u; k < kept_count; k++) {
        if ((leaf_mask >> k & 1u) != 0u) {
            if (leaves_fit)
                leaves_written[leaf_place++] = kept[k];
        } else if (pairs_fit) {
            pairs_written[place++] = kept[k];
        }
    }
#endif
}
