/* SPDX-License-Identifier: MIT */
/* Emissive triangles of the visible instances, for the tables of shared/emitter.h. Private to gpu_scene*.c.
 *
 * Spheres and discs, unlit materials, those that are blended or cut out, and those whose emission is visible only,
 * are left out: only rays that hit them find their light. */
#ifndef FARLIGHT_GPU_SCENE_EMITTER_H
#define FARLIGHT_GPU_SCENE_EMITTER_H

#include "gpu_scene/emitter_tree.h"
#include "gpu_scene/scene.h"

/* Consecutive triangles of a mesh in object space, from which its instances make leaves. */
struct emitter_cluster {
    struct emitter_bounds bounds; /* power: the sum of area times the mean of the texture */
    uint32_t first_primitive, count, first_share;
};

/* Consecutive triangles of a geometry with one emissive material. */
struct emitter_surface {
    uint32_t geometry, material;     /* the material's id */
    uint32_t first_primitive, count; /* scene-wide primitives */
    uint32_t first_cluster, cluster_count;
};

/* All-zero: no emitters. */
struct emitters {
    /* Surfaces in object space. The signature is 0 if there are none. */
    uint64_t signature;
    uint32_t cluster_size;
    struct emitter_surface *surfaces; /* by geometry, then by primitive */
    uint32_t surface_count;
    struct emitter_cluster *clusters;
    float *shares;
    uint32_t share_count;
    /* Tree in world space. */
    struct emitter_leaf *leaves;
    struct emitter_node *nodes; /* 2 * leaf_count - 1 */
    struct emitter_run *runs;
    uint32_t leaf_count, run_count;
    float area;    /* emitter_starts.area */
    bool too_many; /* more than can be sampled; the log has said so */
};

void emitters_finish(struct emitters *emitters); /* leaves it all-zero */
/* Updates the surfaces. *changed: their clusters have changed. */
bool emitters_list_surfaces(struct emitters *emitters, const struct gpu_scene *gpu, const struct scene *scene,
                            const struct scene_pose *pose, bool *changed, struct error *error);
/* Whether spheres have a material by which triangles would be emitters. */
bool emitters_any_spheres(const struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose);

#endif
