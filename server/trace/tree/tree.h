/* SPDX-License-Identifier: MIT */
/* Bounding volume trees over a scene, on the device: one for each geometry, and a top tree over the instances.
 * They are the structure of the tracer `bvh`, whose rays follow links, and of `rayspace`, whose bundles of rays
 * descend them. Layout: shaders/tree/layout.h. GL thread. */
#ifndef FARLIGHT_TRACE_TREE_TREE_H
#define FARLIGHT_TRACE_TREE_TREE_H

#include "trace/tracer.h"
#include "trace/tree/build_top.h"
#include "trace/tree/store.h"

/* Phase of an update. */
enum scene_tree_phase { SCENE_TREE_IDLE, SCENE_TREE_TREES, SCENE_TREE_TOP };

struct scene_tree {
    struct tracer_stats *stats; /* stats of its tracer */
    enum scene_tree_phase phase;
    uint64_t step_end_ns; /* end of the current step */
    struct bvh_store store;
    struct bvh_top top;
    struct bvh_transform *transforms; /* mirror of the buffer, one for each instance of the scene */
    uint32_t transform_count;
    struct gpu_buffer transform_buffer;
    float leaf_extent_world; /* diagonal of a leaf's box, mean over all instances */
};

/* Initialises a tree. The threads in `form` are ignored: the builder uses all of the machine's. */
void scene_tree_init(struct scene_tree *tree, struct gpu_device *device, const struct bvh_form *form,
                     struct tracer_stats *stats);
/* Empties the tree, as after scene_tree_init(), and drops an update in progress. */
void scene_tree_finish(struct scene_tree *tree);
/* Implements tracer_impl.update: runs a step until about `step_end_ns`. Adds nodes and uploaded bytes to the
 * stats. A moved instance rewrites the top tree alone, a deforming mesh is refitted. After TRACER_FAILED the
 * tree is empty. */
enum tracer_progress scene_tree_update(struct scene_tree *tree, struct gpu_scene *scene,
                                       const struct tracer_update *update, uint64_t step_end_ns,
                                       struct error *error);
bool scene_tree_waits(struct scene_tree *tree); /* implements tracer_impl.waits */
void scene_tree_report(const struct scene_tree *tree, struct structure_rows *rows);
uint64_t scene_tree_bytes(const struct scene_tree *tree);
/* The number of the only instance, whose tree is the scene's; otherwise BVH_NONE. */
uint32_t scene_tree_only_instance(const struct scene_tree *tree);
/* Binds elements, transforms and primitives at the places in shaders/tree/layout.h. */
void scene_tree_bind(struct scene_tree *tree);

#endif
