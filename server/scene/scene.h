/* SPDX-License-Identifier: MIT */
/* The scene as the clients describe it: revisioned, edited in transactions. Knows neither GL nor the
 * protocol. Not thread-safe: a scene belongs to the thread that owns GL. */
#ifndef FARLIGHT_SCENE_SCENE_H
#define FARLIGHT_SCENE_SCENE_H

#include "base/blob.h"
#include "base/error.h"
#include "base/hashmap.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define SCENE_NAME_MAX 128
#define SCENE_DEPTH_MAX 256 /* of the node hierarchy, whatever the limits */
#define MESH_INFLUENCES_MAX 16
#define MESH_TARGETS_MAX 1024
#define SKIN_JOINTS_MAX 65536

/* Positions in a mesh's `arrays`, and in a material's `textures`. */
enum mesh_array {
    MESH_POSITIONS,   /* 3 f32 a vertex */
    MESH_INDICES,     /* 3 u32 a triangle */
    MESH_NORMALS,     /* 3 f32 */
    MESH_TANGENTS,    /* 4 f32, the last is the handedness */
    MESH_TEXCOORDS_0, /* 2 f32 */
    MESH_TEXCOORDS_1,
    MESH_COLOURS,          /* 4 u8, or 4 u16 where mesh_has_wide_colours(); linear */
    MESH_JOINTS,           /* influence_count u16, places in the skin */
    MESH_WEIGHTS,          /* influence_count f32, not negative; their sum counts as 1 */
    MESH_TARGET_POSITIONS, /* offsets of the morph targets: 3 f32 a vertex, target after target */
    MESH_TARGET_NORMALS,
    MESH_TARGET_TANGENTS,
    MESH_ARRAY_COUNT
};
#define MATERIAL_TEXTURE_COUNT MATERIAL_COUNT /* of base/words.h */

struct material_range {
    uint32_t first, count; /* triangles or spheres */
    uint32_t material;     /* 0: the default material */
};

/* Every object begins with these; `revision` is that of the transaction that last changed it. */
struct scene_object {
    uint32_t id;
    uint64_t revision;
    char name[SCENE_NAME_MAX + 1];
};

struct scene_node {
    struct scene_object base;
    uint32_t parent; /* 0: the root */
    enum node_kind kind;
    uint32_t object; /* mesh, spheres, light, camera */
    bool hidden;
    float parent_from_node[12]; /* 3x4 row-major */
    uint32_t skin;              /* of a mesh with joints; 0: none. With one, the vertices are where the joints put
                                   them in world space, whatever the node's transform */
    float *weights;             /* of the mesh's morph targets, owned; NULL: the mesh's own */
    uint32_t weight_count;
    uint32_t light_group; /* of lights and glowing surfaces here and below, 1 .. 7; 0: that of the parent */
    uint32_t child_count; /* kept by the scene: how many nodes hang directly below */
};

struct scene_mesh {
    struct scene_object base;
    uint32_t vertex_count, triangle_count;
    struct blob *arrays[MESH_ARRAY_COUNT]; /* NULL: missing. Checked: sizes fit the counts, indices are in range,
                                              positions finite */
    uint32_t influence_count;              /* joints that move one vertex, 0 .. MESH_INFLUENCES_MAX */
    uint32_t joint_places;                 /* places in a skin that MESH_JOINTS reaches; filled by the check */
    uint32_t target_count;                 /* morph targets, 0 .. MESH_TARGETS_MAX */
    float *weights;                        /* of the targets, where a node has none; owned; missing ones are 0 */
    uint32_t weight_count;
    struct material_range *ranges;
    uint32_t range_count;
    bool closed; /* its triangles bound a body; the client's word, which only sampled structures take */
    float lower[3], upper[3]; /* bounds in object space, of the mesh as its vertices are given */
};

struct scene_spheres {
    struct scene_object base;
    uint32_t sphere_count;
    struct blob *centres_radii; /* 4 f32 a sphere; checked: finite, radius > 0 */
    struct material_range *ranges;
    uint32_t range_count;
    float lower[3], upper[3];
};

struct texture_use {
    uint32_t texture; /* 0: none */
    uint32_t texcoord_set;
    float uv_transform[6]; /* rows (a b c), (d e f) */
    float strength;
};

struct scene_material {
    struct scene_object base;
    enum alpha_mode alpha_mode;
    bool double_sided, unlit;
    bool emission_seen_only; /* a light shines in its place */
    float base_colour[4], emission[3];
    float metallic, roughness, transmission, ior, alpha_cutoff;
    float anisotropy, anisotropy_rotation; /* radians */
    float specular, specular_colour[3];    /* of a dielectric's mirror; 1: as Fresnel's equations have it */
    /* What a body of glass lets through on the distance, metres; 0: it is clear. `thickness`: of the body, for
     * shadow rays, which cross two of its surfaces. */
    float attenuation[3], attenuation_distance, thickness;
    float clearcoat, clearcoat_roughness;
    float sheen[3], sheen_roughness;
    float iridescence, iridescence_ior, iridescence_minimum_nm,
        iridescence_maximum_nm; /* of the film: thickness */
    float dispersion;           /* 20 / Abbe number */
    float diffuse_transmission, diffuse_transmission_colour[3];
    bool thin_walled;
    struct texture_use textures[MATERIAL_TEXTURE_COUNT];
};

struct scene_texture {
    struct scene_object base;
    uint32_t width, height;
    enum texture_format format;
    enum wrap wrap_u, wrap_v;
    bool nearest;
    struct blob *texels; /* width x height x 4 bytes, rows from the top */
};

struct scene_light {
    struct scene_object base;
    enum light_kind kind;
    float colour[3];
    float range;                  /* metres, 0: unlimited */
    float inner_cone, outer_cone; /* radians, half angles */
    float size[2];                /* rectangle: width, height; sphere: radius */
};

struct scene_camera {
    struct scene_object base;
    float fov_y;  /* radians; 0: orthographic */
    float height; /* metres, orthographic */
    float near;   /* metres */
};

struct scene_disc {
    struct scene_object base;
    uint32_t material;
    float centre_world[3], normal_world[3], radius;
};

struct scene_skin {
    struct scene_object base;
    uint32_t joint_count;
    struct blob *joints;          /* u32 node ids; checked: the nodes exist */
    struct blob *joint_from_mesh; /* 12 f32 each, 3x4 row-major; NULL: identity */
};

struct scene_clip {
    struct scene_object base;
    struct blob *floats; /* times and values of its channels; checked: finite */
};

struct scene_channel {
    struct scene_object base;
    uint32_t clip;
    enum channel_path path;
    uint32_t object; /* node, light, material; 0: the view */
    enum interpolation interpolation;
    uint32_t width; /* numbers of a value */
    uint32_t key_count;
    uint32_t first_time, first_value; /* in the clip's floats; checked: all of it is there, times ascend */
};

struct scene_environment {
    uint64_t revision;
    float colour[3];
    float rotation; /* radians, about +y */
    uint32_t width, height;
    struct blob *texels;  /* 4 half floats a texel; NULL: constant colour */
    bool backdrop;        /* the constant colour is seen and lights nothing */
    bool display_values;  /* of the whole scene: colours and light are a display's values, not linear */
    uint32_t light_group; /* 1 .. 7; 0: none */
    bool keeps_image;     /* of an edit: it gets the image that is there */
};

/* One edit of a transaction. Its pointers (blobs, ranges) pass to the scene with a successful commit and stay with
 * the edit otherwise; scene_edit_finish releases them in either case. */
enum scene_edit_kind { EDIT_SET, EDIT_REMOVE, EDIT_SET_ENVIRONMENT };

struct scene_edit {
    enum scene_edit_kind kind;
    enum object_kind object; /* for set and remove; of an object that was read */
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
    uint64_t host_bytes;  /* blobs and tables of this scene; 0: no limit */
    uint64_t table_bytes; /* its tables alone, which no other scene shares; 0: no limit */
    uint32_t nodes;       /* 0: 4 Mi */
    uint32_t depth;       /* of the node hierarchy, a root has 1; 0, or more than that: SCENE_DEPTH_MAX */
};

struct scene {
    char name[SCENE_NAME_MAX + 1];
    uint64_t revision;                    /* of the last transaction; 0: empty */
    struct hashmap objects[OBJECT_COUNT]; /* struct scene_node * and so on, by id */
    struct scene_environment environment;
    struct scene_limits limits;
    uint64_t host_bytes;  /* blobs that objects hold, counted per object, and tables */
    uint64_t table_bytes; /* of them: tables */
    /* The revision of the last change of each kind of object, for owners of copies. */
    uint64_t geometry_revision;  /* meshes, spheres, discs: their shape */
    uint64_t instances_revision; /* nodes: which, where, hidden */
    uint64_t shading_revision;   /* materials, textures */
    uint64_t lights_revision;    /* lights, environment, nodes that show lights */
};

struct scene *scene_create(const char *name, const struct scene_limits *limits); /* NULL: out of memory */
void scene_destroy(struct scene *scene);                                         /* accepts NULL */

/* Applies all edits, or none and sets *error, whose field names the edit: "edits[17] (mesh 3).ranges[2].material".
 * Checked: identifiers, references, array sizes, index ranges, finite positions, cycles, depth, limits. Edits are
 * looked at together: the last edit of an object counts, and an edit may refer to what a later one makes. A
 * removed node removes its subtree as it is after the other edits. */
bool scene_commit(struct scene *scene, struct scene_edit *edits, size_t edit_count, struct error *error);
/* The same; ends soon with ERROR_CANCELLED and an unchanged scene if another thread sets *abandoned in time. */
bool scene_commit_unless(struct scene *scene, struct scene_edit *edits, size_t edit_count,
                         const atomic_bool *abandoned, struct error *error);
/* Whether all that the edits set or remove is there and has not been changed after a revision; false: *error, of
 * kind ERROR_CONFLICT, names the first that is not or has. */
bool scene_edits_are_current(const struct scene *scene, const struct scene_edit *edits, size_t edit_count,
                             uint64_t base_revision, struct error *error);
/* Whether a transaction takes no longer than a slice of a frame, whatever is in it. */
bool scene_commit_is_short(const struct scene *scene, const struct scene_edit *edits, size_t edit_count);
/* What the tables of a scene may grow by. */
uint64_t scene_edits_table_bytes(const struct scene_edit *edits, size_t edit_count);

/* Objects by identifier, NULL if there is none. */
const struct scene_node *scene_node(const struct scene *scene, uint32_t id);
const struct scene_mesh *scene_mesh(const struct scene *scene, uint32_t id);
/* Whether its colours have 16 bits each. */
bool mesh_has_wide_colours(const struct scene_mesh *mesh);
const struct scene_spheres *scene_spheres(const struct scene *scene, uint32_t id);
const struct scene_material *scene_material(const struct scene *scene, uint32_t id);
/* What the body behind a material absorbs of a colour channel, 1 / metre. */
float scene_material_absorption(const struct scene_material *material, int channel);
/* What one of the body's surfaces takes of a shadow ray's light for what lies between two: 1 where it is clear. */
float scene_material_body_tint(const struct scene_material *material, int channel);
const struct scene_texture *scene_texture(const struct scene *scene, uint32_t id);
const struct scene_light *scene_light(const struct scene *scene, uint32_t id);
const struct scene_camera *scene_camera(const struct scene *scene, uint32_t id);
const struct scene_skin *scene_skin(const struct scene *scene, uint32_t id);
const struct scene_clip *scene_clip(const struct scene *scene, uint32_t id);

/* The edit that would make a node, material, light or camera as it is; it is the caller's to finish. False and
 * *error: there is no such object, it is of another kind, or no memory. */
bool scene_read_object(const struct scene *scene, enum object_kind kind, uint32_t id, struct scene_edit *edit,
                       struct error *error);

struct scene_pose; /* scene/pose.h */

/* The hierarchy, flattened: every visible node with its transform. That of a mesh that a skin moves is the
 * identity, as its vertices are in world space (scene_deform). */
struct scene_instance {
    const struct scene_node *node;
    float world_from_object[12];
    float object_from_world[12]; /* zero where `singular` */
    bool singular;               /* the transform is singular: geometry there is skipped */
    uint8_t light_group;         /* the node's own, or the nearest above it; 0: none */
};
/* Below, `pose` says where things are; NULL: as they were committed. */
/* Instances of one kind in the order of node ids; an array to free(). False: out of memory. */
bool scene_flatten(const struct scene *scene, const struct scene_pose *pose, enum node_kind kind,
                   struct scene_instance **instances, size_t *count);
/* World transform of one node (hidden or not); false if the node does not exist. */
bool scene_world_from_node(const struct scene *scene, const struct scene_pose *pose, uint32_t node,
                           float world_from_node[12]);
/* Bounds in world space of everything visible, without discs unless there is nothing else. Deforming meshes count
 * as in the pose, unless they have hundreds of millions of vertices. False: nothing is visible. */
bool scene_bounds(const struct scene *scene, const struct scene_pose *pose, float lower[3], float upper[3]);
/* Likewise of a node and the nodes below it; 0: of all. */
bool scene_bounds_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root, float lower[3],
                        float upper[3]);
/* For each direction in world space the greatest dot product with a point of what scene_bounds_below() counts: of
 * the vertices that triangles use, of spheres, of discs. Of a mesh with fewer vertices than corners any of its
 * vertices may count that is within its bounds. With `axis`, x and z of a vertical, of all the places that these
 * come to as they turn about it. False: nothing is visible. */
#define SCENE_SUPPORTS_MAX 5
bool scene_supports_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root,
                          const double *axis, const double (*directions)[3], double *supports, size_t count);

#endif
