/* SPDX-License-Identifier: MIT */
/* Deforming meshes on the device: their rest shapes and current poses. Private to gpu_scene*.c. A node that
 * deforms (scene_node_deforms) has a geometry of its own behind the rigid ones, in the order of node ids; its
 * vertices at shutter close lie behind the vertices of all geometries. */
#ifndef FARLIGHT_GPU_SCENE_DEFORM_H
#define FARLIGHT_GPU_SCENE_DEFORM_H

#include "gpu_scene/scene.h"

/* A box; empty where lower is above upper. */
struct deform_box {
    float lower[3], upper[3];
};

/* A mesh at rest, stored once for all nodes that deform it: its places in the buffers below, and bounds of its
 * vertices. */
struct deform_mesh {
    uint32_t id;
    uint32_t first_vertex;        /* in positions, normals, tangents */
    uint32_t first_influence;     /* in joints and joint_weights; that of vertex v: + v * influence_count */
    uint32_t first_target_vertex; /* in target_*; vertex v of target t: + t * vertex_count + v */
    struct deform_box *joints;    /* boxes of the vertices that each joint moves */
    uint32_t joint_count;         /* number of those boxes */
    struct deform_box *targets;   /* boxes of the offsets that each target adds to a vertex */
    struct deform_box unmoved;    /* box of the vertices that no joint moves */
};

/* A node that deforms a mesh. Its values: 12 floats per joint, row-major world_from_mesh, then a weight per
 * target. */
struct deform_use {
    uint32_t node;
    uint32_t mesh; /* in `meshes` */
    uint32_t mesh_id;
    uint64_t mesh_revision;
    uint32_t skin;        /* 0: none; the vertices are in the node's space */
    uint32_t value_count; /* length of each of these */
    float *open, *close;  /* values of the current vertices; NULL: there are none yet, or the shape does not
                             change */
    bool is_placed;       /* the vertices are in the buffers */
    uint64_t revision;    /* gpu_scene_geometry.deformed_revision */
    struct deform_box box;
};

struct gpu_scene_deform {
    struct deform_mesh *meshes;
    uint32_t mesh_count;
    struct deform_use *uses; /* by geometry: use i is geometry rigid_count + i */
    uint32_t use_count;
    /* Texels that shaders/gpu_scene/deform.comp reads. */
    struct gpu_buffer positions, normals, tangents, joints, joint_weights;
    struct gpu_buffer target_positions, target_normals, target_tangents;
    struct gpu_buffer parameters;
};

void gpu_scene_deform_finish(struct gpu_scene_deform *deform, struct gpu_device *device);
/* Lists the buffers, to count or release them. Returns their number. */
#define DEFORM_BUFFERS_MAX 9
size_t gpu_scene_deform_buffers(struct gpu_scene_deform *deform, struct gpu_buffer *buffers[DEFORM_BUFFERS_MAX]);

/* A number that changes when nodes begin or cease to deform, or deform another mesh; 0: none deforms. */
uint64_t gpu_scene_deform_signature(const struct scene *scene);
/* Lists the uses, and keeps the state of remaining ones. */
bool gpu_scene_deform_list(struct gpu_scene_deform *deform, const struct scene *scene, struct error *error);
/* Lists the buffers and boxes of the meshes at rest; no vertices are in place afterwards. */
bool gpu_scene_deform_list_rest(struct gpu_scene *gpu, const struct scene *scene, struct error *error);

#endif
