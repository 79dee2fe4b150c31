/* SPDX-License-Identifier: MIT */
/* The result of an import: a list of edits (the protocol's own messages) and the bytes that they refer to.
 * The readers of formats (gltf/import.h and its like) add to it, send.c sends it.
 *
 * A reader turns bytes of the model file into edits. It returns false, with the scene failed, if the model cannot
 * be used; parts that cannot be shown become notes. It does not throw, reads files only through `files` (files.h),
 * and checks every index, count and number of the input before it is used.
 *
 * Everything is checked here again, whatever the reader has checked: counts, indices, finite
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
#define IMPORT_RANGES_MAX 4096 /* limit of a SET_MESH or SET_SPHERES */
#define IMPORT_ARRAYS_MAX 12
#define IMPORT_INFLUENCES_MAX 16 /* joints that move a vertex */
#define IMPORT_JOINTS_MAX 65536  /* limit of a skin */
#define IMPORT_TARGETS_MAX 1024  /* morph targets of a mesh */
/* Sum of all blobs: a small file that requests much must not fill the memory of three programs. */
#define IMPORT_BYTES_MAX (6ULL << 30)

/* Bytes that edits refer to by number, 1 + position; 0 is none. */
struct import_blob {
    unsigned char *bytes; /* malloc'd, owned */
    uint64_t size_bytes;
    uint8_t hash[32];
    uint32_t same_as; /* set by import_hash(): position of the first blob with the same hash, maybe this one */
};

struct import_edit {
    struct message message;            /* a SET_..; its arrays of blob_ref are filled in when it is sent */
    uint32_t blobs[IMPORT_ARRAYS_MAX]; /* numbers of blobs */
};

struct import_notice {
    enum protocol_severity severity;
    uint32_t count;
    char file[257]; /* the scene's file at the time of the note */
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

/* Bounds of a mesh or a set of spheres, in its own space. */
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
    uint32_t notes_lost; /* approximate number of distinct notes beyond IMPORT_NOTES_MAX */
    uint32_t last_id[PROTOCOL_OBJECT_COUNT];
    uint32_t default_material; /* material of primitives without one; 0: not needed so far */
    uint64_t blob_bytes;
    char file[257];                     /* the current model's name for people; part of `where` */
    char prefix[IMPORT_PREFIX_MAX + 1]; /* the current model's prefix of all names; empty: none */
    uint32_t root;                      /* the current model's node above all others; 0: none */
    bool is_added;                      /* true for further models, whose cameras and background are left out */
    bool display_values; /* the model is alone, so its colours may stay display values if its format has such */
    double point_size;   /* diameter of points and lines without faces, metres; 0: derived from their distances */
    /* The requested variant of the materials; NULL: the file's default. Readers of formats without variants
     * ignore it */
    const char *variant;
    float origin[3]; /* subtracted from all positions (origin.h); 0: nothing */
    bool failed;
    struct import_notice failure;
};

void import_scene_init(struct import_scene *scene, const char *file);
void import_scene_finish(struct import_scene *scene);

/* Gives up; the first message is kept. `where` names the place in the file ("mesh 3") or a file; NULL: the
 * model file as a whole. Returns false. */
bool import_fail(struct import_scene *scene, const char *where, const char *format, ...)
    __attribute__((format(printf, 3, 4)));

/* Adds a note for the user. A repeated text is only counted. */
void import_note(struct import_scene *scene, enum protocol_severity severity, const char *where,
                 const char *format, ...) __attribute__((format(printf, 4, 5)));

/* Takes `bytes` (malloc'd) in any case. Returns the blob's number; 0: failed, or `bytes` is NULL. */
uint32_t import_add_blob(struct import_scene *scene, void *bytes, uint64_t size_bytes);

/* Add an object: return its identifier, 0 if the scene has failed. Identifiers in the message are ignored;
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

/* Reserves an identifier for an object that is added later, so that other objects can refer to it. */
uint32_t import_reserve_id(struct import_scene *scene, enum protocol_object_kind kind);
/* Adds a skin with a reserved identifier. `joints` (node identifiers) and `joint_from_mesh` (12 floats each,
 * 3x4 row-major; NULL: identity) are malloc'd and taken in any case. */
bool import_add_skin(struct import_scene *scene, uint32_t skin, const char *name, uint32_t joint_count,
                     uint32_t *joints, float *joint_from_mesh);
/* Adds a clip with a reserved identifier; `floats` are malloc'd and taken in any case. */
bool import_add_clip(struct import_scene *scene, uint32_t clip, const char *name, float *floats, uint32_t count);
/* Adds a channel, before or after its clip. The caller guarantees that it lies within the clip's floats and
 * that times ascend. */
uint32_t import_add_channel(struct import_scene *scene, const struct message_set_channel *channel);
/* Lists a clip for the user; `clip` 0: it cannot be played. */
void import_list_clip(struct import_scene *scene, uint32_t clip, const char *name, uint32_t channels,
                      double duration_s);

/* Lists a variant of the materials for the user. */
void import_list_variant(struct import_scene *scene, const char *name);

/* A mesh. Arrays are malloc'd and taken in any case; only positions and indices are required. */
struct import_mesh {
    const char *name;
    const char *where; /* place in the file, for errors; may be NULL */
    uint32_t vertex_count, triangle_count;
    float *positions;    /* 3 a vertex */
    uint32_t *indices;   /* 3 a triangle */
    float *normals;      /* 3 */
    float *tangents;     /* 4 */
    float *texcoords[2]; /* 2 */
    uint16_t *colours;   /* 4, linear; 65535 is 1 */
    uint32_t influence_count, target_count;
    uint16_t *joints;         /* influence_count a vertex: indices into the skin, which the caller checks */
    float *joint_weights;     /* influence_count a vertex */
    float *target_offsets[3]; /* offsets of positions, normals, tangents: 3 a vertex, target after target */
    const struct record_morph_weight *weights; /* initial weights of the morph targets; copied */
    uint32_t weight_count;
    struct record_material_range *ranges;
    uint32_t range_count;
};
uint32_t import_add_mesh(struct import_scene *scene, struct import_mesh *mesh);
/* Marks closed meshes in their edits (closed.h), once all objects are added. Blobs may be hashed and sent
 * meanwhile. */
void import_mark_closed(struct import_scene *scene);
/* Sets the thickness of materials that absorb light to that of the closed meshes with them; after
 * import_mark_closed. */
void import_measure_bodies(struct import_scene *scene);
void import_mesh_finish(struct import_mesh *mesh); /* frees a mesh that was not added */

/* Adds spheres; `spheres` (4 floats each) and `ranges` are taken. */
uint32_t import_add_spheres(struct import_scene *scene, const char *name, float *spheres, uint32_t count,
                            struct record_material_range *ranges, uint32_t range_count);

/* Sets a 3x4 row-major matrix to the identity. */
void import_identity(float parent_from_node[12]);
/* Sets a material to the defaults of glTF, opaque white, without textures. */
void import_material_default(struct message_set_material *material);
void import_texture_use_default(struct record_texture_use *use, uint32_t texture);

/* Sets the hashes and `same_as`, with two threads for large scenes. False: failed. */
bool import_hash(struct import_scene *scene);

#ifdef __cplusplus
}
#endif

#endif
