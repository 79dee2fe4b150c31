// SPDX-License-Identifier: MIT
// Builds the tree of one shape: its binary tree, elements and primitives.
#include "trace/tree/build.h"

#include "base/parallel.h"
#include "trace/tree/build_split.h"
#include "trace/tree/build_wide.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define CHUNK 16384u /* primitives that a thread takes at a time */
#define SURVEYED_ELEMENTS 4096u
#define GRID_COST_EACH_MAX 4.0f /* limit for each box: a few that are almost points are not typical */

/* Costs and leaf size. Measured on 146K triangles: leaves of up to 2, 4, 8 at costs of 0.5 to 2 change the time
 * of a ray by 3 %; this choice is the fastest by a little and has the fewest elements. */
static const struct bvh_costs costs = {.element = 1, .primitive = 0.5f, .leaf_max = BVH_LEAF_MAX};

/* Source of a tree's elements and primitives while they are written. */
struct bvh_draft {
    struct bvh_binary binary;
    struct bvh_baked baked;
    struct bvh_wide wide; /* empty: the tree has elements */
    float (*spheres)[4];  /* for each node of the binary tree: centre, radius; NULL with boxes */
};

struct work {
    struct bvh_tree *tree;
    struct bvh_draft *draft;
    const struct bvh_shape *shape;
    const struct bvh_form *settings;
    unsigned threads;
    struct bvh_box *boxes;
    uint32_t *elements;
    float *primitives;
};

static bool is_stopped(const struct work *work)
{
    return bvh_is_stopped(work->settings->stop);
}

static const float *corner_of(const struct bvh_shape *shape, const float *positions, uint32_t triangle,
                              unsigned corner)
{
    uint32_t floats = shape->position_floats ? shape->position_floats : 3;
    return positions + floats * (size_t)shape->indices[3 * (size_t)triangle + corner];
}

static const float *triangle_corner(const struct bvh_shape *shape, uint32_t triangle, unsigned corner)
{
    return corner_of(shape, shape->positions, triangle, corner);
}

static struct bvh_box triangle_box(const struct bvh_shape *shape, const float *positions, uint32_t triangle)
{
    struct bvh_box box = {{0}, {0}};
    const float *a = corner_of(shape, positions, triangle, 0), *b = corner_of(shape, positions, triangle, 1);
    const float *c = corner_of(shape, positions, triangle, 2);
    for (int i = 0; i < 3; i++) {
        float low = a[i] < b[i] ? a[i] : b[i], high = a[i] < b[i] ? b[i] : a[i];
        box.lower[i] = low < c[i] ? low : c[i];
        box.upper[i] = high > c[i] ? high : c[i];
    }
    return box;
}

static struct bvh_box primitive_box(const struct bvh_shape *shape, uint32_t primitive)
{
    struct bvh_box box;
    if (shape->centres_radii) {
        const float *s = shape->centres_radii + 4 * (size_t)primitive;
        box.lower = (bvh_vec4){s[0] - s[3], s[1] - s[3], s[2] - s[3], 0};
        box.upper = (bvh_vec4){s[0] + s[3], s[1] + s[3], s[2] + s[3], 0};
        return box;
    }
    box = triangle_box(shape, shape->positions, primitive);
    if (shape->positions_close) {
        const struct bvh_box close = triangle_box(shape, shape->positions_close, primitive);
        bvh_box_add(&box, &close);
    }
    return box;
}

static void chunk_boxes(void *context, uint32_t chunk)
{
    struct work *work = context;
    uint32_t begin = chunk * CHUNK, end = begin + CHUNK;
    if (is_stopped(work))
        return;
    if (end > work->shape->primitive_count)
        end = work->shape->primitive_count;
    for (uint32_t i = begin; i < end; i++)
        work->boxes[i] = primitive_box(work->shape, i);
}

static void write_triangle(const struct bvh_shape *shape, const float *positions, uint32_t number, float *out)
{
    for (unsigned corner = 0; corner < 3; corner++) {
        memcpy(out + 4 * corner, corner_of(shape, positions, number, corner), 3 * sizeof(*out));
        out[4 * corner + 3] = 0;
    }
    memcpy(out + 3, &number, sizeof(number));
}

/* Writes primitives for the shader, in the order of the leaves. */
static void chunk_primitives(void *context, uint32_t chunk)
{
    struct work *work = context;
    const struct bvh_shape *shape = work->shape;
    uint32_t begin = chunk * CHUNK, end = begin + CHUNK;
    if (is_stopped(work))
        return;
    if (end > shape->primitive_count)
        end = shape->primitive_count;
    for (uint32_t i = begin; i < end; i++) {
        uint32_t number = work->draft->binary.order[i];
        if (shape->centres_radii) {
            float *out = work->primitives + (size_t)i * 4 * BVH_SPHERE_TEXELS;
            memcpy(out, shape->centres_radii + 4 * (size_t)number, 4 * sizeof(*out));
            memset(out + 4, 0, 4 * sizeof(*out));
            memcpy(out + 4, &number, sizeof(number));
            continue;
        }
        float *out = work->primitives + (size_t)i * 4 * BVH_TRIANGLE_TEXELS;
        write_triangle(shape, shape->positions, number, out);
        if (shape->deforms)
            write_triangle(shape, shape->positions_close ? shape->positions_close : shape->positions, number,
                           out + (size_t)shape->primitive_count * 4 * BVH_TRIANGLE_TEXELS);
    }
}

/* ---- bounding spheres ---- */

static float distance(const float a[3], const float b[3])
{
    float x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrtf(x * x + y * y + z * z);
}

static float leaf_radius(const struct work *work, const struct bvh_binary_node *node, const float centre[3])
{
    const struct bvh_shape *shape = work->shape;
    float radius = 0;
    for (uint32_t i = 0; i < node->count_axis >> 2; i++) {
        uint32_t number = work->draft->binary.order[node->link + i];
        if (shape->centres_radii) {
            const float *s = shape->centres_radii + 4 * (size_t)number;
            radius = fmaxf(radius, distance(centre, s) + s[3]);
        } else {
            for (unsigned corner = 0; corner < 3; corner++) {
                radius = fmaxf(radius, distance(centre, triangle_corner(shape, number, corner)));
                if (shape->positions_close)
                    radius =
                        fmaxf(radius, distance(centre, corner_of(shape, shape->positions_close, number, corner)));
            }
        }
    }
    return radius;
}

/* Makes a sphere for each node, about the centre of its box: tight for leaves, above them the smaller of the
 * box's sphere and the one round the two children's spheres. Children come after their parent, hence backwards. */
static bool make_spheres(struct work *work)
{
    const struct bvh_binary_node *nodes = work->draft->binary.nodes;
    uint32_t count = work->draft->binary.node_count;
    uint32_t *order = bvh_binary_list(&work->draft->binary);
    work->draft->spheres = malloc((size_t)work->draft->binary.place_count * sizeof(*work->draft->spheres));
    if (!order || !work->draft->spheres) {
        free(order);
        return false;
    }
    while (count-- > 0) {
        const struct bvh_binary_node *node = &nodes[order[count]];
        float *sphere = work->draft->spheres[order[count]];
        for (int axis = 0; axis < 3; axis++)
            sphere[axis] = 0.5f * node->lower[axis] + 0.5f * node->upper[axis];
        sphere[3] = distance(sphere, node->upper);
        float other;
        if (node->count_axis >> 2 > 0) {
            other = leaf_radius(work, node, sphere);
        } else {
            const float *left = work->draft->spheres[node->link], *right = work->draft->spheres[node->link + 1];
            other = fmaxf(distance(sphere, left) + left[3], distance(sphere, right) + right[3]);
        }
        /* Margin for the few roundings of each sum above. */
        sphere[3] = fminf(sphere[3], other) * (1 + 0x1p-21f);
        work->draft->binary.areas[order[count]] = sphere[3] * sphere[3]; /* surface, up to a factor */
    }
    free(order);
    return true;
}

/* ---- elements ---- */

static struct bvh_bound bound_of(const struct work *work, uint32_t n)
{
    const struct bvh_binary_node *node = &work->draft->binary.nodes[n];
    if (work->draft->spheres)
        return bvh_bound_of_sphere(work->draft->spheres[n], work->draft->spheres[n][3]);
    return bvh_bound_of_box(node->lower, node->upper);
}

static uint32_t leaf_kind(const struct bvh_shape *shape)
{
    return shape->centres_radii ? BVH_LEAF_SPHERES : BVH_LEAF_TRIANGLES;
}

/* Link of a leaf; 0: an inner element. */
static uint32_t leaf_of(const struct work *work, uint32_t e)
{
    const struct bvh_draft *draft = work->draft;
    if (work->settings->wide)
        return draft->wide.link[e] >> BVH_LEAF_KIND_SHIFT != 0 ? draft->wide.link[e] : 0;
    const struct bvh_binary_node *node = &draft->binary.nodes[draft->baked.node[e]];
    const uint32_t count = node->count_axis >> 2;
    return count > 0 ? bvh_leaf(leaf_kind(work->shape), node->link, count) : 0;
}

static void write_element(const struct work *work, uint32_t e)
{
    const struct bvh_draft *draft = work->draft;
    if (work->settings->wide) {
        bvh_wide_write((struct bvh_wide_node *)(void *)work->elements + e, e, &draft->wide, &draft->baked,
                       &draft->binary);
        return;
    }
    const struct bvh_bound bound = bound_of(work, draft->baked.node[e]);
    bvh_write_element(work->elements, work->settings, &draft->baked, &work->tree->grid, e, &bound,
                      leaf_of(work, e));
}

static void chunk_elements(void *context, uint32_t chunk)
{
    struct work *work = context;
    uint32_t begin = chunk * CHUNK, end = begin + CHUNK;
    if (is_stopped(work))
        return;
    if (end > work->tree->element_count)
        end = work->tree->element_count;
    for (uint32_t e = begin; e < end; e++)
        write_element(work, e);
}

/* Finds statistics of the tree from a sample of its elements. The grid's cost is the mean over elements, each
 * with the same weight however small it is: the camera is usually where the detail is. */
static void survey(struct work *work)
{
    const struct bvh_baked *baked = &work->draft->baked;
    struct bvh_tree *tree = work->tree;
    bool has_grid = !work->settings->spheres && !work->settings->wide;
    uint32_t step = baked->element_count / SURVEYED_ELEMENTS + 1, count = 0, leaf_count = 0;
    float cost_sum = 0, extent_sum = 0;
    for (uint32_t e = 0; e < baked->element_count; e += step, count++) {
        const struct bvh_binary_node *node = &work->draft->binary.nodes[baked->node[e]];
        if (leaf_of(work, e) != 0) {
            extent_sum += distance(node->lower, node->upper);
            leaf_count++;
        }
        if (!has_grid)
            continue;
        struct bvh_bound bound = bvh_bound_of_box(node->lower, node->upper);
        uint32_t cells[3][2];
        bvh_grid_cells(&tree->grid, bound.lower, bound.upper, cells);
        float cost = bvh_grid_area(&tree->grid, cells) / bvh_box_area(bound.lower, bound.upper);
        /* NaN where surfaces are 0 or overflow. */
        cost_sum += cost > 1 ? fminf(cost, GRID_COST_EACH_MAX) : 1;
    }
    tree->grid_cost = has_grid ? cost_sum / (float)count : 1;
    tree->leaf_extent = leaf_count > 0 ? extent_sum / (float)leaf_count : 0;
}

static float tree_wear(const struct work *work)
{
    double boxes = 0, primitives = 0;
    for (uint32_t e = 0; e < work->draft->baked.element_count; e++) {
        const struct bvh_binary_node *node = &work->draft->binary.nodes[work->draft->baked.node[e]];
        boxes += (double)bvh_box_area(node->lower, node->upper);
    }
    for (uint32_t i = 0; i < work->shape->primitive_count; i++) {
        const struct bvh_box box = primitive_box(work->shape, i);
        primitives += (double)bvh_box_area((const float *)&box.lower, (const float *)&box.upper);
    }
    return primitives > 0 ? (float)(boxes / primitives) : 0;
}

static bool list_corners(struct work *work)
{
    const struct bvh_shape *shape = work->shape;
    struct bvh_refit_plan *plan = &work->tree->plan;
    plan->triangle_count = shape->primitive_count;
    plan->corners = malloc(shape->primitive_count * 4 * sizeof(*plan->corners));
    for (uint32_t i = 0; plan->corners && i < shape->primitive_count; i++) {
        uint32_t number = work->draft->binary.order[i];
        memcpy(plan->corners + 4 * (size_t)i, shape->indices + 3 * (size_t)number, 3 * sizeof(*plan->corners));
        plan->corners[4 * (size_t)i + 3] = number;
    }
    return plan->corners != NULL;
}

static bool make_plan(struct work *work)
{
    const struct bvh_baked *baked = &work->draft->baked;
    uint32_t *leaves = calloc(baked->element_count, sizeof(*leaves));
    bool ok = leaves != NULL;
    for (uint32_t e = 0; ok && e < baked->element_count; e++)
        leaves[e] = leaf_of(work, e);
    ok = ok && bvh_refit_plan_make(&work->tree->plan, baked, leaves);
    struct bvh_refit_plan *plan = &work->tree->plan;
    for (uint32_t i = plan->leaf_count; ok && work->settings->wide && i < plan->record_count; i++)
        plan->records[i].places_0123[0] = work->draft->wide.link[plan->records[i].element];
    free(leaves);
    work->tree->wear = tree_wear(work);
    return ok && (plan->record_count == 0 || list_corners(work));
}

static uint32_t chunk_count(uint32_t count)
{
    return count / CHUNK + (count % CHUNK > 0);
}

static bool build_binary(struct work *work, const struct bvh_costs *by)
{
    const uint32_t count = work->shape->primitive_count;
    work->boxes = aligned_alloc(32, 2 * (size_t)count * sizeof(*work->boxes));
    if (!work->boxes)
        return false;
    parallel_run(work->threads, chunk_count(count), chunk_boxes, work);
    const bool ok = !is_stopped(work) && bvh_binary_build(&work->draft->binary, work->boxes, count, by,
                                                          work->threads, work->settings->stop);
    free(work->boxes);
    return ok;
}

static size_t bvh_primitive_texels(const struct bvh_shape *shape)
{
    const size_t each = shape->centres_radii ? BVH_SPHERE_TEXELS : BVH_TRIANGLE_TEXELS;
    return shape->primitive_count * each * (shape->deforms ? 2 : 1);
}

static bool make_elements(struct work *work)
{
    struct bvh_draft *draft = work->draft;
    if (!build_binary(work, &costs) || (work->settings->spheres && !make_spheres(work)) || is_stopped(work) ||
        !bvh_bake(&draft->baked, &draft->binary, draft->binary.areas, bvh_octants(work->settings), work->threads))
        return false;
    work->tree->element_count = draft->baked.element_count;
    return true;
}

static bool make_wide_nodes(struct work *work)
{
    struct bvh_draft *draft = work->draft;
    const struct bvh_costs halves = {.leaf_max = 1, .halves = true};
    enum bvh_wide_result result = BVH_WIDE_TOO_DEEP;
    for (unsigned turn = 0; turn < 2 && result == BVH_WIDE_TOO_DEEP; turn++) {
        bvh_binary_finish(&draft->binary);
        if (!build_binary(work, turn == 0 ? &bvh_wide_costs : &halves) || is_stopped(work))
            return false;
        result = bvh_wide_make(&draft->wide, &draft->baked, &draft->binary, leaf_kind(work->shape));
    }
    work->tree->element_count = draft->wide.node_count;
    return result == BVH_WIDE_MADE;
}

static bool plan(struct work *work)
{
    struct bvh_tree *tree = work->tree;
    struct bvh_draft *draft = work->draft;
    if (!draft || !(work->settings->wide ? make_wide_nodes(work) : make_elements(work)))
        return false;
    memcpy(tree->lower, draft->binary.nodes[0].lower, sizeof(tree->lower));
    memcpy(tree->upper, draft->binary.nodes[0].upper, sizeof(tree->upper));
    bvh_pad_box(tree->lower, tree->upper);
    tree->grid = bvh_grid_over(tree->lower, tree->upper, 0);
    survey(work);
    tree->primitive_texels = bvh_primitive_texels(work->shape);
    if (is_stopped(work))
        return false;
    return !work->shape->deforms || make_plan(work);
}

static void free_draft(struct bvh_tree *tree)
{
    if (!tree->draft)
        return;
    free(tree->draft->spheres);
    bvh_binary_finish(&tree->draft->binary);
    bvh_baked_finish(&tree->draft->baked);
    bvh_wide_finish(&tree->draft->wide);
    free(tree->draft);
    tree->draft = NULL;
}

static unsigned threads_of(const struct bvh_shape *shape, const struct bvh_form *settings)
{
    return shape->primitive_count >= BVH_THREADED_PRIMITIVES && settings->threads > 1 ? settings->threads : 1;
}

bool bvh_tree_plan(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                   struct error *error)
{
    *tree = (struct bvh_tree){0};
    if (shape->primitive_count == 0 || shape->primitive_count > BVH_LEAF_FIRST_MASK)
        return error_set(error, ERROR_LIMIT, NULL, "a tree holds 1 to %u primitives, not %u", BVH_LEAF_FIRST_MASK,
                         shape->primitive_count);
    tree->draft = calloc(1, sizeof(*tree->draft));
    struct work work = {.tree = tree,
                        .draft = tree->draft,
                        .shape = shape,
                        .settings = settings,
                        .threads = threads_of(shape, settings)};
    if (plan(&work))
        return true;
    bvh_tree_finish(tree);
    return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the tree over %u primitives",
                     shape->primitive_count);
}

/* Writes a chunk of either array, as if they were one list. */
static void chunk_of_either(void *context, uint32_t chunk)
{
    const struct work *work = context;
    const uint32_t primitive_chunks = chunk_count(work->shape->primitive_count);
    if (chunk < primitive_chunks)
        chunk_primitives(context, chunk);
    else
        chunk_elements(context, chunk - primitive_chunks);
}

void bvh_tree_write(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                    uint32_t *elements, float *primitives)
{
    struct work work = {.tree = tree,
                        .draft = tree->draft,
                        .shape = shape,
                        .settings = settings,
                        .threads = threads_of(shape, settings),
                        .elements = elements,
                        .primitives = primitives};
    parallel_run(work.threads, chunk_count(shape->primitive_count) + chunk_count(tree->element_count),
                 chunk_of_either, &work);
    free_draft(tree);
}

bool bvh_tree_alloc(struct bvh_tree *tree, const struct bvh_form *settings)
{
    tree->elements = malloc(tree->element_count * bvh_element_bytes(settings));
    tree->primitives = malloc(tree->primitive_texels * 4 * sizeof(float));
    return tree->elements && tree->primitives;
}

void bvh_tree_finish(struct bvh_tree *tree)
{
    free_draft(tree);
    free(tree->elements);
    free(tree->primitives);
    bvh_refit_plan_finish(&tree->plan);
    *tree = (struct bvh_tree){0};
}
