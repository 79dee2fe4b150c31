// SPDX-License-Identifier: MIT
// Two rays that have nothing in common, traversed side by side: a step of each in turn, and they wait for each other
// where leaves are tested and instances entered. On a processor a step waits for the one before (fetch, test, where to
// go on: some hundred cycles), and a step of another ray fills that time. Measured on software GL with 146K triangles:
// two take 0.88 of the time of one after the other for diffuse bounces, 0.85 for ambient occlusion; three and four
// take longer than two, as more invocations wait.
//
// No array has the two: a loop over them that the compiler does not unroll would keep them in memory.
#ifdef RAY_PAIRS

struct ray_traversal {
    trace_ray r[PACKET_RAYS]; // one
    answer found[PACKET_RAYS];
    tree_traversal tree, world_tree; // the current one; the top tree while the ray is in an instance
    bundle b, world_b;
    entered_instance inside;
    object_ray o[PACKET_RAYS];
    relative_rays rays;
};

ray_traversal begin_ray(trace_ray r, answer found)
{
    ray_traversal t;
    t.r[0] = r;
    t.found[0] = found;
    begin_packet(t.r, 0, t.inside, t.o, t.tree, t.world_tree, t.b, t.world_b, t.rays);
    return t;
}

void test_next_element(inout ray_traversal t, distances_left left)
{
    if (is_searching(t.tree))
        t.tree.leaf = test_element(t.tree, t.b, left, t.r, t.found);
}

bool has_primitives(ray_traversal t)
{
    return t.tree.leaf != 0u && t.tree.leaf >> BVH_LEAF_KIND_SHIFT != BVH_LEAF_INSTANCE;
}

void test_whole_leaf(inout ray_traversal t)
{
    if (!has_primitives(t))
        return;
    uint primitive = 0u;
    noted_primitive noted;
    noted.bits = 0u;
    test_leaf(t.tree.leaf, primitive, t.inside, t.o, t.rays, t.r, t.found, noted);
    t.tree.leaf = 0u;
#ifdef ANY_HIT
    if (!is_alive_any(t.r))
        t.tree.element = t.tree.end;
#endif
}

bool cross_border_of(inout ray_traversal t)
{
    return cross_border(t.tree.leaf, t.tree, t.world_tree, t.b, t.world_b, 0, t.inside, t.o, t.rays, t.r, t.found);
}

void trace_pair(trace_ray r[2], inout answer found[2])
{
    ray_traversal first = begin_ray(r[0], found[0]), second = begin_ray(r[1], found[1]);
    for (bool crossing = true; crossing;) {
        for (;;) {
            distances_left left_first = left_of(first.r, first.found), left_second = left_of(second.r, second.found);
            while (is_searching(first.tree) || is_searching(second.tree)) {
                test_next_element(first, left_first);
                test_next_element(second, left_second);
            }
            if (!has_primitives(first) && !has_primitives(second))
                break;
            test_whole_leaf(first);
            test_whole_leaf(second);
        }
        bool first_goes_on = cross_border_of(first), second_goes_on = cross_border_of(second);
        crossing = first_goes_on || second_goes_on;
    }
    found[0] = first.found[0];
    found[1] = second.found[0];
}

#endif
