/* SPDX-License-Identifier: MIT */
/* The builder of bounding volume trees: on the CPU, knows no GL, deterministic for an input whatever the number
 * of threads. Three steps: a binary tree by the surface area heuristic in bins (build.c, build_split.c),
 * the removal of elements that do not pay and the baking of links (build_bake.c), many
 * trees at once (build_jobs.c).
 *
 * Based on: Wald. On fast Construction of SAH-based Bounding Volume Hierarchies. 2007 (binning);
 * 'Stackless traversal of a sphere BVH, distributed ray tracing', sections 4 and 6: wide nodes, baked links. */
#ifndef FARLIGHT_TRACE_TREE_BUILD_H
#define FARLIGHT_TRACE_TREE_BUILD_H

#include "base/error.h"
#include "tree/layout.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Four floats in a register; the last is unused and 0. */
typedef float bvh_vec4 __attribute__((vector_size(16)));

struct bvh_box {
    bvh_vec4 lower, upper;
};

/* ---- binary tree ---- */

/* The children of a node lie side by side; beyond that nodes have no order that could be relied on, as each thread
 * puts its own where there is a place. bvh_binary_list() is the same for the same input. */
struct bvh_binary_node {
    float lower[3];
    uint32_t link; /* inner: left child, behind which is the right one; leaf: first primitive in `order` */
    float upper[3];
    uint32_t count_axis; /* bits 2..: primitives of a leaf, 0: inner; bits 0..1: axis of the split */
};

struct bvh_binary {
    struct bvh_binary_node *nodes; /* the first is the root */
    float *areas;                  /* of each node: half the surface of its box */
    uint32_t *order;               /* primitive numbers as the leaves hold them */
    uint32_t primitive_count, node_count;
    uint32_t place_count; /* at most that many are in memory, as not every place between two nodes has one */
};

/* The costs of an element test and of a primitive test, in arbitrary units; their ratio was measured. */
struct bvh_costs {
    float element, primitive;
    uint32_t leaf_max; /* 1 .. BVH_LEAF_MAX */
};

/* Builds over boxes[0..count-1], which it writes over, and as many behind them, which need not be set. 1 <= count
 * <= 2^27. False: out of memory, or stopped: `stop` (NULL: never) was set meanwhile. */
bool bvh_binary_build(struct bvh_binary *tree, struct bvh_box *boxes, uint32_t count,
                      const struct bvh_costs *costs, unsigned threads, const atomic_bool *stop);
void bvh_binary_finish(struct bvh_binary *tree);
/* All nodes in depth-first order: left children follow their parent. The caller frees it. NULL: out of memory. */
uint32_t *bvh_binary_list(const struct bvh_binary *tree);

/* ---- baked tree ---- */

/* Object space. Either triangles or spheres. Read by builder threads, not changed. */
struct bvh_shape {
    const float *positions;       /* position_floats a vertex */
    const float *positions_close; /* likewise, as the shutter closes; NULL: the same */
    uint32_t position_floats;     /* 0: 3 */
    const uint32_t *indices;      /* 3 a triangle, in range (the scene has checked it) */
    const float *centres_radii;   /* 4 a sphere */
    uint32_t primitive_count;     /* at least 1 */
    bool deforms; /* the tree will be refitted: it gets a plan, and space for its triangles at shutter close behind
                     those at shutter open */
};

/* How a tree is refitted, bottom-up in steps; within a step elements need none of the others. */
struct bvh_refit_step {
    uint32_t first, count; /* records */
};
struct bvh_refit_plan {
    uint32_t *corners; /* 4 a triangle, in the tree's order: its vertices and its number in the mesh */
    uint32_t triangle_count;
    struct bvh_refit_record *records; /* one per element, leaves first */
    uint32_t record_count, leaf_count;
    struct bvh_refit_step *steps; /* above the leaves */
    uint32_t step_count;
};

struct bvh_form {
    bool spheres;            /* bounds are spheres, not boxes */
    bool one_order;          /* for every direction */
    bool whole;              /* boxes in floats, not on a grid */
    unsigned threads;        /* at most; small shapes take one */
    const atomic_bool *stop; /* once it is set a build fails, soon; NULL: never */
};

static inline bool bvh_is_stopped(const atomic_bool *stop)
{
    return stop && atomic_load_explicit(stop, memory_order_relaxed);
}

/* Shapes of fewer primitives are built by one thread. */
#define BVH_THREADED_PRIMITIVES 50000u

/* Where the cells of packed elements lie: a coordinate x is at cell (x - lower) * cells_per_unit. */
struct bvh_grid {
    float lower[3], cells_per_unit[3];
};

struct bvh_tree {
    uint32_t *elements; /* as the device has them: octants x element_count x words; NULL: they lie elsewhere */
    uint32_t element_count;
    struct bvh_grid grid;
    float grid_cost;   /* how much larger the grid makes a box's surface, in the mean: 1 .. 4, also where it is
                          not used since `whole` is set; 1: never used */
    float leaf_extent; /* diagonal of a leaf's box, in the mean */
    float *primitives; /* 4 x primitive_texels floats, see tree/layout.h; likewise */
    size_t primitive_texels;
    float lower[3], upper[3]; /* of everything, padded */
    float wear; /* surfaces of all elements' boxes over those of each primitive's own box; of shapes that deform.
                   That of a refitted tree grows as its boxes come to overlap, and not where all grows alike */
    struct bvh_refit_plan plan; /* empty: the shape does not deform, or the tree is not one that can be refitted */
    struct bvh_draft *draft;    /* until it is written */
};

/* What the settings mean for elements. */
uint32_t bvh_octants(const struct bvh_form *settings); /* copies: BVH_OCTANTS or 1 */
bool bvh_is_packed(const struct bvh_form *settings);
uint32_t bvh_element_words(const struct bvh_form *settings); /* uint32_t of one element of one copy */
size_t bvh_element_bytes(const struct bvh_form *settings);   /* of one element in all copies */

/* Two steps, between which it is known how large the arrays are: all but these; then both, to where the caller
 * says, which may be the device's memory: nothing is read there. Stopped, the second one writes a part. Bounds are
 * padded outward by BVH_PAD_RELATIVE of their magnitude, so that the rounding of the traversal's arithmetic cannot
 * lose a hit (shaders/tree/slack.glsl has the sum). ERROR_OUT_OF_MEMORY, ERROR_LIMIT. */
bool bvh_tree_plan(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                   struct error *error);
void bvh_tree_write(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                    uint32_t *elements, float *primitives);
bool bvh_tree_alloc(struct bvh_tree *tree, const struct bvh_form *settings); /* arrays of its own, for that */
void bvh_tree_finish(struct bvh_tree *tree);
#define BVH_PAD_RELATIVE 0x1p-21f

/* One of several trees to be built. */
struct bvh_job {
    struct bvh_shape shape;
    struct bvh_tree tree; /* out */
    struct error error;   /* out; kind ERROR_NONE: built */
    uint32_t *elements;   /* where they are to be written */
    float *primitives;
};

enum bvh_step { BVH_PLAN, BVH_WRITE };

/* Begins to plan all, or to write all that are planned. Where there is much to do it is done in threads of its
 * own, which read the shapes and what they point to until the run is finished or stopped, and are only stopped
 * between two of a build's loops over the primitives of a range. The caller finishes the trees, in any case. NULL:
 * out of memory. */
struct bvh_run;
struct bvh_run *bvh_jobs_start(struct bvh_job *jobs, uint32_t count, const struct bvh_form *settings,
                               enum bvh_step step);
/* Waits until then, by clock_now_ns(), at most. False: it is not done. */
bool bvh_jobs_wait(struct bvh_run *run, uint64_t until_ns);
/* Waits for the end; *end_ns is when it came. False: one failed; its error is in *error. */
bool bvh_jobs_finish(struct bvh_run *run, uint64_t *end_ns, struct error *error);
void bvh_jobs_stop(struct bvh_run *run); /* accepts NULL */

/* ---- the steps, for the top tree ---- */

#define BVH_NONE 0xffffffffu

/* Elements in the depth-first order of octant 0. */
struct bvh_baked {
    uint32_t element_count;
    uint32_t *node;   /* of an element: its binary node */
    uint32_t *size;   /* elements of its subtree, itself included; its children begin at the next element */
    uint32_t *parent; /* BVH_NONE at the root */
    uint32_t *place;  /* octants x element_count: where the octant's order has it; NULL: one octant */
};

/* leaves[e]: link of a leaf, 0: an inner element. False: out of memory. The plan stays empty (record_count 0)
 * where an element has more children than a shader's loop looks at. */
bool bvh_refit_plan_make(struct bvh_refit_plan *plan, const struct bvh_baked *baked, const uint32_t *leaves);
void bvh_refit_plan_finish(struct bvh_refit_plan *plan);

/* Chooses which inner nodes stay, and orders them. areas[n]: surface of the bound of binary node n, up to a
 * factor. False: out of memory. */
bool bvh_bake(struct bvh_baked *baked, const struct bvh_binary *tree, const float *areas, uint32_t octants,
              unsigned threads);
void bvh_baked_finish(struct bvh_baked *baked);

/* A box, or a sphere: its centre in `lower`, its radius in upper[0]. */
struct bvh_bound {
    float lower[3], upper[3];
};
struct bvh_bound bvh_bound_of_box(const float lower[3], const float upper[3]); /* padded */
struct bvh_bound bvh_bound_of_sphere(const float centre[3], float radius);     /* padded */
/* Writes element e into every copy. leaf: 0 for an inner element. Packed, the box must lie in the grid. */
void bvh_write_element(uint32_t *elements, const struct bvh_form *settings, const struct bvh_baked *baked,
                       const struct bvh_grid *grid, uint32_t e, const struct bvh_bound *bound, uint32_t leaf);
uint32_t bvh_leaf(uint32_t kind, uint32_t first, uint32_t count);
float bvh_box_area(const float lower[3], const float upper[3]);
void bvh_pad_box(float lower[3], float upper[3]);

/* A grid over a padded box, enlarged on all sides by `room`, a share of the box's extent. */
struct bvh_grid bvh_grid_over(const float lower[3], const float upper[3], float room);
/* Cells of a padded box, two per axis; rounded outward. False: some of it lies outside of the grid. */
bool bvh_grid_cells(const struct bvh_grid *grid, const float lower[3], const float upper[3], uint32_t cells[3][2]);
/* Surface of the box that those cells span, as bvh_box_area. */
float bvh_grid_area(const struct bvh_grid *grid, uint32_t cells[3][2]);

#endif
