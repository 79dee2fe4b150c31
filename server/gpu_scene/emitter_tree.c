/* SPDX-License-Identifier: MIT */
/* Builds and refits the tree over emitters, split by power and orientation. */
#include "gpu_scene/emitter_tree.h"

#include "gpu_scene/unit_vector.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BINS 12u
#define HALF_PI 1.57079632679489662f

static float dot3(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- bounds ---- */

/* Angle from an axis to the farthest normal of a cone. */
static float reach_of(const float axis[3], const struct emitter_bounds *cone)
{
    return acosf(fminf(fabsf(dot3(axis, cone->axis)), 1.0f)) + cone->spread;
}

static void unite_cones(struct emitter_bounds *sum, const struct emitter_bounds *a, const struct emitter_bounds *b)
{
    const float side = dot3(a->axis, b->axis) < 0.0f ? -1.0f : 1.0f;
    for (int k = 0; k < 3; k++)
        sum->axis[k] = a->power * a->axis[k] + side * b->power * b->axis[k];
    float length = sqrtf(dot3(sum->axis, sum->axis));
    if (!(length > 0.0f) || !isfinite(length)) {
        memcpy(sum->axis, a->axis, sizeof(sum->axis));
        length = 1.0f;
    }
    for (int k = 0; k < 3; k++)
        sum->axis[k] /= length;
    sum->spread = fminf(fmaxf(reach_of(sum->axis, a), reach_of(sum->axis, b)), HALF_PI);
}

struct emitter_bounds emitter_bounds_union(const struct emitter_bounds *a, const struct emitter_bounds *b)
{
    if (!(b->power > 0.0f))
        return *a;
    if (!(a->power > 0.0f))
        return *b;
    struct emitter_bounds sum = {.power = a->power + b->power};
    for (int k = 0; k < 3; k++) {
        sum.lower[k] = fminf(a->lower[k], b->lower[k]);
        sum.upper[k] = fmaxf(a->upper[k], b->upper[k]);
    }
    unite_cones(&sum, a, b);
    return sum;
}

/* Integral over the directions that the normals of a cone shine to, weighted by the cosine. */
static float orientation_cost(float spread)
{
    const float far = fminf(spread + HALF_PI, 2.0f * HALF_PI), sine = sinf(spread), cosine = cosf(spread);
    return 4.0f * HALF_PI * (1.0f - cosine) +
           HALF_PI * (2.0f * far * sine - cosf(spread - 2.0f * far) - 2.0f * spread * sine + cosine);
}

/* Bounds with a sum of axes times power in place of a cone: splits are compared by means, which are quick to
 * add. */
struct rough_bounds {
    float lower[3], upper[3], axes[3], power;
};

static void add_rough(struct rough_bounds *sum, const float lower[3], const float upper[3], const float axes[3],
                      float power)
{
    if (!(power > 0.0f))
        return;
    const bool first = !(sum->power > 0.0f);
    const float side = dot3(sum->axes, axes) < 0.0f ? -1.0f : 1.0f;
    for (int k = 0; k < 3; k++) {
        sum->lower[k] = first || lower[k] < sum->lower[k] ? lower[k] : sum->lower[k];
        sum->upper[k] = first || upper[k] > sum->upper[k] ? upper[k] : sum->upper[k];
        sum->axes[k] += side * axes[k];
    }
    sum->power += power;
}

static void add_leaf(struct rough_bounds *sum, const struct emitter_bounds *leaf)
{
    const float weight = leaf->power * cosf(leaf->spread);
    const float axes[3] = {weight * leaf->axis[0], weight * leaf->axis[1], weight * leaf->axis[2]};
    add_rough(sum, leaf->lower, leaf->upper, axes, leaf->power);
}

static void add_bin(struct rough_bounds *sum, const struct rough_bounds *bin)
{
    add_rough(sum, bin->lower, bin->upper, bin->axes, bin->power);
}

static float cost_of(const struct rough_bounds *bounds)
{
    if (!(bounds->power > 0.0f))
        return 0.0f;
    const float x = bounds->upper[0] - bounds->lower[0], y = bounds->upper[1] - bounds->lower[1],
                z = bounds->upper[2] - bounds->lower[2];
    const float mean = sqrtf(dot3(bounds->axes, bounds->axes)) / bounds->power;
    /* The square of the diagonal is added, as flat or linear bounds have no surface. */
    return bounds->power * (x * y + y * z + z * x + x * x + y * y + z * z) *
           orientation_cost(acosf(fminf(mean, 1.0f)));
}

/* ---- the tree ---- */

struct build {
    const struct emitter_bounds *leaves;
    uint32_t *order, *scratch; /* leaves in the order of the tree */
    struct emitter_node *nodes;
    uint32_t node_count;
    uint32_t *trails;
};

static float middle_of(const struct emitter_bounds *bounds, int axis)
{
    return 0.5f * bounds->lower[axis] + 0.5f * bounds->upper[axis];
}

static void centre_range(const struct build *build, uint32_t first, uint32_t count, int axis, float range[2])
{
    range[0] = FLT_MAX;
    range[1] = -FLT_MAX;
    for (uint32_t i = first; i < first + count; i++) {
        const float middle = middle_of(&build->leaves[build->order[i]], axis);
        range[0] = fminf(range[0], middle);
        range[1] = fmaxf(range[1], middle);
    }
}

static uint32_t bin_of(float middle, const float range[2])
{
    const float place = (middle - range[0]) / (range[1] - range[0]) * (float)BINS;
    return place > 0.0f ? (place < (float)BINS ? (uint32_t)place : BINS - 1) : 0;
}

struct split {
    float cost;
    int axis;
    uint32_t bin; /* first bin of the second child */
    float range[2];
};

static void try_axis(const struct build *build, uint32_t first, uint32_t count, int axis, struct split *best)
{
    struct rough_bounds bins[BINS] = {0}, after[BINS] = {0}, before = {0};
    uint32_t counts[BINS] = {0}, counted = 0;
    float range[2];
    centre_range(build, first, count, axis, range);
    if (!(range[1] > range[0]) || !isfinite(range[1] - range[0]))
        return;
    for (uint32_t i = first; i < first + count; i++) {
        const struct emitter_bounds *leaf = &build->leaves[build->order[i]];
        const uint32_t bin = bin_of(middle_of(leaf, axis), range);
        add_leaf(&bins[bin], leaf);
        counts[bin]++;
    }
    after[BINS - 1] = bins[BINS - 1];
    for (uint32_t b = BINS - 1; b-- > 0;) {
        after[b] = after[b + 1];
        add_bin(&after[b], &bins[b]);
    }
    for (uint32_t b = 1; b < BINS; b++) {
        add_bin(&before, &bins[b - 1]);
        counted += counts[b - 1];
        const float cost = cost_of(&before) + cost_of(&after[b]);
        if (counted > 0 && counted < count && cost < best->cost)
            *best = (struct split){.cost = cost, .axis = axis, .bin = b, .range = {range[0], range[1]}};
    }
}

/* Moves the leaves of the first child to the front; returns their number. */
static uint32_t divide(struct build *build, uint32_t first, uint32_t count, const struct split *split)
{
    uint32_t before = 0, behind = 0;
    for (uint32_t i = first; i < first + count; i++) {
        const uint32_t leaf = build->order[i];
        if (bin_of(middle_of(&build->leaves[leaf], split->axis), split->range) < split->bin)
            build->order[first + before++] = leaf;
        else
            build->scratch[behind++] = leaf;
    }
    memcpy(&build->order[first + before], build->scratch, behind * sizeof(*build->scratch));
    return before;
}

static uint32_t levels_of(uint32_t count)
{
    uint32_t levels = 0;
    while (levels < 32 && UINT64_C(1) << levels < count)
        levels++;
    return levels;
}

/* Number of leaves in the first child: half of them where no split is found, or where the tree would become
 * deeper than a trail is long. */
static uint32_t first_child_count(struct build *build, uint32_t first, uint32_t count, uint32_t depth)
{
    struct split best = {.cost = FLT_MAX};
    if (depth + 1 + levels_of(count) >= EMITTER_DEPTH_MAX)
        return count / 2;
    for (int axis = 0; axis < 3; axis++)
        try_axis(build, first, count, axis, &best);
    return best.cost < FLT_MAX ? divide(build, first, count, &best) : count / 2;
}

static void build_node(struct build *build, uint32_t node, uint32_t first, uint32_t count, uint32_t depth,
                       uint32_t trail)
{
    if (count == 1) {
        build->nodes[node].link = EMITTER_LEAF | build->order[first];
        build->trails[build->order[first]] = trail;
        return;
    }
    const uint32_t children = build->node_count, before = first_child_count(build, first, count, depth);
    build->node_count += 2;
    build->nodes[node].link = children;
    build_node(build, children, first, before, depth + 1, trail);
    build_node(build, children + 1, first + before, count - before, depth + 1, trail | 1u << depth);
}

bool emitter_tree_build(const struct emitter_bounds *leaves, uint32_t leaf_count, struct emitter_node *nodes,
                        uint32_t *trails)
{
    uint32_t *order = malloc((size_t)leaf_count * 2 * sizeof(*order));
    if (!order)
        return false;
    for (uint32_t i = 0; i < leaf_count; i++)
        order[i] = i;
    struct build build = {.leaves = leaves,
                          .order = order,
                          .scratch = order + leaf_count,
                          .nodes = nodes,
                          .node_count = 1,
                          .trails = trails};
    build_node(&build, 0, 0, leaf_count, 0, 0);
    free(order);
    return emitter_tree_refit(leaves, leaf_count, nodes);
}

/* ---- nodes ---- */

static void pack_node(const struct emitter_bounds *bounds, struct emitter_node *node)
{
    float squared = 0.0f;
    for (int k = 0; k < 3; k++) {
        const float half = 0.5f * bounds->upper[k] - 0.5f * bounds->lower[k];
        node->centre_radius[k] = bounds->lower[k] + half;
        squared += half * half;
    }
    node->centre_radius[3] = sqrtf(squared);
    node->axis = unit_vector_pack(bounds->axis);
    node->cos_spread = cosf(bounds->spread);
    node->power = bounds->power;
}

bool emitter_tree_refit(const struct emitter_bounds *leaves, uint32_t leaf_count, struct emitter_node *nodes)
{
    const uint32_t node_count = 2 * leaf_count - 1;
    struct emitter_bounds *bounds = malloc((size_t)node_count * sizeof(*bounds));
    if (!bounds)
        return false;
    for (uint32_t i = node_count; i-- > 0;) { /* children come after their parents */
        const uint32_t link = nodes[i].link;
        bounds[i] = link & EMITTER_LEAF ? leaves[link & ~EMITTER_LEAF]
                                        : emitter_bounds_union(&bounds[link], &bounds[link + 1]);
        pack_node(&bounds[i], &nodes[i]);
    }
    free(bounds);
    return true;
}
