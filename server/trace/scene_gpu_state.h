/* SPDX-License-Identifier: MIT */
/* Private to scene_gpu*.c: one file for each part of the copy, and what they keep between updates. */
#ifndef FARLIGHT_TRACE_SCENE_GPU_STATE_H
#define FARLIGHT_TRACE_SCENE_GPU_STATE_H

#include "base/hashmap.h"
#include "trace/scene_gpu.h"
#include "trace/scene_gpu_deform.h"

/* A material keeps its index while it lives, so that an edit of one does not touch the triangles of others. */
struct material_indices {
    struct hashmap index_by_id; /* value: (index + 1) as a pointer */
    uint32_t count;             /* indices given out so far, the default material's 0 included */
    uint32_t *free;             /* indices of materials that are gone */
    uint32_t free_count, free_capacity;
};

enum posed_part { POSED_NODES = 1, POSED_MORPHS = 2, POSED_LIGHTS = 4, POSED_MATERIALS = 8 };

struct material;
struct texture_slot;
struct light;

struct scene_gpu_state {
    /* Mirrors of buffers. */
    struct material *materials;
    struct texture_slot *texture_slots;
    struct light *lights;
    struct material_indices material_indices;
    uint64_t shapes_signature; /* of the meshes and sphere sets that are packed */
    uint64_t discs_signature;
    uint64_t textures_signature;
    uint64_t environment_revision;
    struct hashmap texture_index_by_id; /* value: (index + 1) as a pointer */
    uint32_t rigid_count;               /* geometries that do not deform: the first ones */
    uint32_t close_vertex;              /* where the deforming geometries' vertices as the shutter closes begin */
    struct scene_gpu_deform deform;
    bool stale_geometries; /* the table on the device is not what `geometries` says */
    unsigned posed_parts;  /* POSED_*, by the last update: without poses they are elsewhere again */
    bool any_update;       /* false: nothing is there yet */
};

/* Spreads an id and a revision over 64 bits. */
uint64_t scene_gpu_mix(uint64_t x);
/* Changes when an object of the kind is added, removed or set again; 0 for none. */
uint64_t scene_gpu_signature(const struct scene *scene, enum scene_object_kind kind);

/* What the device's texel buffers do not hold is refused: "5 `what`; this device's ..." */
bool scene_gpu_check_texels(const struct scene_gpu *gpu, uint64_t count, const char *what, struct error *error);

/* scene_gpu_material.c. Indices first: geometry is packed with them. */
bool scene_gpu_index_materials(struct scene_gpu *gpu, const struct scene *scene, struct error *error);
uint32_t scene_gpu_material_index(const struct scene_gpu *gpu, uint32_t material_id); /* 0: the default */
/* What differs from the mirrors. */
bool scene_gpu_upload_materials(struct scene_gpu *gpu, const struct scene *scene,
                                const struct scene_motion *motion, struct scene_changes *changes,
                                struct error *error);
/* scene_gpu_texture.c. Does nothing where no texture changed. */
bool scene_gpu_upload_textures(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                               struct error *error);
uint32_t scene_gpu_texture_index(const struct scene_gpu *gpu, uint32_t texture_id, bool *found);
/* scene_gpu_geometry.c */
bool scene_gpu_upload_geometry(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                               struct error *error);
/* Which geometry has cutouts, what the scene has of special materials. */
void scene_gpu_classify_geometry(struct scene_gpu *gpu, const struct scene *scene,
                                 const struct scene_motion *motion);
/* The table of geometries, where it is stale. */
bool scene_gpu_upload_geometry_table(struct scene_gpu *gpu, struct scene_changes *changes, struct error *error);
/* scene_gpu_deform.c. Brings the vertices of what deforms to the first pose and to the last. */
bool scene_gpu_deform(struct scene_gpu *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct error *error);
/* Whether the vertices of some geometry are others as the shutter closes. */
bool scene_gpu_any_closes(const struct scene_gpu *gpu);
/* scene_gpu_instance.c */
bool scene_gpu_upload_instances(struct scene_gpu *gpu, const struct scene *scene,
                                const struct scene_motion *motion, struct scene_changes *changes,
                                struct error *error);
bool scene_gpu_upload_discs(struct scene_gpu *gpu, const struct scene *scene, struct scene_changes *changes,
                            struct error *error);
/* Of the instances; empty (lower above upper) if there are none. */
void scene_gpu_all_instance_bounds(const struct scene_gpu *gpu, float lower[3], float upper[3]);
/* scene_gpu_light.c. As the shutter opens; the bounds too. */
bool scene_gpu_upload_lights(struct scene_gpu *gpu, const struct scene *scene, const struct scene_motion *motion,
                             struct scene_changes *changes, struct error *error);

#endif
