/* SPDX-License-Identifier: MIT */
/* Private to scene_gpu*.c: one file for each part of the copy, and what they keep between updates. */
#ifndef FARLIGHT_TRACE_SCENE_GPU_STATE_H
#define FARLIGHT_TRACE_SCENE_GPU_STATE_H

#include "base/hashmap.h"
#include "trace/scene_gpu.h"

/* A material keeps its index while it lives, so that an edit of one does not touch the triangles of others. */
struct material_indices {
    struct hashmap index_by_id; /* value: (index + 1) as a pointer */
    uint32_t count;             /* indices given out so far, the default material's 0 included */
    uint32_t *free;             /* indices of materials that are gone */
    uint32_t free_count, free_capacity;
};

struct scene_gpu_state {
    struct material_indices material_indices;
    uint64_t shapes_signature; /* of the meshes and sphere sets that are packed */
    uint64_t discs_signature;
    uint64_t textures_signature;
    uint64_t environment_revision;
    struct hashmap texture_index_by_id; /* value: (index + 1) as a pointer */
    bool any_update;                    /* false: nothing is there yet */
};

/* Changes when an object of the kind is added, removed or set again; 0 for none. */
uint64_t scene_gpu_signature(const struct scene *scene, enum scene_object_kind kind);

/* scene_gpu_material.c. Indices first: geometry is packed with them. */
bool scene_gpu_index_materials(struct scene_gpu *gpu, const struct scene *scene, struct error *error);
uint32_t scene_gpu_material_index(const struct scene_gpu *gpu, uint32_t material_id); /* 0: the default */
bool scene_gpu_upload_materials(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                                struct error *error);
/* scene_gpu_texture.c. Does nothing where no texture changed. */
bool scene_gpu_upload_textures(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                               struct error *error);
uint32_t scene_gpu_texture_index(const struct scene_gpu *gpu, uint32_t texture_id, bool *found);
/* scene_gpu_geometry.c */
bool scene_gpu_upload_geometry(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                               struct error *error);
/* Which geometry has cutouts, what the scene has of special materials; uploads the geometry table. */
bool scene_gpu_classify_geometry(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                                 struct error *error);
/* scene_gpu_instance.c */
bool scene_gpu_upload_instances(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                                struct error *error);
bool scene_gpu_upload_discs(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                            struct error *error);
/* Of the instances; empty (lower above upper) if there are none. */
void scene_gpu_instance_bounds(const struct scene_gpu *gpu, float lower[3], float upper[3]);
/* scene_gpu_light.c. The bounds too. */
bool scene_gpu_upload_lights(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                             struct error *error);

#endif
