/* SPDX-License-Identifier: MIT */
/* Private to gpu_scene*.c: one file for each part of the copy, and what they keep between updates. */
#ifndef FARLIGHT_GPU_SCENE_STATE_H
#define FARLIGHT_GPU_SCENE_STATE_H

#include "base/hashmap.h"
#include "gpu_scene/scene.h"
#include "gpu_scene/deform.h"
#include "gpu_scene/emitter.h"
#include "gpu_scene/packing.h"

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
struct texture_info;
struct light;

struct gpu_scene_state {
    /* Mirrors of buffers. */
    char *tables; /* NULL: none are there yet */
    struct light *lights;
    /* Tables, beside the geometries and the discs of the scene. */
    struct material *materials;
    struct texture_slot *texture_slots;
    struct texture_info *textures;
    uint32_t texture_slot_count, texture_count;
    bool stale_tables; /* those on the device are not what these say */
    struct material_indices material_indices;
    uint64_t shapes_signature; /* of the meshes and sphere sets that are packed */
    uint64_t discs_signature;
    uint64_t textures_signature;
    uint64_t environment_revision;
    uint32_t environment_rows;          /* of its image that are uploaded */
    struct hashmap texture_index_by_id; /* value: (index + 1) as a pointer */
    uint32_t rigid_count;               /* geometries that do not deform: the first ones */
    uint32_t close_vertex;              /* where the deforming geometries' vertices as the shutter closes begin */
    struct gpu_scene_deform deform;
    struct emitters emitters;
    bool stale_emitters;  /* something changed that they follow from */
    unsigned posed_parts; /* POSED_*, by the last update: without poses they are elsewhere again */
    bool any_update;      /* false: nothing is there yet */
    /* What gpu_scene_bring() is at, and what it has changed since the last update. */
    bool is_bringing, has_brought;
    uint64_t brought_revision; /* of the scene, with `has_brought` */
    struct packing packing;
    struct texture_packing *texture_packing; /* owned; NULL: no texture is packed */
    struct scene_changes brought;
};

/* Spreads an id and a revision over 64 bits. */
uint64_t gpu_scene_mix(uint64_t x);
/* Changes when an object of the kind is added, removed or set again; 0 for none. */
uint64_t gpu_scene_signature(const struct scene *scene, enum object_kind kind);

/* More than the device's texel buffers can hold is refused: "5 `what`; this device's ..." */
bool gpu_scene_check_texels(const struct gpu_scene *gpu, uint64_t count, const char *what, struct error *error);

/* material.c. Indices first: geometry is packed with them. */
bool gpu_scene_index_materials(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
uint32_t gpu_scene_material_index(const struct gpu_scene *gpu, uint32_t material_id); /* 0: the default */
bool gpu_scene_pack_materials(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                              struct scene_changes *changes, struct error *error);
/* texture.c. Lists what is to be packed, nothing where no texture changed; the second, once it is. */
bool gpu_scene_list_textures(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
bool gpu_scene_finish_textures(struct gpu_scene *gpu, struct error *error);
void gpu_scene_drop_texture_packing(struct gpu_scene *gpu);
uint32_t gpu_scene_texture_index(const struct gpu_scene *gpu, uint32_t texture_id, bool *found);
/* geometry.c. Lists what is to be packed, nothing where no shape changed. */
bool gpu_scene_list_geometry(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
/* Which geometry has cutouts, what the scene has of special materials. */
void gpu_scene_classify_geometry(struct gpu_scene *gpu, const struct scene *scene,
                                 const struct scene_motion *motion);
/* deform.c. Brings the vertices of what deforms to the first pose and to the last. */
bool gpu_scene_deform(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct error *error);
/* Whether the vertices of some geometry are others as the shutter closes. */
bool gpu_scene_any_closes(const struct gpu_scene *gpu);
/* instance.c */
bool gpu_scene_upload_instances(struct gpu_scene *gpu, const struct scene *scene,
                                const struct scene_motion *motion, struct scene_changes *changes,
                                struct error *error);
bool gpu_scene_pack_discs(struct gpu_scene *gpu, const struct scene *scene, struct scene_changes *changes,
                          struct error *error);
/* Of the instances; empty (lower above upper) if there are none. */
void gpu_scene_all_instance_bounds(const struct gpu_scene *gpu, float lower[3], float upper[3]);
/* emitter.c. As the shutter opens; after the instances. */
bool gpu_scene_make_emitters(struct gpu_scene *gpu, struct error *error);
/* tables.c. What differs from the mirror, where they are stale. */
bool gpu_scene_upload_tables(struct gpu_scene *gpu, struct scene_changes *changes, struct error *error);
/* light.c. As the shutter opens; the bounds too. */
bool gpu_scene_upload_lights(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                             struct scene_changes *changes, struct error *error);

#endif
