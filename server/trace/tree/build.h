/* SPDX-License-Identifier: MIT */
/* Builder of bounding volume trees, on the CPU and without GL. Its result depends on the input alone, not on the
 * number of threads. Three steps: a binary tree by the surface area heuristic in bins (build.c, build_split.c),
 * the removal of elements that do not pay and the baking of links (build_bake.c), many trees at once
 * (build_jobs.c).
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

/* The children of a node lie side by side; otherwise the order of nodes is undefined, as each thread puts its
 * own where there is a place. bvh_binary_list() is the same for the same input. */
struct bvh_binary_node {
    float lower[3];
    uint32_t link; /* inner: left child, followed by the right one; leaf: first primitive in `order` */
    float upper[3];
    uint32_t count_axis; /* bits 2..: primitives of a leaf, 0: inner; bits 0..1: axis of the split */
};

struct bvh_binary {
    struct bvh_binary_node *nodes; /* the first is the root */
    float *areas;                  /* half the surface of each node's box */
    uint32_t *order;               /* primitive numbers in the order of the leaves */
    uint32_t primitive_count, node_count;
    uint32_t place_count; /* maximum in memory: some places between nodes stay empty */
};

/* Costs of an element test and of a primitive test, in arbitrary units; their ratio was measured. Where a
 * primitive costs nothing, every range that fits a leaf becomes one. */
struct bvh_costs {
    float element, primitive;
    uint32_t leaf_max; /* 1 .. BVH_LEAF_MAX */
    bool halves;       /* ranges are cut in the middle, in the order of their numbers: a tree of few levels */
};

/* Builds a tree over boxes[0..count-1], which it overwrites; boxes has room for as many again behind them. 1 <=
 * count <= 2^27. False: out of memory, or stopped: `stop` (NULL: never) was set meanwhile. */
bool bvh_binary_build(struct bvh_binary *tree, struct bvh_box *boxes, uint32_t count,
                      const struct bvh_costs *costs, unsigned threads, const atomic_bool *stop);
void bvh_binary_finish(struct bvh_binary *tree);
/* Lists the nodes in depth-first order: a left child follows its parent. The caller frees the list. NULL: out
 * of memory. */
uint32_t *bvh_binary_list(const struct bvh_binary *tree);

/* ---- baked tree ---- */

/* Triangles or spheres in object space. Builder threads read them. */
struct bvh_shape {
    const float *positions;       /* position_floats per vertex */
    const float *positions_close; /* positions as the shutter closes; NULL: the same */
    uint32_t position_floats;     /* 0: 3 */
    const uint32_t *indices;      /* 3 per triangle, in range (checked by the scene) */
    const float *centres_radii;   /* 4 per sphere */
    uint32_t primitive_count;     /* at least 1 */
    bool deforms; /* the tree will be refitted: it needs a plan, and space for its triangles at shutter close
                     behind those at shutter open */
};

/* A step of a refit, which proceeds bottom-up; elements of a step do not depend on one another. */
struct bvh_refit_step {
    uint32_t first, count; /* records */
};
struct bvh_refit_plan {
    uint32_t *corners; /* 4 per triangle, in the tree's order: its vertices and its number in the mesh */
    uint32_t triangle_count;
    struct bvh_refit_record *records; /* records of the elements, leaves first */
    uint32_t record_count, leaf_count;
    struct bvh_refit_step *steps; /* steps above the leaves */
    uint32_t step_count;
};

struct bvh_form {
    bool spheres;            /* bounds are spheres, not boxes */
    bool one_order;          /* every direction has the same order */
    bool whole;              /* boxes in floats, not on a grid */
    bool wide;               /* wide nodes: of the trees over geometries; the top tree has elements */
    unsigned threads;        /* maximum; small shapes take one */
    const atomic_bool *stop; /* makes a build fail soon once it is set; NULL: never */
};

static inline bool bvh_is_stopped(const atomic_bool *stop)
{
    return stop && atomic_load_explicit(stop, memory_order_relaxed);
}

/* Shapes with fewer primitives are built by a single thread. */
#define BVH_THREADED_PRIMITIVES 50000u

/* Grid of packed elements: a coordinate x is at cell (x - lower) * cells_per_unit. */
struct bvh_grid {
    float lower[3], cells_per_unit[3];
};

struct bvh_tree {
    uint32_t *elements; /* in the device's layout: octants x element_count x words; NULL: stored elsewhere */
    uint32_t element_count;
    struct bvh_grid grid;
    float grid_cost;   /* mean factor by which the grid enlarges a box's surface: 1 .. 4, also where `whole`
                          leaves it unused; 1: never used */
    float leaf_extent; /* mean diagonal of a leaf's box */
    float *primitives; /* 4 x primitive_texels floats, see tree/layout.h; NULL: stored elsewhere */
    size_t primitive_texels;
    float lower[3], upper[3]; /* padded bounds of the tree */
    /* Surfaces of all elements' boxes over those of each primitive's own box, for deforming shapes. The wear of
     * a refitted tree grows as its boxes come to overlap, and not where the whole shape grows. */
    float wear;
    struct bvh_refit_plan plan; /* empty: the shape does not deform, or the tree cannot be refitted */
    struct bvh_draft *draft;    /* kept until the tree is written */
};

/* The form of the top tree. */
struct bvh_form bvh_top_form(const struct bvh_form *settings);

/* Sizes that follow from the settings. Of wide nodes an element is a node. */
uint32_t bvh_octants(const struct bvh_form *settings); /* copies: BVH_OCTANTS or 1 */
bool bvh_is_packed(const struct bvh_form *settings);
uint32_t bvh_element_words(const struct bvh_form *settings); /* uint32_t per element and copy */
size_t bvh_element_bytes(const struct bvh_form *settings);   /* bytes per element in all copies */

/* Builds a tree in two steps, so that the caller knows the arrays' sizes in between: bvh_tree_plan() makes all
 * but the arrays, bvh_tree_write() writes them to the caller's pointers, which may be device memory (it is
 * never read). A stopped write leaves a part. Bounds are padded outward by BVH_PAD_RELATIVE of their magnitude,
 * so that the rounding of the traversal's arithmetic cannot lose a hit (derived in shaders/tree/slack.glsl).
 * ERROR_OUT_OF_MEMORY, ERROR_LIMIT. */
bool bvh_tree_plan(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                   struct error *error);
void bvh_tree_write(struct bvh_tree *tree, const struct bvh_shape *shape, const struct bvh_form *settings,
                    uint32_t *elements, float *primitives);
/* Allocates arrays of the tree's own for the second step. */
bool bvh_tree_alloc(struct bvh_tree *tree, const struct bvh_form *settings);
void bvh_tree_finish(struct bvh_tree *tree);
#define BVH_PAD_RELATIVE 0x1p-21f

/* A tree to be built among others. */
struct bvh_job {
    struct bvh_shape shape;
    struct bvh_tree tree; /* out */
    struct error error;   /* out; kind ERROR_NONE: built */
    uint32_t *elements;   /* destination */
    float *primitives;
};

enum bvh_step { BVH_PLAN, BVH_WRITE };

/* Begins to plan all trees, or to write all planned ones. Large work runs in threads of its own, which read the
 * shapes and their arrays until the run is finished or stopped; a stop takes effect between two of a build's
 * loops over the primitives of a range. The caller finishes the trees, in any case. NULL: out of memory. */
struct bvh_run;
struct bvh_run *bvh_jobs_start(struct bvh_job *jobs, uint32_t count, const struct bvh_form *settings,
                               enum bvh_step step);
/* Waits until that time of clock_now_ns(), at most. False: the run is not complete. */
bool bvh_jobs_wait(struct bvh_run *run, uint64_t until_ns);
/* Waits for the end of the run, and stores its time in *end_ns. False: a build failed; its error is in *error. */
bool bvh_jobs_finish(struct bvh_run *run, uint64_t *end_ns, struct error *error);
void bvh_jobs_stop(struct bvh_run *run); /* accepts NULL */

/* ---- single steps, for the top tree ---- */

#define BVH_NONE 0xffffffffu

/* Elements in the depth-first order of octant 0. */
struct bvh_baked {
    uint32_t element_count;
    uint32_t *node;   /* the binary node of each element */
    uint32_t *size;   /* elements of its subtree, itself included; its children begin at the next element */
    uint32_t *parent; /* BVH_NONE at the root */
    uint32_t *place;  /* octants x element_count: an element's place in the order of the octant; NULL: one
                         octant */
};

/* Makes a plan. leaves[e]: link of a leaf, 0: an inner element. False: out of memory. The plan stays empty
 * (record_count 0) where an element has more children than a shader's loop may visit. */
bool bvh_refit_plan_make(struct bvh_refit_plan *plan, const struct bvh_baked *baked, const uint32_t *leaves);
void bvh_refit_plan_finish(struct bvh_refit_plan *plan);

/* Selects the inner nodes that stay, and orders them. areas[n]: surface of the bound of binary node n, up to a
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
/* Writes element e into every copy. leaf: 0 for an inner element. A packed box must lie within the grid. */
void bvh_write_element(uint32_t *elements, const struct bvh_form *settings, const struct bvh_baked *baked,
                       const struct bvh_grid *grid, uint32_t e, const struct bvh_bound *bound, uint32_t leaf);
uint32_t bvh_leaf(uint32_t kind, uint32_t first, uint32_t count);
float bvh_box_area(const float lower[3], const float upper[3]);
void bvh_pad_box(float lower[3], float upper[3]);

/* A grid over a padded box, enlarged on all sides by `room`, a share of the box's extent. */
struct bvh_grid bvh_grid_over(const float lower[3], const float upper[3], float room);
/* Finds the cells of a padded box, two per axis, rounded outward. False: the box is not within the grid. */
bool bvh_grid_cells(const struct bvh_grid *grid, const float lower[3], const float upper[3], uint32_t cells[3][2]);
/* Surface of the box that these cells span, in the unit of bvh_box_area. */
float bvh_grid_area(const struct bvh_grid *grid, uint32_t cells[3][2]);

#endif
