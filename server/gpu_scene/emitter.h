/* SPDX-License-Identifier: MIT */
/* The emissive triangles of the visible instances, for the tables of shared/emitter.h. Private to gpu_scene*.c.
 *
 * Left out, and so found by the rays that hit them alone: spheres and discs, unlit materials, and those that are
 * blended or cut out; and those whose emission lights nothing. */
#ifndef FARLIGHT_GPU_SCENE_EMITTER_H
#define FARLIGHT_GPU_SCENE_EMITTER_H

#include "gpu_scene/emitter_tree.h"
#include "gpu_scene/scene.h"

/* Some consecutive triangles of a mesh, in object space: what its instances make leaves of. */
struct emitter_cluster {
    struct emitter_bounds bounds; /* power: the sum of area times the mean of the texture */
    uint32_t first_primitive, count, first_share;
};

/* Consecutive triangles of a geometry with one emissive material. */
struct emitter_surface {
    uint32_t geometry, material;     /* the material's id */
    uint32_t first_primitive, count; /* scene-wide */
    uint32_t first_cluster, cluster_count;
};

/* All-zero: there are none. */
struct emitters {
    /* In object space; of a signature, which is 0 where there is nothing. */
    uint64_t signature;
    uint32_t cluster_size;
    struct emitter_surface *surfaces; /* by geometry, then by primitive */
    uint32_t surface_count;
    struct emitter_cluster *clusters;
    float *shares;
    uint32_t share_count;
    /* In world space. */
    struct emitter_leaf *leaves;
    struct emitter_node *nodes; /* 2 * leaf_count - 1 */
    struct emitter_run *runs;
    uint32_t leaf_count, run_count;
    float area;    /* emitter_starts.area */
    bool too_many; /* to be sampled, as the log has said */
};

void emitters_finish(struct emitters *emitters); /* leaves it all-zero */
/* Brings the surfaces up to date. *changed: the clusters are others. */
bool emitters_list_surfaces(struct emitters *emitters, const struct gpu_scene *gpu, const struct scene *scene,
                            const struct scene_pose *pose, bool *changed, struct error *error);
/* Whether spheres have a material that would make triangles emitters. */
bool emitters_any_spheres(const struct gpu_scene *gpu, const struct scene *scene, const struct scene_pose *pose);

#endif
