/* SPDX-License-Identifier: MIT */
/* Private to gpu_scene*.c: functions of the parts of the copy, one file each, and their state between updates. */
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
    uint32_t count;             /* indices assigned so far, including the default material's 0 */
    uint32_t *free;             /* indices of removed materials */
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
    /* Tables, in addition to the geometries and discs of the scene. */
    struct material *materials;
    struct texture_slot *texture_slots;
    struct texture_info *textures;
    uint32_t texture_slot_count, texture_count;
    bool stale_tables; /* the device's tables differ from these */
    struct material_indices material_indices;
    uint64_t shapes_signature; /* signature of the meshes and sphere sets that are packed */
    uint64_t discs_signature;
    uint64_t textures_signature;
    uint64_t environment_revision;
    uint32_t environment_rows;          /* uploaded rows of its image */
    struct hashmap texture_index_by_id; /* value: (index + 1) as a pointer */
    uint32_t rigid_count;               /* number of geometries that do not deform: the first ones */
    uint32_t close_vertex;              /* first vertex of the deforming geometries at shutter close */
    struct gpu_scene_deform deform;
    struct emitters emitters;
    bool stale_emitters;  /* their inputs have changed */
    unsigned posed_parts; /* POSED_*, of the last update: without poses these objects return to their places */
    bool any_update;      /* false: the copy is empty */
    /* State of gpu_scene_bring(), and its changes since the last update. */
    bool is_bringing, has_brought;
    uint64_t brought_revision; /* revision of the scene, with `has_brought` */
    struct packing packing;
    struct texture_packing *texture_packing; /* owned; NULL: no texture is packed */
    struct scene_changes brought;
};

/* Spreads an id and a revision over 64 bits. */
uint64_t gpu_scene_mix(uint64_t x);
/* A number that changes when an object of the kind is added, removed or set again; 0 for none. */
uint64_t gpu_scene_signature(const struct scene *scene, enum object_kind kind);

/* Refuses more than the device's texel buffers hold: "5 `what`; this device's ..." */
bool gpu_scene_check_texels(const struct gpu_scene *gpu, uint64_t count, const char *what, struct error *error);

/* material.c. Assigns indices, before geometry is packed with them. */
bool gpu_scene_index_materials(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
uint32_t gpu_scene_material_index(const struct gpu_scene *gpu, uint32_t material_id); /* 0: the default */
bool gpu_scene_pack_materials(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                              struct scene_changes *changes, struct error *error);
/* texture.c. Lists the textures to be packed, none if none has changed; finishes after they are packed. */
bool gpu_scene_list_textures(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
bool gpu_scene_finish_textures(struct gpu_scene *gpu, struct error *error);
void gpu_scene_drop_texture_packing(struct gpu_scene *gpu);
uint32_t gpu_scene_texture_index(const struct gpu_scene *gpu, uint32_t texture_id, bool *found);
/* geometry.c. Lists the shapes to be packed, none if none has changed. */
bool gpu_scene_list_geometry(struct gpu_scene *gpu, const struct scene *scene, struct error *error);
/* runs.c. Reserves the runs of a geometry when it is listed, and finds them while it is packed, on any thread. */
bool gpu_scene_reserve_runs(struct gpu_scene_geometry *geometry, struct error *error);
void gpu_scene_find_runs(const struct gpu_scene_geometry *geometry);
void gpu_scene_drop_geometries(struct gpu_scene *gpu);
/* Finds the geometries with cutouts, and the special materials of the scene. */
void gpu_scene_classify_geometry(struct gpu_scene *gpu, const struct scene *scene,
                                 const struct scene_motion *motion);
/* deform.c. Deforms vertices to the first pose and to the last. */
bool gpu_scene_deform(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                      struct scene_changes *changes, struct error *error);
/* Whether some geometry has other vertices at shutter close. */
bool gpu_scene_any_closes(const struct gpu_scene *gpu);
/* instance.c. Uploads instances, discs and their bounds. */
bool gpu_scene_upload_instances(struct gpu_scene *gpu, const struct scene *scene,
                                const struct scene_motion *motion, struct scene_changes *changes,
                                struct error *error);
bool gpu_scene_pack_discs(struct gpu_scene *gpu, const struct scene *scene, struct scene_changes *changes,
                          struct error *error);
/* Bounds of the instances; empty (lower above upper) if there are none. */
void gpu_scene_all_instance_bounds(const struct gpu_scene *gpu, float lower[3], float upper[3]);
/* emitter.c. Makes the emitters at shutter open; after the instances. */
bool gpu_scene_make_emitters(struct gpu_scene *gpu, struct error *error);
/* tables.c. Uploads the difference to the mirror if the tables are stale. */
bool gpu_scene_upload_tables(struct gpu_scene *gpu, struct scene_changes *changes, struct error *error);
/* light.c. Uploads the lights at shutter open, and the bounds. */
bool gpu_scene_upload_lights(struct gpu_scene *gpu, const struct scene *scene, const struct scene_motion *motion,
                             struct scene_changes *changes, struct error *error);

#endif
