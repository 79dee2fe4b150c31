/* SPDX-License-Identifier: MIT */
/* The tree over the instances. It is small, also stays on the host, and is refitted where instances move. */
#ifndef FARLIGHT_TRACE_TREE_BUILD_TOP_H
#define FARLIGHT_TRACE_TREE_BUILD_TOP_H

#include "trace/tree/build.h"

struct bvh_world_box {
    float lower[3], upper[3]; /* lower > upper: empty, not in the tree */
};

void bvh_world_box_include(struct bvh_world_box *box, const struct bvh_world_box *other);

struct bvh_top {
    uint32_t *elements; /* in the device's layout */
    uint32_t element_count;
    struct bvh_baked baked;
    struct bvh_grid grid;
    struct bvh_world_box *boxes; /* box of each element, not padded */
    uint32_t *leaves;            /* link of each element, 0: an inner one */
    uint32_t *element_of;        /* instance to element; BVH_NONE: not in the tree */
    bool *moved;                 /* elements whose box must be made again */
    uint32_t instance_count;
    struct bvh_form settings;
    float built_cost; /* when the tree was built; see bvh_top_is_stale */
    bool left_grid;   /* an instance has left the grid */
};

/* Builds the tree over instances 0 .. count - 1, with their transform elements. False: out of memory. */
bool bvh_top_build(struct bvh_top *top, const struct bvh_world_box *boxes, uint32_t count,
                   const struct bvh_form *settings);
void bvh_top_finish(struct bvh_top *top);
/* Moves an instance to its new box. One that becomes empty, or was, needs a new tree: false. */
bool bvh_top_move(struct bvh_top *top, uint32_t instance, const struct bvh_world_box *box);
/* Remakes the bounds on the paths of moved elements; returns how many elements changed, and marks them in
 * `moved` until the next bvh_top_settle. */
uint32_t bvh_top_refit(struct bvh_top *top);
void bvh_top_settle(struct bvh_top *top);
/* Whether refits have made the tree so much worse that a new one pays. */
bool bvh_top_is_stale(const struct bvh_top *top);

#endif
