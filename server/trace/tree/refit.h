/* SPDX-License-Identifier: MIT */
/* Refitting of trees of deformed geometries on the device: boxes are computed again bottom-up from the current
 * triangles; order and links stay. Based on: Wald, Boulos, Shirley. Ray Tracing Deformable Scenes Using Dynamic
 * Bounding Volume Hierarchies. ACM TOG 2007, section 5. GL thread. */
#ifndef FARLIGHT_TRACE_TREE_REFIT_H
#define FARLIGHT_TRACE_TREE_REFIT_H

#include "base/error.h"
#include "gpu/buffer.h"
#include "trace/tree/build.h"

#include <stdbool.h>
#include <stdint.h>

/* The plan of a tree, on the device. All-zero: the tree cannot be refitted. */
struct bvh_refit {
    struct gpu_buffer records, corners;
    uint32_t record_count, leaf_count;
    struct bvh_refit_step *steps;
    uint32_t step_count;
};

/* Maximum growth of a tree's wear since its build (struct bvh_tree, wear): beyond it, a new one is built. A ray
 * then meets up to that many times as many boxes, which costs more than a frame's share of a build in scenes of
 * any size.
 */
#define BVH_REFIT_WEAR_MAX 2.0f

/* Creates the plan's buffers, and moves its steps into *refit. */
bool bvh_refit_init(struct bvh_refit *refit, struct gpu_device *device, struct bvh_refit_plan *plan,
                    struct error *error);
void bvh_refit_finish(struct bvh_refit *refit, struct gpu_device *device);

/* Places of a tree's parts in the buffers. */
struct bvh_refit_place {
    struct gpu_buffer *boxes, *primitives, *elements;
    uint32_t first_box;    /* the tree's first box in `boxes`, of BVH_REFIT_BOX_BYTES each */
    uint32_t first_texel;  /* first texel in `primitives` */
    uint32_t close_texels; /* offset of the triangles at shutter close */
    uint32_t first_vertex; /* in the scene's positions, which are bound */
    uint32_t close_offset; /* offset of the vertices at shutter close; 0: the shape stays while the shutter is
                              open */
    uint32_t first_element, element_count;
};
#define BVH_REFIT_BOX_BYTES (BVH_REFIT_BOX_TEXELS * 16u)

/* The first box of a tree in `boxes`. */
struct bvh_refit_root {
    float lower[3];
    uint32_t size;
    float upper[3];
    uint32_t pad0;
    float surfaces, triangle_surfaces;
    uint32_t pad1[2];
};

/* Refits triangles and boxes. */
bool bvh_refit_bounds(struct bvh_refit *refit, struct gpu_device *device, const struct bvh_refit_place *place,
                      struct error *error);
/* Writes elements from the boxes; `grid` is over the root's box. */
bool bvh_refit_write(struct bvh_refit *refit, struct gpu_device *device, const struct bvh_refit_place *place,
                     const struct bvh_form *settings, const struct bvh_grid *grid, struct error *error);

#endif
