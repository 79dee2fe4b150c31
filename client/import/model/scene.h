/* SPDX-License-Identifier: MIT */
/* The result of an import: a growing list of edits (the protocol's own messages) and the bytes that they refer to.
 * The readers of formats (gltf/import.h and its like) add to it, send.c speaks it.
 *
 * A reader makes bytes of the model file to edits. It returns false, with the scene failed, if the model cannot be
 * used; parts that merely cannot be shown become notes. It does not throw, reads no file but through `files`
 * (files.h), and checks every index, count and number of the input before it is used.
 *
 * Everything that is added is checked here once more, whatever the reader promised: counts, indices, finite
 * numbers, ranges of the protocol. The first failure is kept in the scene; later calls do nothing more.
 * Not thread-safe. C and C++; no function throws. */
#ifndef FARLIGHT_IMPORT_MODEL_SCENE_H
#define FARLIGHT_IMPORT_MODEL_SCENE_H

#include "protocol/messages.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

#define IMPORT_NOTES_MAX 200
#define IMPORT_NAME_MAX 128
#define IMPORT_PREFIX_MAX 40
#define IMPORT_RANGES_MAX 4096 /* of one SET_MESH or SET_SPHERES */
#define IMPORT_ARRAYS_MAX 12
#define IMPORT_INFLUENCES_MAX 16 /* joints that move one vertex */
#define IMPORT_JOINTS_MAX 65536  /* of one skin */
#define IMPORT_TARGETS_MAX 1024  /* morph targets of one mesh */
/* Sum of all blobs: keeps a small file that asks for much from filling the memory of three programs. */
#define IMPORT_BYTES_MAX (6ULL << 30)

/* Bytes that edits refer to, by number: 1 + position, 0 is none. */
struct import_blob {
    unsigned char *bytes; /* malloc'd, owned */
    uint64_t size_bytes;
    uint8_t hash[32];
    uint32_t same_as; /* after import_hash(): position of the first blob with the same hash, maybe itself */
};

struct import_edit {
    struct message message;            /* a SET_..; its arrays of blob_ref are filled in when it is sent */
    uint32_t blobs[IMPORT_ARRAYS_MAX]; /* numbers */
};

struct import_notice {
    enum protocol_severity severity;
    uint32_t count;
    char file[257]; /* as of the scene when it was noted */
    char where[257];
    char text[481];
};

struct import_clip {
    char name[IMPORT_NAME_MAX + 1];
    uint32_t clip; /* 0: nothing to play */
    uint32_t channels;
    float duration_s;
};

struct import_variant {
    char name[IMPORT_NAME_MAX + 1];
};

/* Of a mesh or a set of spheres, in its own space. */
struct import_bounds {
    enum protocol_node_kind kind;
    uint32_t object;
    float lower[3], upper[3];
};

struct import_scene {
    struct import_edit *edits;
    size_t edit_count, edit_capacity;
    struct import_blob *blobs;
    size_t blob_count, blob_capacity;
    struct import_clip *clips;
    size_t clip_count, clip_capacity;
    struct import_variant *variants;
    size_t variant_count, variant_capacity;
    struct import_bounds *bounds;
    size_t bounds_count, bounds_capacity;
    struct import_notice notes[IMPORT_NOTES_MAX];
    size_t note_count;
    uint32_t notes_lost; /* distinct ones beyond IMPORT_NOTES_MAX, about */
    uint32_t last_id[PROTOCOL_OBJECT_COUNT];
    uint32_t default_material; /* of what has none; 0: all have had one so far */
    uint64_t blob_bytes;
    char file[257];                     /* the current model's, as people named it; goes into `where` */
    char prefix[IMPORT_PREFIX_MAX + 1]; /* likewise, of all names; empty: none */
    uint32_t root;                      /* likewise, the node above all others; 0: none */
    bool is_added;                      /* it is not the first: its cameras and background are left out */
    bool display_values; /* it is alone, so that its colours may stay a display's values where its format has such
                          */
    double point_size;   /* diameter of points and lines without faces, metres; 0: chosen by their distances */
    const char *variant; /* of the materials, that the user wants; NULL: the file's choice. Readers of formats
                            without variants need not look */
    float origin[3];     /* what was subtracted from all places (origin.h); 0: nothing */
    bool failed;
    struct import_notice failure;
};

void import_scene_init(struct import_scene *scene, const char *file);
void import_scene_finish(struct import_scene *scene);

/* Gives up: keeps the first message. `where` names the place in the file ("mesh 3") or a file; NULL: the model
 * file as a whole. Returns false. */
bool import_fail(struct import_scene *scene, const char *where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* A note for the user. A repeated text is only counted. */
void import_note(struct import_scene *scene, enum protocol_severity severity, const char *where,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Takes `bytes` (malloc'd) whether it succeeds or not. Returns the blob's number; 0: failed, or `bytes` is NULL.
 */
uint32_t import_add_blob(struct import_scene *scene, void *bytes, uint64_t size_bytes);

/* Each returns the new object's identifier, 0 if the scene has failed. Identifiers in the message are ignored;
 * names are copied, cut to the protocol's length and mended to UTF-8. Numbers that the protocol does not allow
 * fail. */
uint32_t import_add_node(struct import_scene *scene, const struct message_set_node *node);
uint32_t import_add_material(struct import_scene *scene, const struct message_set_material *material);
uint32_t import_add_light(struct import_scene *scene, const struct message_set_light *light);
uint32_t import_add_camera(struct import_scene *scene, const struct message_set_camera *camera);
uint32_t import_add_texture(struct import_scene *scene, const struct message_set_texture *texture,
                            uint32_t texels);
void import_set_environment(struct import_scene *scene, const struct message_set_environment *environment,
                            uint32_t texels);

/* An identifier for an object that is added later, so that others can name it before. */
uint32_t import_reserve_id(struct import_scene *scene, enum protocol_object_kind kind);
/* A skin of a reserved identifier. `joints` (node identifiers) and `joint_from_mesh` (12 floats each, 3x4
 * row-major; NULL: identity) are malloc'd and taken whether it succeeds or not. */
bool import_add_skin(struct import_scene *scene, uint32_t skin, const char *name, uint32_t joint_count,
                     uint32_t *joints, float *joint_from_mesh);
/* A clip of a reserved identifier; `floats` are malloc'd and taken whether it succeeds or not. */
bool import_add_clip(struct import_scene *scene, uint32_t clip, const char *name, float *floats, uint32_t count);
/* The clip may be added before or after its channels; that all of it lies within the clip's floats and that times
 * ascend is the caller's promise. */
uint32_t import_add_channel(struct import_scene *scene, const struct message_set_channel *channel);
/* Announces a clip to the user; `clip` 0: it cannot be played. */
void import_list_clip(struct import_scene *scene, uint32_t clip, const char *name, uint32_t channels,
                      double duration_s);

/* Announces a variant of the materials to the user. */
void import_list_variant(struct import_scene *scene, const char *name);

/* Arrays are malloc'd and taken whether it succeeds or not; those but positions and indices may be NULL. */
struct import_mesh {
    const char *name;
    const char *where; /* for messages; may be NULL */
    uint32_t vertex_count, triangle_count;
    float *positions;    /* 3 a vertex */
    uint32_t *indices;   /* 3 a triangle */
    float *normals;      /* 3 */
    float *tangents;     /* 4 */
    float *texcoords[2]; /* 2 */
    uint16_t *colours;   /* 4, linear; 65535 is 1 */
    uint32_t influence_count, target_count;
    uint16_t *joints;         /* influence_count a vertex: places in the skin, which are checked by the caller */
    float *joint_weights;     /* influence_count a vertex */
    float *target_offsets[3]; /* to positions, normals, tangents: 3 a vertex, target after target */
    const struct record_morph_weight *weights; /* of the morph targets; copied */
    uint32_t weight_count;
    struct record_material_range *ranges;
    uint32_t range_count;
};
uint32_t import_add_mesh(struct import_scene *scene, struct import_mesh *mesh);
/* Once all is added: says in the edit of each mesh whether it is closed (closed.h). Blobs may be hashed and sent
 * meanwhile. */
void import_mark_closed(struct import_scene *scene);
/* After that: sets the thickness of materials that absorb light to that of the closed meshes that have them. */
void import_measure_bodies(struct import_scene *scene);
void import_mesh_finish(struct import_mesh *mesh); /* for one that was not added */

/* `spheres` (4 floats each) and `ranges` are taken. */
uint32_t import_add_spheres(struct import_scene *scene, const char *name, float *spheres, uint32_t count,
                            struct record_material_range *ranges, uint32_t range_count);

/* 3x4 row-major. */
void import_identity(float parent_from_node[12]);
/* A material with the defaults of glTF, opaque white; textures are missing. */
void import_material_default(struct message_set_material *material);
void import_texture_use_default(struct record_texture_use *use, uint32_t texture);

/* Fills the hashes, with two threads where there is much, and `same_as`. False: failed. */
bool import_hash(struct import_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
