/* SPDX-License-Identifier: MIT */
/* The scene that clients describe: revisioned, edited in transactions. Objects hold the
 * records of protocol/values.def. Knows neither GL nor messages. Not thread-safe: a scene belongs to the thread
 * that owns GL. */
#ifndef FARLIGHT_SCENE_SCENE_H
#define FARLIGHT_SCENE_SCENE_H

#include "base/blob.h"
#include "base/error.h"
#include "base/hashmap.h"
#include "protocol/values.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SCENE_NAME_MAX 128
#define SCENE_DEPTH_MAX 256 /* maximum depth of the node hierarchy, whatever the limits */
#define MESH_INFLUENCES_MAX 16
#define MESH_TARGETS_MAX 1024
#define SKIN_JOINTS_MAX 65536

/* Positions in a mesh's `arrays`, and in a material's `textures`. */
enum mesh_array {
    MESH_POSITIONS,   /* 3 f32 per vertex */
    MESH_INDICES,     /* 3 u32 per triangle */
    MESH_NORMALS,     /* 3 f32 */
    MESH_TANGENTS,    /* 4 f32, the last is the handedness */
    MESH_TEXCOORDS_0, /* 2 f32 */
    MESH_TEXCOORDS_1,
    MESH_COLOURS,          /* 4 u8, or 4 u16 where mesh_has_wide_colours(); linear */
    MESH_JOINTS,           /* influence_count u16, places in the skin */
    MESH_WEIGHTS,          /* influence_count f32, not negative; their sum counts as 1 */
    MESH_TARGET_POSITIONS, /* offsets of the morph targets: 3 f32 per vertex, target after target */
    MESH_TARGET_NORMALS,
    MESH_TARGET_TANGENTS,
    MESH_ARRAY_COUNT
};
#define MATERIAL_TEXTURE_COUNT MATERIAL_COUNT /* count of base/words.h */

/* Head of every object; `revision` is that of the transaction that last changed it. */
struct scene_object {
    uint32_t id;
    uint64_t revision;
    char name[SCENE_NAME_MAX + 1];
};

struct scene_node {
    struct scene_object base;
    struct record_node value;
    float *weights; /* weights of the mesh's morph targets, owned; NULL: the mesh's own */
    uint32_t weight_count;
    uint32_t child_count; /* number of direct children, maintained by the scene */
};

struct scene_mesh {
    struct scene_object base;
    struct record_mesh value;
    struct blob *arrays[MESH_ARRAY_COUNT]; /* NULL: missing. Checked: sizes fit the counts, indices are in range,
                                              positions finite */
    uint32_t joint_places;                 /* places in a skin that MESH_JOINTS uses; filled by the check */
    float *weights;                        /* weights of the targets for nodes without their own; owned; missing
                                              ones are 0 */
    uint32_t weight_count;
    struct record_material_range *ranges; /* owned */
    uint32_t range_count;
    float lower[3], upper[3]; /* bounds of the undeformed mesh in object space */
};

struct scene_spheres {
    struct scene_object base;
    struct record_spheres value;
    struct blob *centres_radii; /* 4 f32 per sphere; checked: finite, radius > 0 */
    struct record_material_range *ranges;
    uint32_t range_count;
    float lower[3], upper[3];
};

struct scene_material {
    struct scene_object base;
    struct record_material value;
    struct record_texture_use textures[MATERIAL_TEXTURE_COUNT];
};

struct scene_texture {
    struct scene_object base;
    struct record_texture value;
    struct blob *texels; /* width x height x 4 bytes, rows from the top */
};

struct scene_light {
    struct scene_object base;
    struct record_light value;
};

struct scene_camera {
    struct scene_object base;
    struct record_camera value;
};

struct scene_disc {
    struct scene_object base;
    struct record_disc value;
};

struct scene_skin {
    struct scene_object base;
    struct record_skin value;
    struct blob *joints;          /* u32 node ids; checked: the nodes exist */
    struct blob *joint_from_mesh; /* 12 f32 each, 3x4 row-major; NULL: identity */
};

struct scene_clip {
    struct scene_object base;
    struct blob *floats; /* times and values of its channels; checked: finite */
};

struct scene_channel {
    struct scene_object base;
    struct record_channel value; /* checked: all its floats are in the clip, times ascend */
};

struct scene_environment {
    uint64_t revision;
    struct record_environment value;
    struct blob *texels; /* 4 half floats a texel; NULL: constant colour */
};

/* An edit of a transaction. Its pointers (blobs, ranges) move to the scene with a successful commit and stay
 * with the edit otherwise; scene_edit_finish releases them in either case. */
enum scene_edit_kind { EDIT_SET, EDIT_REMOVE, EDIT_SET_ENVIRONMENT };

struct scene_edit {
    enum scene_edit_kind kind;
    enum object_kind object; /* for set and remove; also the kind of an object that was read */
    uint32_t id;             /* for remove */
    union {
        struct scene_node node;
        struct scene_mesh mesh;
        struct scene_spheres spheres;
        struct scene_material material;
        struct scene_texture texture;
        struct scene_light light;
        struct scene_camera camera;
        struct scene_disc disc;
        struct scene_skin skin;
        struct scene_clip clip;
        struct scene_channel channel;
        struct scene_environment environment;
    } set;
};
void scene_edit_finish(struct scene_edit *edit);

struct scene_limits {
    uint64_t host_bytes;  /* its tables alone, which no other scene shares; 0: no limit */
    uint64_t table_bytes; /* its tables alone, which no other scene shares; 0: no limit */
    uint32_t nodes;       /* 0: 4 Mi */
    uint32_t depth;       /* depth of the node hierarchy, a root has 1; 0, or more than that: SCENE_DEPTH_MAX */
};

struct scene {
    char name[SCENE_NAME_MAX + 1];
    uint64_t revision;                    /* revision of the last transaction; 0: empty */
    struct hashmap objects[OBJECT_COUNT]; /* struct scene_node * and so on, by id */
    struct scene_environment environment;
    struct scene_limits limits;
    uint64_t host_bytes;  /* tables, and blobs held by objects, counted per object */
    uint64_t table_bytes; /* tables alone */
    /* Revision of the last change of each kind of object, for owners of copies. */
    uint64_t geometry_revision;  /* meshes, spheres, discs: their shape */
    uint64_t instances_revision; /* nodes: their set, places, visibility */
    uint64_t shading_revision;   /* materials, textures */
    uint64_t lights_revision;    /* lights, environment, nodes that show lights */
};

struct scene *scene_create(const char *name, const struct scene_limits *limits); /* NULL: out of memory */
void scene_destroy(struct scene *scene);                                         /* accepts NULL */

/* Applies all edits, or none and sets *error, whose field names the edit: "edits[17] (mesh 3).ranges[2].material".
 * Checked: identifiers, references, array sizes, index ranges, finite positions, cycles, depth, limits. Edits are
 * checked together: the last edit of an object counts, and an edit may refer to an object that a later one makes.
 * A removed node removes its subtree in its state after the other edits. */
bool scene_commit(struct scene *scene, struct scene_edit *edits, size_t edit_count, struct error *error);
/* Commits like scene_commit(), but ends soon with ERROR_CANCELLED and an unchanged scene if another thread sets
 * *abandoned in time. */
bool scene_commit_unless(struct scene *scene, struct scene_edit *edits, size_t edit_count,
                         const atomic_bool *abandoned, struct error *error);
/* Whether every object that the edits set or remove exists and has not changed since a revision. False: *error,
 * of kind ERROR_CONFLICT, names the first that does not or has. */
bool scene_edits_are_current(const struct scene *scene, const struct scene_edit *edits, size_t edit_count,
                             uint64_t base_revision, struct error *error);
/* Whether a transaction takes no longer than a slice of a frame, whatever its edits. */
bool scene_commit_is_short(const struct scene *scene, const struct scene_edit *edits, size_t edit_count);
/* Maximum growth of a scene's tables by the edits. */
uint64_t scene_edits_table_bytes(const struct scene_edit *edits, size_t edit_count);

/* Find objects by identifier; NULL if there is none. */
const struct scene_node *scene_node(const struct scene *scene, uint32_t id);
const struct scene_mesh *scene_mesh(const struct scene *scene, uint32_t id);
/* Whether its colours have 16 bits each. */
bool mesh_has_wide_colours(const struct scene_mesh *mesh);
const struct scene_spheres *scene_spheres(const struct scene *scene, uint32_t id);
const struct scene_material *scene_material(const struct scene *scene, uint32_t id);
/* Absorption of the body behind a material for a colour channel, 1 / metre. */
float scene_material_absorption(const struct scene_material *material, int channel);
/* Factor of a shadow ray's light at one of a body's two surfaces for the absorption between them: 1 if it is
 * clear. */
float scene_material_body_tint(const struct scene_material *material, int channel);
const struct scene_texture *scene_texture(const struct scene *scene, uint32_t id);
const struct scene_light *scene_light(const struct scene *scene, uint32_t id);
const struct scene_camera *scene_camera(const struct scene *scene, uint32_t id);
const struct scene_skin *scene_skin(const struct scene *scene, uint32_t id);
const struct scene_clip *scene_clip(const struct scene *scene, uint32_t id);

/* Reads an edit that would make a node, material, light or camera in its present state; the caller finishes it.
 * False and *error: there is no such object, it is of another kind, or no memory. */
bool scene_read_object(const struct scene *scene, enum object_kind kind, uint32_t id, struct scene_edit *edit,
                       struct error *error);

struct scene_pose; /* scene/pose.h */

/* Flattened hierarchy: every visible node with its transform. That of a mesh with a skin is the identity, as
 * its vertices are in world space (scene_deform). */
struct scene_instance {
    const struct scene_node *node;
    float world_from_object[12];
    float object_from_world[12]; /* zero where `singular` */
    bool singular;               /* the transform is singular: its geometry is skipped */
    uint8_t light_group;         /* the node's own, or the nearest ancestor's; 0: none */
};
/* In the functions below, `pose` places the objects; NULL: as committed. */
/* Lists instances of one kind in the order of node ids; an array to free(). False: out of memory. */
bool scene_flatten(const struct scene *scene, const struct scene_pose *pose, enum node_kind kind,
                   struct scene_instance **instances, size_t *count);
/* World transform of a node (hidden or not). False: the node does not exist. */
bool scene_world_from_node(const struct scene *scene, const struct scene_pose *pose, uint32_t node,
                           float world_from_node[12]);
/* Bounds in world space of everything visible, without discs unless there is nothing else. Deforming meshes
 * count in the pose, unless they have hundreds of millions of vertices. False: nothing is visible. */
bool scene_bounds(const struct scene *scene, const struct scene_pose *pose, float lower[3], float upper[3]);
/* Bounds of a node and the nodes below it, by the same rules; root 0: of all. */
bool scene_bounds_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root, float lower[3],
                        float upper[3]);
/* Maximum dot product, for each direction in world space, over the points that scene_bounds_below() includes:
 * vertices that triangles use, spheres, discs. For a mesh with fewer vertices than corners any of its vertices
 * within its bounds may count. With `axis`, x and z of a vertical, over all places that these reach as they
 * turn about it. False: nothing is visible. */
#define SCENE_SUPPORTS_MAX 5
bool scene_supports_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root,
                          const double *axis, const double (*directions)[3], double *supports, size_t count);

#endif
