/* SPDX-License-Identifier: MIT */
#include "trace/bvh_build.h"
#include "trace/bvh_build_top.h"

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>

#include <cmocka.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define COUNT(array) (sizeof(array) / sizeof((array)[0]))

struct input {
    float *positions;
    uint32_t *indices;
    float *spheres;
    struct bvh_shape shape;
};

static uint32_t random_bits(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return *state >> 8;
}

static float uniform(uint32_t *state, float low, float high)
{
    return low + (high - low) * (float)random_bits(state) / 16777216.0f;
}

/* Three vertices of its own for each triangle, `size` across. */
static struct input triangles(uint32_t count, float extent, float size, uint32_t seed)
{
    struct input input = {
        malloc(9 * (size_t)count * sizeof(float)), malloc(3 * (size_t)count * sizeof(uint32_t)), NULL, {0}};
    for (uint32_t t = 0; t < count; t++) {
        float centre[3];
        for (int k = 0; k < 3; k++)
            centre[k] = uniform(&seed, -extent, extent);
        for (uint32_t v = 3 * t; v < 3 * t + 3; v++) {
            input.indices[v] = v;
            for (uint32_t k = 0; k < 3; k++)
                input.positions[3 * v + k] = centre[k] + uniform(&seed, -size, size);
        }
    }
    input.shape =
        (struct bvh_shape){.positions = input.positions, .indices = input.indices, .primitive_count = count};
    return input;
}

static struct input spheres(uint32_t count, uint32_t seed)
{
    struct input input = {.spheres = malloc(4 * (size_t)count * sizeof(float))};
    for (uint32_t i = 0; i < 4 * count; i++)
        input.spheres[i] = i % 4 == 3 ? uniform(&seed, 0.01f, 0.5f) : uniform(&seed, -10, 10);
    input.shape = (struct bvh_shape){.centres_radii = input.spheres, .primitive_count = count};
    return input;
}

static void input_finish(struct input *input)
{
    free(input->positions);
    free(input->indices);
    free(input->spheres);
}

static struct bvh_tree build(const struct input *input, enum bvh_bounds bounds, bool plain, unsigned threads)
{
    struct bvh_tree tree;
    struct error error = {0};
    struct bvh_settings settings = {bounds, plain, threads};
    if (!bvh_tree_build(&tree, &input->shape, &settings, &error))
        fail_msg("not built: %s", error.text);
    return tree;
}

static uint32_t leaf_count(uint32_t leaf)
{
    return leaf ? (leaf >> BVH_LEAF_COUNT_SHIFT & BVH_LEAF_COUNT_MASK) + 1 : 0;
}

static uint32_t leaf_first(uint32_t leaf)
{
    return leaf & BVH_LEAF_FIRST_MASK;
}

/* The number of a primitive in its geometry, as the shader reads it. */
static uint32_t primitive_number(const struct input *input, const struct bvh_tree *tree, uint32_t place)
{
    uint32_t number;
    const float *texels = tree->primitives;
    memcpy(&number, input->spheres ? &texels[8 * (size_t)place + 4] : &texels[12 * (size_t)place + 3],
           sizeof number);
    return number;
}

static void expect_each_primitive_once(const struct input *input, const struct bvh_tree *tree)
{
    uint32_t count = input->shape.primitive_count;
    uint8_t *seen = calloc(count, 1);
    uint32_t in_leaves = 0;
    for (uint32_t e = 0; e < tree->element_count; e++) {
        uint32_t leaf = tree->elements[e].leaf;
        for (uint32_t i = 0; i < leaf_count(leaf); i++, in_leaves++) {
            assert_in_range(leaf_first(leaf) + i, 0, count - 1);
            uint32_t number = primitive_number(input, tree, leaf_first(leaf) + i);
            assert_in_range(number, 0, count - 1);
            if (seen[number]++)
                fail_msg("primitive %u is in two leaves", number);
            if (!input->spheres)
                for (uint32_t c = 0; c < 3; c++)
                    assert_memory_equal(&tree->primitives[12 * (size_t)(leaf_first(leaf) + i) + 4 * c],
                                        &input->positions[3 * input->indices[3 * number + c]], 3 * sizeof(float));
        }
    }
    assert_int_equal(in_leaves, count);
    free(seen);
}

static bool box_contains(const struct bvh_element *box, const float point[3])
{
    return box->lower_x <= point[0] && point[0] <= box->upper_x && box->lower_y <= point[1] &&
           point[1] <= box->upper_y && box->lower_z <= point[2] && point[2] <= box->upper_z;
}

static bool sphere_contains(const struct bvh_element *sphere, const float point[3], float radius)
{
    double x = (double)point[0] - (double)sphere->lower_x, y = (double)point[1] - (double)sphere->lower_y;
    double z = (double)point[2] - (double)sphere->lower_z;
    return sqrt(x * x + y * y + z * z) + (double)radius <= (double)sphere->upper_x;
}

/* Whether a primitive lies within a bound. */
static bool bound_contains(const struct input *input, const struct bvh_element *bound, uint32_t number,
                           bool is_sphere)
{
    if (input->spheres) {
        const float *s = &input->spheres[4 * (size_t)number];
        const float low[3] = {s[0] - s[3], s[1] - s[3], s[2] - s[3]},
                    high[3] = {s[0] + s[3], s[1] + s[3], s[2] + s[3]};
        return is_sphere ? sphere_contains(bound, s, s[3]) : box_contains(bound, low) && box_contains(bound, high);
    }
    for (uint32_t c = 0; c < 3; c++) {
        const float *v = &input->positions[3 * (size_t)input->indices[3 * (size_t)number + c]];
        if (is_sphere ? !sphere_contains(bound, v, 0) : !box_contains(bound, v))
            return false;
    }
    return true;
}

static uint32_t subtree_end(const struct bvh_tree *tree, uint32_t e)
{
    return tree->elements[e].miss == BVH_END ? tree->element_count : tree->elements[e].miss;
}

/* Every bound contains the primitives of all leaves below it, and a box its children's boxes. */
static void expect_bounds_contain(const struct input *input, const struct bvh_tree *tree, bool is_sphere)
{
    for (uint32_t e = 0; e < tree->element_count; e++) {
        const struct bvh_element *bound = &tree->elements[e];
        for (uint32_t below = e; below < subtree_end(tree, e); below++) {
            const struct bvh_element *other = &tree->elements[below];
            for (uint32_t i = 0; i < leaf_count(other->leaf); i++)
                if (!bound_contains(input, bound, primitive_number(input, tree, leaf_first(other->leaf) + i),
                                    is_sphere))
                    fail_msg("element %u does not contain a primitive of leaf %u", e, below);
            const float low[3] = {other->lower_x, other->lower_y, other->lower_z};
            const float high[3] = {other->upper_x, other->upper_y, other->upper_z};
            if (!is_sphere && (!box_contains(bound, low) || !box_contains(bound, high)))
                fail_msg("box %u does not contain box %u", e, below);
        }
    }
}

/* Walks as the shader does, with every bound hit (or none); returns the steps, and marks the leaves. */
static uint32_t walk(const struct bvh_tree *tree, uint32_t octant, bool hit, uint8_t *visited)
{
    uint32_t element = 0, steps = 0;
    while (element != BVH_END) {
        assert_in_range(element, 0, tree->element_count - 1);
        assert_in_range(steps, 0, tree->element_count);
        const struct bvh_link *link = &tree->links[(size_t)octant * tree->element_count + element];
        steps++;
        visited[element]++;
        element = hit && tree->elements[element].leaf == 0 ? link->hit : link->miss;
    }
    return steps;
}

static void expect_links_right(const struct bvh_tree *tree)
{
    uint8_t *visited = malloc(tree->element_count);
    for (uint32_t octant = 0; octant < BVH_OCTANTS; octant++) {
        memset(visited, 0, tree->element_count);
        assert_int_equal(walk(tree, octant, true, visited), tree->element_count);
        for (uint32_t e = 0; e < tree->element_count; e++)
            if (visited[e] != 1)
                fail_msg("octant %u: element %u is visited %u times", octant, e, visited[e]);
        assert_int_equal(walk(tree, octant, false, visited), 1);
    }
    free(visited);
}

static void expect_sound(const struct input *input)
{
    for (unsigned bounds = 0; bounds < 2; bounds++) {
        struct bvh_tree tree = build(input, (enum bvh_bounds)bounds, false, 2);
        expect_each_primitive_once(input, &tree);
        expect_bounds_contain(input, &tree, bounds == BVH_BOUNDS_OF_SPHERES);
        expect_links_right(&tree);
        bvh_tree_finish(&tree);
    }
}

static void a_tree_over_triangles_is_sound(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 2, 3, 9, 100, 3000};
    for (size_t i = 0; i < COUNT(counts); i++) {
        struct input input = triangles(counts[i], 10, 0.3f, (uint32_t)i + 1);
        expect_sound(&input);
        input_finish(&input);
    }
}

static void a_tree_over_spheres_is_sound(void **state)
{
    (void)state;
    static const uint32_t counts[] = {1, 2, 500};
    for (size_t i = 0; i < COUNT(counts); i++) {
        struct input input = spheres(counts[i], (uint32_t)i + 1);
        expect_sound(&input);
        input_finish(&input);
    }
}

static void equal_triangles_are_split_without_end(void **state)
{
    (void)state;
    struct input input = triangles(2000, 0, 1, 5);
    for (uint32_t i = 0; i < 6000; i++)
        input.indices[i] = i % 3;
    expect_sound(&input);
    input_finish(&input);
}

static void triangles_without_area_are_kept(void **state)
{
    (void)state;
    struct input input = triangles(500, 3, 0, 6);
    expect_sound(&input);
    input_finish(&input);
}

static void coordinates_at_the_end_of_the_range_do_no_harm(void **state)
{
    (void)state;
    struct input input = triangles(300, 1, 0.1f, 7);
    for (uint32_t i = 0; i < 2700; i++)
        input.positions[i] *= 1e38f; /* surfaces and extents are infinite */
    struct bvh_tree tree = build(&input, BVH_BOUNDS_OF_BOXES, false, 1);
    expect_each_primitive_once(&input, &tree);
    expect_bounds_contain(&input, &tree, false);
    expect_links_right(&tree);
    bvh_tree_finish(&tree);
    input_finish(&input);
}

/* Each triangle on its own scale: every split takes off one, so the tree is as deep as it has primitives. */
static void a_tree_that_degenerates_to_a_list_is_built(void **state)
{
    (void)state;
    struct input input = triangles(110, 0, 0, 8);
    for (uint32_t t = 0; t < 110; t++)
        for (uint32_t c = 0; c < 9; c++)
            input.positions[9 * t + c] = ldexpf(1.0f + 0.1f * (float)(c % 4), (int)t - 60);
    expect_sound(&input);
    input_finish(&input);
}

static void the_tree_does_not_depend_on_the_threads(void **state)
{
    (void)state;
    struct input input = triangles(BVH_THREADED_PRIMITIVES + 10000, 10, 0.05f, 9);
    struct bvh_tree one = build(&input, BVH_BOUNDS_OF_BOXES, false, 1);
    for (unsigned threads = 2; threads < 5; threads++) {
        struct bvh_tree several = build(&input, BVH_BOUNDS_OF_BOXES, false, threads);
        assert_int_equal(several.element_count, one.element_count);
        assert_memory_equal(several.elements, one.elements, one.element_count * sizeof *one.elements);
        assert_memory_equal(several.links, one.links, BVH_OCTANTS * one.element_count * sizeof *one.links);
        assert_int_equal(several.primitive_texels, one.primitive_texels);
        assert_memory_equal(several.primitives, one.primitives, one.primitive_texels * 4 * sizeof(float));
        bvh_tree_finish(&several);
    }
    expect_each_primitive_once(&input, &one);
    expect_links_right(&one);
    bvh_tree_finish(&one);
    input_finish(&input);
}

/* The leaf that octant `octant` meets first: its lowest corner on `axis`. */
static float first_leaf_corner(const struct bvh_tree *tree, uint32_t octant, int axis)
{
    uint32_t e = 0;
    while (tree->elements[e].leaf == 0)
        e = tree->links[(size_t)octant * tree->element_count + e].hit;
    const struct bvh_element *leaf = &tree->elements[e];
    return axis == 0 ? leaf->lower_x : axis == 1 ? leaf->lower_y : leaf->lower_z;
}

static void each_octant_meets_the_near_side_first(void **state)
{
    (void)state;
    for (uint32_t axis = 0; axis < 3; axis++) {
        struct input input = triangles(400, 1, 0.1f, 10);
        for (uint32_t i = axis; i < 3600; i += 3)
            input.positions[i] += i / 9 % 2 ? 50.0f : -50.0f;
        struct bvh_tree tree = build(&input, BVH_BOUNDS_OF_BOXES, false, 1);
        for (uint32_t octant = 0; octant < BVH_OCTANTS; octant++) {
            float corner = first_leaf_corner(&tree, octant, (int)axis);
            bool goes_down = octant >> axis & 1;
            if (goes_down != (corner > 0))
                fail_msg("octant %u, axis %u: the first leaf begins at %g", octant, axis, (double)corner);
        }
        bvh_tree_finish(&tree);
        input_finish(&input);
    }
}

static void elements_that_do_not_pay_are_thrown_back(void **state)
{
    (void)state;
    struct input input = triangles(1000, 1, 2, 11); /* large and overlapping: halves are as big as the whole */
    struct bvh_tree tree = build(&input, BVH_BOUNDS_OF_BOXES, false, 1);
    uint32_t leaves = 0, widest = 0;
    for (uint32_t e = 0; e < tree.element_count; e++) {
        uint32_t children = 0;
        for (uint32_t c = e + 1; c < subtree_end(&tree, e); c = subtree_end(&tree, c))
            children++;
        widest = children > widest ? children : widest;
        leaves += tree.elements[e].leaf != 0;
    }
    assert_in_range(widest, 3, tree.element_count);
    assert_in_range(tree.element_count, leaves, 2 * leaves - 2); /* a binary tree has 2 leaves - 1 */
    bvh_tree_finish(&tree);
    input_finish(&input);
}

static void the_plain_form_has_one_order_and_no_links_beside(void **state)
{
    (void)state;
    struct input input = triangles(800, 5, 0.2f, 12);
    struct bvh_tree tree = build(&input, BVH_BOUNDS_OF_SPHERES, true, 1);
    assert_null(tree.links);
    uint32_t visited = 0;
    for (uint32_t e = 0; e != BVH_END && visited <= tree.element_count; visited++)
        e = tree.elements[e].leaf ? tree.elements[e].miss : e + 1;
    assert_int_equal(visited, tree.element_count);
    bvh_tree_finish(&tree);
    input_finish(&input);
}

static void a_shape_without_primitives_is_refused(void **state)
{
    (void)state;
    struct bvh_tree tree;
    struct error error = {0};
    assert_false(bvh_tree_build(&tree, &(struct bvh_shape){0}, &(struct bvh_settings){.threads = 1}, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_null(tree.elements);
}

static void several_shapes_are_built_together(void **state)
{
    (void)state;
    struct input inputs[] = {triangles(40, 1, 0.1f, 13), triangles(BVH_THREADED_PRIMITIVES, 5, 0.1f, 14),
                             spheres(300, 15), triangles(1, 1, 1, 16)};
    struct bvh_job jobs[COUNT(inputs)];
    struct error error = {0};
    for (size_t i = 0; i < COUNT(inputs); i++)
        jobs[i].shape = inputs[i].shape;
    struct bvh_settings settings = {BVH_BOUNDS_OF_BOXES, false, 2};
    assert_true(bvh_jobs_run(jobs, COUNT(jobs), &settings, &error));
    for (size_t i = 0; i < COUNT(inputs); i++) {
        expect_each_primitive_once(&inputs[i], &jobs[i].tree);
        bvh_tree_finish(&jobs[i].tree);
        input_finish(&inputs[i]);
    }
    jobs[0].shape.primitive_count = 0;
    assert_false(bvh_jobs_run(jobs, 1, &settings, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
}

/* ---- top tree ---- */

#define INSTANCES 60u

static void world_boxes(struct bvh_world_box boxes[INSTANCES])
{
    uint32_t seed = 17;
    for (uint32_t i = 0; i < INSTANCES; i++) {
        for (int k = 0; k < 3; k++) {
            boxes[i].lower[k] = uniform(&seed, -20, 20);
            boxes[i].upper[k] = boxes[i].lower[k] + uniform(&seed, 0, 2);
        }
    }
    boxes[7] = (struct bvh_world_box){{1, 1, 1}, {-1, -1, -1}}; /* shows nothing */
}

static void expect_top_contains(const struct bvh_top *top, const struct bvh_world_box *boxes)
{
    for (uint32_t i = 0; i < INSTANCES; i++) {
        uint32_t element = top->element_of[i];
        if (i == 7) {
            assert_int_equal(element, BVH_END);
            continue;
        }
        assert_int_equal(top->elements[element].leaf, bvh_leaf(BVH_LEAF_INSTANCE, i, 1));
        for (; element != BVH_END; element = top->baked.parent[element])
            if (!box_contains(&top->elements[element], boxes[i].lower) ||
                !box_contains(&top->elements[element], boxes[i].upper))
                fail_msg("element %u does not contain instance %u", element, i);
    }
}

static void a_moved_instance_refits_its_path_alone(void **state)
{
    (void)state;
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, BVH_BOUNDS_OF_BOXES, false));
    expect_top_contains(&top, boxes);
    for (uint32_t i = 0; i < INSTANCES; i++) {
        if (i == 7)
            continue;
        uint32_t depth = 0;
        for (uint32_t e = top.element_of[i]; e != BVH_END; e = top.baked.parent[e])
            depth++;
        boxes[i].lower[i % 3] -= 1.5f;
        boxes[i].upper[i % 3] -= 1.5f;
        assert_true(bvh_top_move(&top, i, &boxes[i]));
        assert_int_equal(bvh_top_refit(&top), depth);
        bvh_top_settle(&top);
        expect_top_contains(&top, boxes);
    }
    assert_int_equal(bvh_top_refit(&top), 0);
    bvh_top_finish(&top);
}

static void an_instance_that_comes_or_goes_needs_a_new_top_tree(void **state)
{
    (void)state;
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, BVH_BOUNDS_OF_BOXES, false));
    assert_false(bvh_top_move(&top, 7, &boxes[8]));
    assert_false(bvh_top_move(&top, 8, &boxes[7]));
    assert_true(bvh_top_move(&top, 7, &boxes[7]));
    bvh_top_finish(&top);
}

static void a_top_tree_goes_stale_when_everything_has_moved_far(void **state)
{
    (void)state;
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, BVH_BOUNDS_OF_BOXES, false));
    assert_false(bvh_top_is_stale(&top));
    uint32_t seed = 18;
    for (uint32_t i = 0; i < INSTANCES; i++) {
        if (i == 7)
            continue;
        struct bvh_world_box box = boxes[random_bits(&seed) % 7];
        bvh_top_move(&top, i, &box);
    }
    bvh_top_refit(&top);
    assert_true(bvh_top_is_stale(&top));
    bvh_top_finish(&top);
}

static void a_top_tree_over_nothing_is_empty(void **state)
{
    (void)state;
    struct bvh_top top;
    assert_true(bvh_top_build(&top, NULL, 0, BVH_BOUNDS_OF_BOXES, false));
    assert_int_equal(top.element_count, 0);
    bvh_top_finish(&top);
    const struct bvh_world_box nothing = {{1, 1, 1}, {-1, -1, -1}};
    assert_true(bvh_top_build(&top, &nothing, 1, BVH_BOUNDS_OF_SPHERES, false));
    assert_int_equal(top.element_count, 0);
    bvh_top_finish(&top);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_tree_over_triangles_is_sound),
        cmocka_unit_test(a_tree_over_spheres_is_sound),
        cmocka_unit_test(equal_triangles_are_split_without_end),
        cmocka_unit_test(triangles_without_area_are_kept),
        cmocka_unit_test(coordinates_at_the_end_of_the_range_do_no_harm),
        cmocka_unit_test(a_tree_that_degenerates_to_a_list_is_built),
        cmocka_unit_test(the_tree_does_not_depend_on_the_threads),
        cmocka_unit_test(each_octant_meets_the_near_side_first),
        cmocka_unit_test(elements_that_do_not_pay_are_thrown_back),
        cmocka_unit_test(the_plain_form_has_one_order_and_no_links_beside),
        cmocka_unit_test(a_shape_without_primitives_is_refused),
        cmocka_unit_test(several_shapes_are_built_together),
        cmocka_unit_test(a_moved_instance_refits_its_path_alone),
        cmocka_unit_test(an_instance_that_comes_or_goes_needs_a_new_top_tree),
        cmocka_unit_test(a_top_tree_goes_stale_when_everything_has_moved_far),
        cmocka_unit_test(a_top_tree_over_nothing_is_empty),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
