// SPDX-License-Identifier: MIT
// The tree over the instances: its build, and refits where they move.
#include "trace/tree/build_top.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A refitted tree is kept until its surface area cost has doubled. */
#define STALE_FACTOR 2.0f
/* Distance, as a share of the whole extent, by which instances may move outward before they need a new grid and
 * hence a new tree. */
#define GRID_ROOM 0.25f

static const struct bvh_costs costs = {.element = 1, .primitive = 1, .leaf_max = 1};

static bool box_is_empty(const struct bvh_world_box *box)
{
    return !(box->lower[0] <= box->upper[0] && box->lower[1] <= box->upper[1] && box->lower[2] <= box->upper[2]);
}

void bvh_world_box_include(struct bvh_world_box *box, const struct bvh_world_box *other)
{
    for (int i = 0; i < 3; i++) {
        box->lower[i] = fminf(box->lower[i], other->lower[i]);
        box->upper[i] = fmaxf(box->upper[i], other->upper[i]);
    }
}

static void set_element(struct bvh_top *top, uint32_t e)
{
    const struct bvh_world_box *box = &top->boxes[e];
    struct bvh_bound bound;
    if (!top->settings.spheres) {
        bound = bvh_bound_of_box(box->lower, box->upper);
        uint32_t cells[3][2];
        top->left_grid = top->left_grid || (bvh_is_packed(&top->settings) &&
                                            !bvh_grid_cells(&top->grid, bound.lower, bound.upper, cells));
    } else {
        float centre[3], squared = 0;
        for (int i = 0; i < 3; i++) {
            float half = 0.5f * box->upper[i] - 0.5f * box->lower[i];
            centre[i] = 0.5f * box->lower[i] + 0.5f * box->upper[i];
            squared += half * half;
        }
        bound = bvh_bound_of_sphere(centre, sqrtf(squared));
    }
    bvh_write_element(top->elements, &top->settings, &top->baked, &top->grid, e, &bound, top->leaves[e]);
}

/* Sum of the surfaces of all elements over that of the root: the number of tests of a ray through the root. */
static float tree_cost(const struct bvh_top *top)
{
    float sum = 0;
    for (uint32_t e = 0; e < top->element_count; e++)
        sum += bvh_box_area(top->boxes[e].lower, top->boxes[e].upper);
    float root = bvh_box_area(top->boxes[0].lower, top->boxes[0].upper);
    return root > 0 ? sum / root : 0;
}

static bool top_alloc(struct bvh_top *top)
{
    uint32_t count = top->element_count;
    top->elements = calloc(count, bvh_element_bytes(&top->settings));
    top->boxes = malloc(count * sizeof(*top->boxes));
    top->leaves = calloc(count, sizeof(*top->leaves));
    top->moved = calloc(count, sizeof(*top->moved));
    return top->elements && top->boxes && top->leaves && top->moved;
}

/* instances[i]: the instance of primitive i of the binary tree. */
static void fill_elements(struct bvh_top *top, const struct bvh_binary *binary, const uint32_t *instances)
{
    const struct bvh_bound root = bvh_bound_of_box(binary->nodes[0].lower, binary->nodes[0].upper);
    top->grid = bvh_grid_over(root.lower, root.upper, GRID_ROOM);
    for (uint32_t e = 0; e < top->element_count; e++) {
        const struct bvh_binary_node *node = &binary->nodes[top->baked.node[e]];
        memcpy(top->boxes[e].lower, node->lower, sizeof(node->lower));
        memcpy(top->boxes[e].upper, node->upper, sizeof(node->upper));
        if (node->count_axis >> 2 > 0) {
            uint32_t instance = instances[binary->order[node->link]];
            top->leaves[e] = bvh_leaf(BVH_LEAF_INSTANCE, instance, 1);
            top->element_of[instance] = e;
        }
        set_element(top, e);
    }
    top->left_grid = false; /* a box that overflows lies outside the grid, and would do so in a new tree */
}

static bool bake_top(struct bvh_top *top, const struct bvh_binary *binary)
{
    bool ok = bvh_bake(&top->baked, binary, binary->areas, bvh_octants(&top->settings), 1);
    top->element_count = top->baked.element_count;
    return ok;
}

static uint32_t collect(const struct bvh_world_box *boxes, uint32_t count, struct bvh_box *filled,
                        uint32_t *instances)
{
    uint32_t filled_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        const struct bvh_world_box *b = &boxes[i];
        if (box_is_empty(b))
            continue;
        filled[filled_count].lower = (bvh_vec4){b->lower[0], b->lower[1], b->lower[2], 0};
        filled[filled_count].upper = (bvh_vec4){b->upper[0], b->upper[1], b->upper[2], 0};
        instances[filled_count++] = i;
    }
    return filled_count;
}

bool bvh_top_build(struct bvh_top *top, const struct bvh_world_box *boxes, uint32_t count,
                   const struct bvh_form *settings)
{
    *top = (struct bvh_top){.instance_count = count, .settings = *settings};
    if (count == 0)
        return true;
    struct bvh_binary binary = {0};
    struct bvh_box *filled = aligned_alloc(32, 2 * (size_t)count * sizeof(*filled));
    uint32_t *instances = malloc(count * sizeof(*instances));
    top->element_of = malloc(count * sizeof(*top->element_of));
    bool ok = filled && instances && top->element_of;
    uint32_t filled_count = ok ? collect(boxes, count, filled, instances) : 0;
    for (uint32_t i = 0; ok && i < count; i++)
        top->element_of[i] = BVH_NONE;
    if (filled_count > 0) {
        ok = bvh_binary_build(&binary, filled, filled_count, &costs, 1, NULL) && bake_top(top, &binary) &&
             top_alloc(top);
        if (ok) {
            fill_elements(top, &binary, instances);
            top->built_cost = tree_cost(top);
        }
    }
    free(filled);
    free(instances);
    bvh_binary_finish(&binary);
    if (!ok)
        bvh_top_finish(top);
    return ok;
}

void bvh_top_finish(struct bvh_top *top)
{
    free(top->elements);
    free(top->boxes);
    free(top->leaves);
    free(top->element_of);
    free(top->moved);
    bvh_baked_finish(&top->baked);
    *top = (struct bvh_top){0};
}

bool bvh_top_move(struct bvh_top *top, uint32_t instance, const struct bvh_world_box *box)
{
    uint32_t element = top->element_of[instance];
    bool is_there = element != BVH_NONE;
    if (is_there == box_is_empty(box))
        return false;
    if (!is_there || memcmp(&top->boxes[element], box, sizeof(*box)) == 0)
        return true;
    top->boxes[element] = *box;
    for (; element != BVH_NONE && !top->moved[element]; element = top->baked.parent[element])
        top->moved[element] = true;
    return true;
}

uint32_t bvh_top_refit(struct bvh_top *top)
{
    uint32_t refitted = 0;
    /* Children come after their parent, hence backwards. */
    for (uint32_t e = top->element_count; e-- > 0;) {
        if (!top->moved[e])
            continue;
        uint32_t end = e + top->baked.size[e];
        if (end > e + 1)
            top->boxes[e] = top->boxes[e + 1];
        for (uint32_t child = e + 1; child < end; child += top->baked.size[child])
            bvh_world_box_include(&top->boxes[e], &top->boxes[child]);
        set_element(top, e);
        refitted++;
    }
    return refitted;
}

void bvh_top_settle(struct bvh_top *top)
{
    if (top->moved)
        memset(top->moved, 0, top->element_count * sizeof(*top->moved));
}

bool bvh_top_is_stale(const struct bvh_top *top)
{
    return top->left_grid || (top->element_count > 0 && tree_cost(top) > STALE_FACTOR * top->built_cost);
}
