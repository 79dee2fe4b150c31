/* SPDX-License-Identifier: MIT */
/* The tree over the instances. It is small, stays on the host too, and is refitted where instances move. */
#ifndef FARLIGHT_TRACE_TREE_BUILD_TOP_H
#define FARLIGHT_TRACE_TREE_BUILD_TOP_H

#include "trace/tree/build.h"

struct bvh_world_box {
    float lower[3], upper[3]; /* lower > upper: nothing there, not in the tree */
};

void bvh_world_box_include(struct bvh_world_box *box, const struct bvh_world_box *other);

struct bvh_top {
    uint32_t *elements; /* as the device has them */
    uint32_t element_count;
    struct bvh_baked baked;
    struct bvh_grid grid;
    struct bvh_world_box *boxes; /* of each element, not padded */
    uint32_t *leaves;            /* of each element: its link, 0: an inner one */
    uint32_t *element_of;        /* instance to element; BVH_NONE: not in the tree */
    bool *moved;                 /* elements whose box is to be made again */
    uint32_t instance_count;
    struct bvh_form settings;
    float built_cost; /* when the tree was built; see bvh_top_is_stale */
    bool left_grid;   /* something has moved out of the grid */
};

/* Transform elements of instances 0 .. count - 1. False: out of memory. */
bool bvh_top_build(struct bvh_top *top, const struct bvh_world_box *boxes, uint32_t count,
                   const struct bvh_form *settings);
void bvh_top_finish(struct bvh_top *top);
/* Where an instance is now. One that comes or goes (becomes empty or was) needs a new tree: false. */
bool bvh_top_move(struct bvh_top *top, uint32_t instance, const struct bvh_world_box *box);
/* Makes the bounds on the paths of what moved; returns how many elements changed and marks them in
 * `moved` until the next bvh_top_settle. */
uint32_t bvh_top_refit(struct bvh_top *top);
void bvh_top_settle(struct bvh_top *top);
/* So many instances have moved that a new tree would be much better. */
bool bvh_top_is_stale(const struct bvh_top *top);

#endif
