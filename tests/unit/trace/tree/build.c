/* SPDX-License-Identifier: MIT */
/* Trees of meshes, spheres and instances: bounds, order, refits. */
#include "trace/tree/build.h"
#include "trace/tree/build_top.h"

#include "base/progress.h"
#include "tests/harness/test.h"

#include <stddef.h>

#include <float.h>
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

/* The forms that elements are stored in. */
static const struct bvh_form packed = {.threads = 2};
static const struct bvh_form whole = {.whole = true, .threads = 2};
static const struct bvh_form one_order = {.one_order = true, .threads = 2};
static const struct bvh_form of_spheres = {.spheres = true, .one_order = true, .threads = 2};
static const struct bvh_form *const forms[] = {&packed, &whole, &one_order, &of_spheres};

static struct bvh_tree build(const struct input *input, const struct bvh_form *settings)
{
    struct bvh_tree tree;
    struct error error = {0};
    if (!bvh_tree_plan(&tree, &input->shape, settings, &error))
        fail_msg("not built: %s", error.text);
    assert_true(bvh_tree_alloc(&tree, settings));
    bvh_tree_write(&tree, &input->shape, settings, tree.elements, tree.primitives);
    return tree;
}

/* ---- what the device reads ---- */

struct view {
    const struct bvh_form *settings;
    const uint32_t *elements;
    uint32_t count;
    const struct bvh_grid *grid;
};

/* A box, or a sphere: its centre in `lower`, its radius in upper[0]. */
struct decoded {
    double lower[3], upper[3];
    uint32_t leaf; /* 0: an inner element */
    uint32_t end;  /* place behind its subtree */
};

static struct view view_of(const struct bvh_tree *tree, const struct bvh_form *settings)
{
    return (struct view){settings, tree->elements, tree->element_count, &tree->grid};
}

static struct decoded decode(const struct view *view, uint32_t octant, uint32_t place)
{
    const uint32_t *words =
        view->elements + ((size_t)octant * view->count + place) * bvh_element_words(view->settings);
    struct decoded decoded = {0};
    for (uint32_t k = 0; k < 3; k++) {
        if (bvh_is_packed(view->settings)) {
            uint32_t near = words[k] & 0xffff, far = words[k] >> 16;
            bool negative = octant >> k & 1;
            double cell = 1 / (double)view->grid->cells_per_unit[k], begin = (double)view->grid->lower[k];
            decoded.lower[k] = begin + cell * (negative ? far : near);
            decoded.upper[k] = begin + cell * (negative ? near : far);
        } else {
            float lower, upper;
            memcpy(&lower, &words[k], sizeof(lower));
            memcpy(&upper, &words[4 + k], sizeof(upper));
            decoded.lower[k] = (double)lower;
            decoded.upper[k] = (double)upper;
        }
    }
    bool is_leaf = words[3] >> BVH_LEAF_KIND_SHIFT != 0;
    decoded.leaf = is_leaf ? words[3] : 0;
    decoded.end = is_leaf ? place + 1 : words[3];
    return decoded;
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
           sizeof(number));
    return number;
}

static void expect_each_primitive_once(const struct input *input, const struct bvh_tree *tree,
                                       const struct view *view, uint32_t octant)
{
    uint32_t count = input->shape.primitive_count;
    uint8_t *seen = calloc(count, 1);
    uint32_t in_leaves = 0;
    for (uint32_t e = 0; e < view->count; e++) {
        uint32_t leaf = decode(view, octant, e).leaf;
        for (uint32_t i = 0; i < leaf_count(leaf); i++, in_leaves++) {
            assert_in_range(leaf_first(leaf) + i, 0, count - 1);
            uint32_t number = primitive_number(input, tree, leaf_first(leaf) + i);
            assert_in_range(number, 0, count - 1);
            if (seen[number]++)
                fail_msg("octant %u: primitive %u is in two leaves", octant, number);
            if (!input->spheres)
                for (uint32_t c = 0; c < 3; c++)
                    assert_memory_equal(&tree->primitives[12 * (size_t)(leaf_first(leaf) + i) + 4 * c],
                                        &input->positions[3 * input->indices[3 * number + c]], 3 * sizeof(float));
        }
    }
    assert_int_equal(in_leaves, count);
    free(seen);
}

static bool box_contains(const struct decoded *box, const double lower[3], const double upper[3])
{
    for (int k = 0; k < 3; k++)
        if (!(box->lower[k] <= lower[k] && upper[k] <= box->upper[k]))
            return false;
    return true;
}

/* Padded, as the traversal's arithmetic needs it: by 8 units of rounding, of which a float's own takes one. */
static bool box_contains_padded(const struct decoded *box, const float lower[3], const float upper[3])
{
    const double pad = 7.0 / 8 * (double)BVH_PAD_RELATIVE;
    struct bvh_bound bound = bvh_bound_of_box(lower, upper);
    double low[3], high[3];
    for (int k = 0; k < 3; k++) {
        low[k] = fmin((double)bound.lower[k], (double)lower[k] - pad * fabs((double)lower[k]));
        high[k] = fmax((double)bound.upper[k], (double)upper[k] + pad * fabs((double)upper[k]));
    }
    return box_contains(box, low, high);
}

static bool sphere_contains(const struct decoded *sphere, const float point[3], float radius)
{
    double x = (double)point[0] - sphere->lower[0], y = (double)point[1] - sphere->lower[1];
    double z = (double)point[2] - sphere->lower[2];
    return sqrt(x * x + y * y + z * z) + (double)radius <= sphere->upper[0];
}

/* Whether a primitive lies within a bound. */
static bool bound_contains(const struct input *input, const struct decoded *bound, uint32_t number, bool is_sphere)
{
    if (input->spheres) {
        const float *s = &input->spheres[4 * (size_t)number];
        const float low[3] = {s[0] - s[3], s[1] - s[3], s[2] - s[3]},
                    high[3] = {s[0] + s[3], s[1] + s[3], s[2] + s[3]};
        return is_sphere ? sphere_contains(bound, s, s[3]) : box_contains_padded(bound, low, high);
    }
    for (uint32_t c = 0; c < 3; c++) {
        const float *v = &input->positions[3 * (size_t)input->indices[3 * (size_t)number + c]];
        if (is_sphere ? !sphere_contains(bound, v, 0) : !box_contains_padded(bound, v, v))
            return false;
    }
    return true;
}

/* Every bound contains the primitives of all leaves below it, and a box its children's boxes. */
static void expect_bounds_contain(const struct input *input, const struct bvh_tree *tree, const struct view *view,
                                  uint32_t octant)
{
    bool is_sphere = view->settings->spheres;
    for (uint32_t e = 0; e < view->count; e++) {
        const struct decoded bound = decode(view, octant, e);
        for (uint32_t below = e; below < bound.end; below++) {
            const struct decoded other = decode(view, octant, below);
            for (uint32_t i = 0; i < leaf_count(other.leaf); i++)
                if (!bound_contains(input, &bound, primitive_number(input, tree, leaf_first(other.leaf) + i),
                                    is_sphere))
                    fail_msg("octant %u: element %u does not contain a primitive of leaf %u", octant, e, below);
            if (!is_sphere && !box_contains(&bound, other.lower, other.upper))
                fail_msg("octant %u: box %u does not contain box %u", octant, e, below);
        }
    }
}

/* Traverses as the shader does, with every bound hit (or none); returns the steps. */
static uint32_t traverse(const struct view *view, uint32_t octant, bool hit, uint8_t *visited)
{
    uint32_t element = 0, steps = 0;
    while (element < view->count) {
        const struct decoded decoded = decode(view, octant, element);
        /* So no traversal is endless. */
        if (decoded.end <= element || decoded.end > view->count)
            fail_msg("octant %u: element %u leads to %u of %u", octant, element, decoded.end, view->count);
        steps++;
        visited[element]++;
        element = hit ? element + 1 : decoded.end;
    }
    return steps;
}

/* Links lead forward, stay within their parent's subtree, and no element is passed over. */
static void expect_links_right(const struct view *view, uint32_t octant)
{
    uint8_t *visited = calloc(view->count, 1);
    assert_int_equal(traverse(view, octant, true, visited), view->count);
    for (uint32_t e = 0; e < view->count; e++) {
        if (visited[e] != 1)
            fail_msg("octant %u: element %u is visited %u times", octant, e, visited[e]);
        const struct decoded parent = decode(view, octant, e);
        if (!parent.leaf && parent.end < e + 3)
            fail_msg("octant %u: inner element %u has less than two children", octant, e);
        uint32_t child = e + 1;
        while (child < parent.end)
            child = decode(view, octant, child).end;
        assert_int_equal(child, parent.end);
    }
    assert_int_equal(traverse(view, octant, false, visited), 1);
    free(visited);
}

/* An element without its place. */
struct placeless {
    double lower[3], upper[3];
    uint32_t leaf, subtree;
};

static int compare_placeless(const void *a, const void *b)
{
    return memcmp(a, b, sizeof(struct placeless));
}

static struct placeless *sorted_elements(const struct view *view, uint32_t octant)
{
    struct placeless *all = calloc(view->count, sizeof(*all));
    for (uint32_t e = 0; e < view->count; e++) {
        const struct decoded decoded = decode(view, octant, e);
        memcpy(all[e].lower, decoded.lower, sizeof(all[e].lower));
        memcpy(all[e].upper, decoded.upper, sizeof(all[e].upper));
        all[e].leaf = decoded.leaf;
        all[e].subtree = decoded.end - e;
    }
    qsort(all, view->count, sizeof(*all), compare_placeless);
    return all;
}

static void expect_copies_alike(const struct view *view)
{
    struct placeless *first = sorted_elements(view, 0);
    for (uint32_t octant = 1; octant < bvh_octants(view->settings); octant++) {
        struct placeless *other = sorted_elements(view, octant);
        assert_memory_equal(other, first, view->count * sizeof(*first));
        free(other);
    }
    free(first);
}

static void expect_sound_in_form(const struct input *input, const struct bvh_form *settings)
{
    struct bvh_tree tree = build(input, settings);
    const struct view view = view_of(&tree, settings);
    for (uint32_t octant = 0; octant < bvh_octants(settings); octant++) {
        expect_links_right(&view, octant);
        expect_each_primitive_once(input, &tree, &view, octant);
        expect_bounds_contain(input, &tree, &view, octant);
    }
    expect_copies_alike(&view);
    bvh_tree_finish(&tree);
}

/* ---- wide nodes ---- */

static const struct bvh_form of_wide = {.wide = true, .threads = 2};

struct wide_walk {
    const struct input *input;
    const struct bvh_tree *tree;
    uint8_t *is_seen; /* primitives */
    uint32_t nodes, deepest;
};

static uint32_t byte_of(const uint32_t *words, uint32_t slot)
{
    return words[slot / 4] >> slot % 4 * 8 & 0xff;
}

static struct decoded decode_slot(const struct bvh_wide_node *node, uint32_t slot)
{
    const float origin[3] = {node->origin_x, node->origin_y, node->origin_z};
    uint32_t planes[12];
    struct decoded box = {0};
    memcpy(planes, node->planes, sizeof(planes));
    for (uint32_t k = 0; k < 3; k++) {
        const double cell = ldexp(1, (int8_t)(node->exponents >> 8 * k));
        box.lower[k] = (double)origin[k] + cell * byte_of(planes + 2 * k, slot);
        box.upper[k] = (double)origin[k] + cell * byte_of(planes + 6 + 2 * k, slot);
    }
    return box;
}

/* Visits a node as a ray would that hits everything. All primitives below it lie within the `bounds` of the nodes
 * above; none was seen before. */
static void walk_wide(struct wide_walk *walk, uint32_t n, const struct decoded *bounds, uint32_t depth)
{
    assert_in_range(n, 0, walk->tree->element_count - 1);
    assert_in_range(depth, 1, BVH_WIDE_DEPTH_MAX);
    const struct bvh_wide_node *node = (const struct bvh_wide_node *)(const void *)walk->tree->elements + n;
    uint32_t child = node->first_child;
    const uint32_t meta_words[2] = {node->meta_0123, node->meta_4567};
    walk->nodes++;
    walk->deepest = depth > walk->deepest ? depth : walk->deepest;
    for (uint32_t slot = 0; slot < BVH_WIDE_SLOTS; slot++) {
        const uint32_t meta = byte_of(meta_words, slot), is_inner = node->exponents >> (24 + slot) & 1;
        struct decoded all[BVH_WIDE_DEPTH_MAX];
        if (meta == 0) {
            assert_int_equal(is_inner, 0);
            continue;
        }
        for (uint32_t i = 0; i + 1 < depth; i++)
            all[i] = bounds[i];
        all[depth - 1] = decode_slot(node, slot);
        if (is_inner) {
            assert_int_equal(meta, BVH_WIDE_INNER | (24 + slot));
            walk_wide(walk, child++, all, depth + 1);
            continue;
        }
        const uint32_t unary = meta >> 5, count = unary == 1 ? 1 : unary == 3 ? 2 : 3;
        assert_int_equal(unary, (1u << count) - 1);
        for (uint32_t i = 0; i < count; i++) {
            const uint32_t place = node->first_primitive + (meta & 31) + i;
            assert_in_range(place, 0, walk->input->shape.primitive_count - 1);
            const uint32_t number = primitive_number(walk->input, walk->tree, place);
            assert_in_range(number, 0, walk->input->shape.primitive_count - 1);
            assert_int_equal(walk->is_seen[number]++, 0);
            for (uint32_t d = 0; d < depth; d++)
                if (!bound_contains(walk->input, &all[d], number, false))
                    fail_msg("node %u, slot %u: primitive %u is not within level %u of %u", n, slot, number, d,
                             depth);
        }
    }
}

/* Every primitive is met once, within all boxes on the way to it; every node is. Returns the number of levels. */
static uint32_t expect_wide_sound(const struct input *input)
{
    struct bvh_tree tree = build(input, &of_wide);
    struct wide_walk walk = {input, &tree, calloc(input->shape.primitive_count, 1), 0, 0};
    walk_wide(&walk, 0, NULL, 1);
    assert_int_equal(walk.nodes, tree.element_count);
    for (uint32_t i = 0; i < input->shape.primitive_count; i++)
        assert_int_equal(walk.is_seen[i], 1);
    free(walk.is_seen);
    bvh_tree_finish(&tree);
    return walk.deepest;
}

static void expect_sound(const struct input *input)
{
    expect_wide_sound(input);
    for (size_t form = 0; form < COUNT(forms); form++)
        expect_sound_in_form(input, forms[form]);
}

TEST(a_tree_over_triangles_is_sound)
{
    static const uint32_t counts[] = {1, 2, 3, 9, 100, 3000};
    for (size_t i = 0; i < COUNT(counts); i++) {
        struct input input = triangles(counts[i], 10, 0.3f, (uint32_t)i + 1);
        expect_sound(&input);
        input_finish(&input);
    }
}

TEST(a_tree_over_spheres_is_sound)
{
    static const uint32_t counts[] = {1, 2, 500};
    for (size_t i = 0; i < COUNT(counts); i++) {
        struct input input = spheres(counts[i], (uint32_t)i + 1);
        expect_sound(&input);
        input_finish(&input);
    }
}

TEST(equal_triangles_are_split_without_end)
{
    struct input input = triangles(2000, 0, 1, 5);
    for (uint32_t i = 0; i < 6000; i++)
        input.indices[i] = i % 3;
    expect_sound(&input);
    input_finish(&input);
}

TEST(triangles_without_area_are_kept)
{
    struct input input = triangles(500, 3, 0, 6);
    expect_sound(&input);
    input_finish(&input);
}

static void scale_and_move(struct input *input, const float scale[3], const float offset[3])
{
    for (uint32_t i = 0; i < 9 * input->shape.primitive_count; i++)
        input->positions[i] = input->positions[i] * scale[i % 3] + offset[i % 3];
}

TEST(coordinates_at_the_end_of_the_range_do_no_harm)
{
    struct input input = triangles(300, 1, 0.1f, 7);
    scale_and_move(&input, (float[3]){1e38f, 1e38f, 1e38f}, (float[3]){0, 0, 0});
    /* Boxes alone: surfaces and extents are infinite, and so would the spheres be. */
    expect_sound_in_form(&input, &packed);
    expect_sound_in_form(&input, &whole);
    expect_wide_sound(&input);
    input_finish(&input);
}

TEST(flat_shapes_lie_within_their_grid)
{
    for (int axis = 0; axis < 3; axis++) {
        for (int offset = 0; offset < 3; offset++) {
            struct input input = triangles(300, 1, 0.1f, 20);
            float scale[3] = {1, 1, 1}, move[3] = {0, 0, 0};
            scale[axis] = 0;
            move[axis] = (float[3]){0, -1234.5f, 3e6f}[offset];
            scale_and_move(&input, scale, move);
            expect_sound(&input);
            input_finish(&input);
        }
    }
}

TEST(single_points_lie_within_their_grid)
{
    static const float points[][3] = {{0, 0, 0}, {1, -1, 1e-30f}, {-7e5f, 0.1f, 1e20f}, {1e-38f, -1e-40f, 0}};
    for (size_t i = 0; i < COUNT(points); i++) {
        struct input input = triangles(20, 0, 0, 21);
        scale_and_move(&input, (float[3]){0, 0, 0}, points[i]);
        expect_sound_in_form(&input, &packed);
        expect_sound_in_form(&input, &whole);
        expect_wide_sound(&input);
        input_finish(&input);
    }
}

/* Where a float is far coarser than a cell of the grid would be. */
TEST(shapes_far_from_the_origin_lie_within_their_grid)
{
    uint32_t seed = 22;
    for (uint32_t i = 0; i < 60; i++) {
        struct input input = triangles(40, 1, 0.1f, 23 + i);
        float scale[3], move[3];
        for (int k = 0; k < 3; k++) {
            scale[k] = ldexpf(uniform(&seed, 1, 2), (int)(random_bits(&seed) % 24) - 12);
            move[k] = uniform(&seed, -2e6f, 2e6f);
        }
        scale_and_move(&input, scale, move);
        expect_sound(&input);
        input_finish(&input);
    }
}

/* Promises of bvh_grid_over, for boxes of all sizes at all places: flat ones as wide as others are narrow. */
TEST(a_grid_holds_the_box_it_was_made_for)
{
    uint32_t seed = 24;
    for (uint32_t i = 0; i < 200000; i++) {
        float lower[3], upper[3];
        for (int k = 0; k < 3; k++) {
            float centre = ldexpf(uniform(&seed, -2, 2), (int)(random_bits(&seed) % 64) - 32);
            float half = i % 3 ? ldexpf(uniform(&seed, 0, 1), (int)(random_bits(&seed) % 64) - 32) : 0;
            lower[k] = centre - half;
            upper[k] = centre + half;
        }
        bvh_pad_box(lower, upper);
        struct bvh_grid grid = bvh_grid_over(lower, upper, 0);
        uint32_t cells[3][2];
        if (!bvh_grid_cells(&grid, lower, upper, cells))
            fail_msg("box %u, x %.9g .. %.9g, y %.9g .. %.9g, z %.9g .. %.9g lies outside of its grid", i,
                     (double)lower[0], (double)upper[0], (double)lower[1], (double)upper[1], (double)lower[2],
                     (double)upper[2]);
    }
}

TEST(an_evenly_fine_mesh_loses_nothing_to_its_grid)
{
    struct input input = triangles(5000, 10, 0.2f, 25);
    struct bvh_tree tree = build(&input, &packed);
    /* A triangle is some 800 cells across; two cells more are 0.5 % of a surface. */
    float cost = tree.grid_cost;
    assert_true(cost >= 1 && cost < 1.02f);
    bvh_tree_finish(&tree);
    tree = build(&input, &whole); /* says what a grid would cost it */
    assert_true(tree.grid_cost == cost);
    bvh_tree_finish(&tree);
    input_finish(&input);
}

TEST(fine_detail_in_a_large_extent_shows_in_the_cost_of_its_grid)
{
    struct input input = triangles(2002, 1, 0.05f, 26);
    for (uint32_t i = 0; i < 9 * 2000; i++)
        input.positions[i] *= 1e-3f; /* 1e-6 of the extent: all of it within one cell */
    for (uint32_t i = 9 * 2000; i < 9 * 2002; i++)
        input.positions[i] = i / 9 % 2 ? 1000.0f + (float)(i % 3) : -1000.0f - (float)(i % 5);
    struct bvh_tree tree = build(&input, &packed);
    /* Each of the 2000 is a hundredth of a cell; the grid makes it some 10^4 times as large. */
    assert_true(tree.grid_cost > 3.5f); /* each element counts 4 at most, and all but a few are lost in a cell */
    bvh_tree_finish(&tree);
    expect_sound(&input);
    input_finish(&input);
}

/* Each triangle on its own scale: every split takes off one, so the tree is as deep as it has primitives. */
TEST(a_tree_that_degenerates_to_a_list_is_built)
{
    struct input input = triangles(110, 0, 0, 8);
    for (uint32_t t = 0; t < 110; t++)
        for (uint32_t c = 0; c < 9; c++)
            input.positions[9 * t + c] = ldexpf(1.0f + 0.1f * (float)(c % 4), (int)t - 60);
    expect_sound(&input);
    input_finish(&input);
}

static void expect_same_by_any_threads(const struct input *input, const struct bvh_form *form)
{
    struct bvh_form settings = *form;
    settings.threads = 1;
    struct bvh_tree one = build(input, &settings);
    for (settings.threads = 2; settings.threads < 5; settings.threads++) {
        struct bvh_tree several = build(input, &settings);
        assert_int_equal(several.element_count, one.element_count);
        assert_memory_equal(several.elements, one.elements, one.element_count * bvh_element_bytes(&settings));
        assert_memory_equal(&several.grid, &one.grid, sizeof(one.grid));
        assert_int_equal(several.primitive_texels, one.primitive_texels);
        assert_memory_equal(several.primitives, one.primitives, one.primitive_texels * 4 * sizeof(float));
        bvh_tree_finish(&several);
    }
    const struct view view = view_of(&one, &settings);
    for (uint32_t octant = 0; octant < BVH_OCTANTS && !settings.wide; octant++) {
        expect_each_primitive_once(input, &one, &view, octant);
        expect_links_right(&view, octant);
    }
    bvh_tree_finish(&one);
}

TEST(the_tree_does_not_depend_on_the_threads)
{
    struct input input = triangles(BVH_THREADED_PRIMITIVES + 10000, 10, 0.05f, 9);
    expect_same_by_any_threads(&input, &packed);
    expect_same_by_any_threads(&input, &of_wide);
    input_finish(&input);
}

/* Whoever watches the thread that waits for it sees that it goes on: the longest part without a sign is that of
 * the first split, through all primitives once. */
TEST(a_large_tree_gives_signs_of_its_progress)
{
    struct input input = triangles(BVH_THREADED_PRIMITIVES + 10000, 10, 0.05f, 9);
    struct bvh_form settings = packed;
    for (settings.threads = 1; settings.threads < 3; settings.threads++) {
        uint64_t before = progress_reports();
        struct bvh_tree tree = build(&input, &settings);
        assert_in_range(progress_reports() - before, 10, UINT32_MAX);
        bvh_tree_finish(&tree);
    }
    input_finish(&input);
}

/* The leaf that octant `octant` meets first: its lowest corner on `axis`. */
static double first_leaf_corner(const struct view *view, uint32_t octant, int axis)
{
    uint32_t e = 0;
    while (decode(view, octant, e).leaf == 0)
        e++;
    return decode(view, octant, e).lower[axis];
}

TEST(each_octant_meets_the_near_side_first)
{
    for (uint32_t axis = 0; axis < 3; axis++) {
        struct input input = triangles(400, 1, 0.1f, 10);
        for (uint32_t i = axis; i < 3600; i += 3)
            input.positions[i] += i / 9 % 2 ? 50.0f : -50.0f;
        struct bvh_tree tree = build(&input, &packed);
        const struct view view = view_of(&tree, &packed);
        for (uint32_t octant = 0; octant < BVH_OCTANTS; octant++) {
            double corner = first_leaf_corner(&view, octant, (int)axis);
            bool goes_down = octant >> axis & 1;
            if (goes_down != (corner > 0))
                fail_msg("octant %u, axis %u: the first leaf begins at %g", octant, axis, corner);
        }
        bvh_tree_finish(&tree);
        input_finish(&input);
    }
}

TEST(elements_that_do_not_pay_are_thrown_back)
{
    struct input input = triangles(1000, 1, 2, 11); /* large and overlapping: halves are as big as the whole */
    struct bvh_tree tree = build(&input, &packed);
    const struct view view = view_of(&tree, &packed);
    uint32_t leaves = 0, widest = 0;
    for (uint32_t e = 0; e < tree.element_count; e++) {
        const struct decoded element = decode(&view, 0, e);
        uint32_t children = 0;
        for (uint32_t c = e + 1; c < element.end; c = decode(&view, 0, c).end)
            children++;
        widest = children > widest ? children : widest;
        leaves += element.leaf != 0;
    }
    assert_in_range(widest, 3, tree.element_count);
    assert_in_range(tree.element_count, leaves, 2 * leaves - 2); /* a binary tree has 2 leaves - 1 */
    bvh_tree_finish(&tree);
    input_finish(&input);
}

TEST(each_form_takes_the_bytes_it_promises)
{
    assert_int_equal(bvh_element_bytes(&packed), BVH_OCTANTS * sizeof(struct bvh_packed_element));
    assert_int_equal(bvh_element_bytes(&whole), BVH_OCTANTS * sizeof(struct bvh_element));
    assert_int_equal(bvh_element_bytes(&one_order), sizeof(struct bvh_packed_element));
    assert_int_equal(bvh_element_bytes(&of_spheres), sizeof(struct bvh_element));
    assert_int_equal(bvh_element_bytes(&of_wide), sizeof(struct bvh_wide_node));
}

/* Points at ever smaller distances, along one axis after the other: each cut takes one away, and a tree that
 * follows the cuts has more levels than a traversal remembers. */
TEST(wide_nodes_have_few_levels_however_a_shape_is_cut)
{
    struct input input = triangles(720, 0, 0, 27);
    for (uint32_t t = 0; t < 720; t++)
        for (uint32_t v = 3 * t; v < 3 * t + 3; v++)
            input.positions[3 * v + t / 240] = ldexpf(1, 120 - (int)(t % 240));
    expect_wide_sound(&input);
    input_finish(&input);
}

TEST(wide_nodes_take_a_fifth_of_the_memory_of_links)
{
    struct input input = triangles(20000, 10, 0.1f, 28);
    struct bvh_tree links = build(&input, &packed), wide = build(&input, &of_wide);
    const size_t of_links = links.element_count * bvh_element_bytes(&packed);
    const size_t of_nodes = wide.element_count * bvh_element_bytes(&of_wide);
    assert_in_range(of_nodes, 1, of_links / 5);
    assert_in_range(expect_wide_sound(&input), 4, 12);
    bvh_tree_finish(&links);
    bvh_tree_finish(&wide);
    input_finish(&input);
}

TEST(a_shape_without_primitives_is_refused)
{
    struct bvh_tree tree;
    struct error error = {0};
    assert_false(bvh_tree_plan(&tree, &(struct bvh_shape){0}, &(struct bvh_form){.threads = 1}, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    assert_null(tree.elements);
}

static bool run_jobs(struct bvh_job *jobs, uint32_t count, struct error *error)
{
    uint64_t end_ns;
    struct bvh_run *run = bvh_jobs_start(jobs, count, &packed, BVH_PLAN);
    assert_non_null(run);
    if (!bvh_jobs_finish(run, &end_ns, error))
        return false;
    for (uint32_t i = 0; i < count; i++) {
        assert_true(bvh_tree_alloc(&jobs[i].tree, &packed));
        jobs[i].elements = jobs[i].tree.elements;
        jobs[i].primitives = jobs[i].tree.primitives;
    }
    run = bvh_jobs_start(jobs, count, &packed, BVH_WRITE);
    assert_non_null(run);
    return bvh_jobs_finish(run, &end_ns, error);
}

TEST(several_shapes_are_built_together)
{
    struct input inputs[] = {triangles(40, 1, 0.1f, 13), triangles(BVH_THREADED_PRIMITIVES, 5, 0.1f, 14),
                             spheres(300, 15), triangles(1, 1, 1, 16)};
    struct bvh_job jobs[COUNT(inputs)];
    struct error error = {0};
    for (size_t i = 0; i < COUNT(inputs); i++)
        jobs[i].shape = inputs[i].shape;
    assert_true(run_jobs(jobs, COUNT(jobs), &error));
    for (size_t i = 0; i < COUNT(inputs); i++) {
        const struct view view = view_of(&jobs[i].tree, &packed);
        for (uint32_t octant = 0; octant < BVH_OCTANTS; octant++) {
            expect_each_primitive_once(&inputs[i], &jobs[i].tree, &view, octant);
            expect_links_right(&view, octant);
        }
        bvh_tree_finish(&jobs[i].tree);
        input_finish(&inputs[i]);
    }
    jobs[0].shape.primitive_count = 0;
    assert_false(run_jobs(jobs, 1, &error));
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

static uint32_t place_of(const struct bvh_top *top, uint32_t octant, uint32_t element)
{
    return top->baked.place ? top->baked.place[(size_t)octant * top->element_count + element] : element;
}

static bool top_element_contains(const struct view *view, const struct decoded *element,
                                 const struct bvh_world_box *box)
{
    if (!view->settings->spheres)
        return box_contains_padded(element, box->lower, box->upper);
    return sphere_contains(element, box->lower, 0) && sphere_contains(element, box->upper, 0);
}

static void expect_top_contains(const struct bvh_top *top, const struct bvh_world_box *boxes)
{
    const struct view view = {&top->settings, top->elements, top->element_count, &top->grid};
    for (uint32_t octant = 0; octant < bvh_octants(&top->settings); octant++) {
        expect_links_right(&view, octant);
        for (uint32_t i = 0; i < INSTANCES; i++) {
            uint32_t element = top->element_of[i];
            if (i == 7) {
                assert_int_equal(element, BVH_NONE);
                continue;
            }
            assert_int_equal(decode(&view, octant, place_of(top, octant, element)).leaf,
                             bvh_leaf(BVH_LEAF_INSTANCE, i, 1));
            uint32_t leaf_place = place_of(top, octant, element);
            for (; element != BVH_NONE; element = top->baked.parent[element]) {
                uint32_t place = place_of(top, octant, element);
                const struct decoded decoded = decode(&view, octant, place);
                assert_in_range(leaf_place, place, decoded.end - 1);
                if (!top_element_contains(&view, &decoded, &boxes[i]))
                    fail_msg("octant %u: element %u does not contain instance %u", octant, element, i);
            }
        }
    }
    expect_copies_alike(&view);
}

/* Elements that are not marked as moved are unchanged, in each copy. */
static void expect_rest_unchanged(const struct bvh_top *top, const uint8_t *before)
{
    size_t bytes = bvh_element_words(&top->settings) * sizeof(uint32_t);
    for (uint32_t octant = 0; octant < bvh_octants(&top->settings); octant++) {
        for (uint32_t e = 0; e < top->element_count; e++) {
            size_t at = ((size_t)octant * top->element_count + place_of(top, octant, e)) * bytes;
            if (!top->moved[e])
                assert_memory_equal((const uint8_t *)top->elements + at, before + at, bytes);
        }
    }
}

static void move_all_a_little(const struct bvh_form *settings)
{
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, settings));
    expect_top_contains(&top, boxes);
    size_t bytes = top.element_count * bvh_element_bytes(settings);
    uint8_t *before = malloc(bytes);
    for (uint32_t i = 0; i < INSTANCES; i++) {
        if (i == 7)
            continue;
        uint32_t depth = 0;
        for (uint32_t e = top.element_of[i]; e != BVH_NONE; e = top.baked.parent[e])
            depth++;
        boxes[i].lower[i % 3] -= 1.5f;
        boxes[i].upper[i % 3] -= 1.5f;
        memcpy(before, top.elements, bytes);
        assert_true(bvh_top_move(&top, i, &boxes[i]));
        assert_int_equal(bvh_top_refit(&top), depth);
        uint32_t marked = 0;
        for (uint32_t e = 0; e < top.element_count; e++)
            marked += top.moved[e];
        assert_int_equal(marked, depth);
        expect_rest_unchanged(&top, before);
        bvh_top_settle(&top);
        expect_top_contains(&top, boxes);
        assert_false(top.left_grid); /* they moved by a 30th of the extent */
    }
    assert_int_equal(bvh_top_refit(&top), 0);
    free(before);
    bvh_top_finish(&top);
}

TEST(a_moved_instance_refits_its_path_alone)
{
    for (size_t form = 0; form < COUNT(forms); form++)
        move_all_a_little(forms[form]);
}

static bool is_stale_after_move(struct bvh_top *top, uint32_t instance, struct bvh_world_box box, int axis,
                                float distance)
{
    box.lower[axis] += distance;
    box.upper[axis] += distance;
    assert_true(bvh_top_move(top, instance, &box));
    bvh_top_refit(top);
    bvh_top_settle(top);
    return bvh_top_is_stale(top);
}

/* The outermost to a side moves farther out. */
TEST(an_instance_that_leaves_the_grid_needs_a_new_top_tree)
{
    for (int side = 0; side < 6; side++) {
        struct bvh_world_box boxes[INSTANCES];
        struct bvh_top top;
        world_boxes(boxes);
        int axis = side % 3;
        float outward = side < 3 ? 1.0f : -1.0f;
        uint32_t outermost = 0;
        for (uint32_t i = 0; i < INSTANCES; i++)
            if (outward * boxes[i].lower[axis] > outward * boxes[outermost].lower[axis])
                outermost = i;
        assert_true(bvh_top_build(&top, boxes, INSTANCES, &packed));
        /* The extent is 40: a tenth of it is within the room that there is, all of it is not. */
        assert_false(is_stale_after_move(&top, outermost, boxes[outermost], axis, outward * 4));
        assert_true(is_stale_after_move(&top, outermost, boxes[outermost], axis, outward * 40));
        bvh_top_finish(&top);
        /* Not because of what it costs: without a grid the same tree is kept. */
        assert_true(bvh_top_build(&top, boxes, INSTANCES, &whole));
        assert_false(is_stale_after_move(&top, outermost, boxes[outermost], axis, outward * 40));
        bvh_top_finish(&top);
    }
}

/* An instance that overflows gets a box of all numbers (trace/bvh/tracer.c). A new tree would be no better. */
TEST(a_top_tree_over_an_endless_instance_is_not_stale_when_new)
{
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    for (int k = 0; k < 3; k++) {
        boxes[5].lower[k] = -FLT_MAX;
        boxes[5].upper[k] = FLT_MAX;
    }
    assert_true(bvh_top_build(&top, boxes, INSTANCES, &packed));
    assert_false(bvh_top_is_stale(&top));
    const struct view view = {&packed, top.elements, top.element_count, &top.grid};
    for (uint32_t octant = 0; octant < BVH_OCTANTS; octant++) {
        for (uint32_t i = 0; i < INSTANCES; i++) {
            if (i == 7)
                continue;
            double lower[3], upper[3];
            for (int k = 0; k < 3; k++) {
                lower[k] = (double)boxes[i].lower[k];
                upper[k] = (double)boxes[i].upper[k];
            }
            for (uint32_t e = top.element_of[i]; e != BVH_NONE; e = top.baked.parent[e]) {
                const struct decoded decoded = decode(&view, octant, place_of(&top, octant, e));
                assert_true(box_contains(&decoded, lower, upper));
            }
        }
    }
    bvh_top_finish(&top);
}

TEST(an_added_or_removed_instance_needs_a_new_top_tree)
{
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, &packed));
    assert_false(bvh_top_move(&top, 7, &boxes[8]));
    assert_false(bvh_top_move(&top, 8, &boxes[7]));
    assert_true(bvh_top_move(&top, 7, &boxes[7]));
    bvh_top_finish(&top);
}

TEST(a_top_tree_goes_stale_when_everything_has_moved_far)
{
    struct bvh_world_box boxes[INSTANCES];
    struct bvh_top top;
    world_boxes(boxes);
    assert_true(bvh_top_build(&top, boxes, INSTANCES, &packed));
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

TEST(a_top_tree_over_nothing_is_empty)
{
    struct bvh_top top;
    assert_true(bvh_top_build(&top, NULL, 0, &packed));
    assert_int_equal(top.element_count, 0);
    bvh_top_finish(&top);
    const struct bvh_world_box nothing = {{1, 1, 1}, {-1, -1, -1}};
    assert_true(bvh_top_build(&top, &nothing, 1, &of_spheres));
    assert_int_equal(top.element_count, 0);
    bvh_top_finish(&top);
}
