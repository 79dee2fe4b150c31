/* SPDX-License-Identifier: MIT */
/* Bounding volume trees over a scene, on the device: one for each geometry, and a top tree over the instances. The
 * structure of the tracer `bvh`, in which rays follow links, and of `rayspace`, in which bundles of rays descend.
 * Layout: shaders/tree/layout.h. GL thread. */
#ifndef FARLIGHT_TRACE_TREE_TREE_H
#define FARLIGHT_TRACE_TREE_TREE_H

#include "trace/tracer.h"
#include "trace/tree/build_top.h"
#include "trace/tree/store.h"

/* Where an update is. */
enum scene_tree_phase { SCENE_TREE_IDLE, SCENE_TREE_TREES, SCENE_TREE_TOP };

struct scene_tree {
    struct tracer_stats *stats; /* of its tracer */
    enum scene_tree_phase phase;
    uint64_t step_end_ns; /* of the update in progress */
    struct bvh_store store;
    struct bvh_top top;
    struct bvh_transform *transforms; /* mirror of the buffer, one per instance of the scene */
    uint32_t transform_count;
    struct gpu_buffer transform_buffer;
    float leaf_extent_world; /* diagonal of a leaf's box, in the mean over what the instances show */
};

/* `form` without its threads, which are as many as the machine has. */
void scene_tree_init(struct scene_tree *tree, struct gpu_device *device, const struct bvh_form *form,
                     struct tracer_stats *stats);
/* Empty again, as after scene_tree_init(); also drops an update that is not done. */
void scene_tree_finish(struct scene_tree *tree);
/* As tracer_impl.update: a step until about `step_end_ns`. Counts in the stats nodes and uploaded bytes. A moved
 * instance rewrites the top tree alone, a mesh that deforms is refitted. After TRACER_FAILED it is empty. */
enum tracer_progress scene_tree_update(struct scene_tree *tree, struct gpu_scene *scene,
                                       const struct tracer_update *update, uint64_t step_end_ns,
                                       struct error *error);
bool scene_tree_waits(struct scene_tree *tree); /* as tracer_impl.waits */
void scene_tree_tell(const struct scene_tree *tree, struct structure_rows *rows);
uint64_t scene_tree_bytes(const struct scene_tree *tree);
/* There is one instance: its tree is the scene's, and its number is returned. Else BVH_NONE. */
uint32_t scene_tree_only_instance(const struct scene_tree *tree);
/* Elements, transforms and primitives, as shaders/tree/layout.h says. */
void scene_tree_bind(struct scene_tree *tree);

#endif
