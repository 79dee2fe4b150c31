/* SPDX-License-Identifier: MIT */
/* State of animated objects at one time, under the clips that a job plays: a layer over the scene, which stays
 * as committed. */
#ifndef FARLIGHT_SCENE_POSE_H
#define FARLIGHT_SCENE_POSE_H

#include "scene/scene.h"

struct pose_node {
    uint32_t node;
    float parent_from_node[12];
    bool hidden;
};

struct pose_weights {
    uint32_t node;
    uint32_t first, count; /* in scene_pose.weights */
};

enum pose_view_value { /* bits of pose_view.given */
                       POSE_VIEW_EYE = 1,
                       POSE_VIEW_LOOK_AT = 2,
                       POSE_VIEW_UP = 4,
                       POSE_VIEW_FOV_Y = 8,
                       POSE_VIEW_APERTURE = 16,
                       POSE_VIEW_FOCUS = 32,
                       POSE_VIEW_EXPOSURE = 64,
};
struct pose_view {
    unsigned given;
    float eye_world[3], look_at_world[3], up_world[3], fov_y, aperture, focus, exposure_stops;
};

/* A pose; lists only objects that clips change, ascending by identifier. */
struct scene_pose {
    struct pose_node *nodes;
    uint32_t node_count;
    struct pose_weights *morphs;
    uint32_t morph_count;
    float *weights;
    uint32_t weight_count;
    struct scene_light *lights; /* complete present state of each; own no blobs */
    uint32_t light_count;
    struct scene_material *materials;
    uint32_t material_count;
    struct pose_view view;
};
void scene_pose_finish(struct scene_pose *pose);

/* Poses at even intervals from shutter open to shutter close, both included. Between two of them matrices are
 * interpolated linearly, and between the first and the last, vertices of deformed meshes. With one pose nothing
 * moves. */
#define MOTION_POSES_MAX 9
struct scene_motion {
    struct scene_pose *poses;
    uint32_t pose_count; /* 1 .. MOTION_POSES_MAX */
    bool has_neighbours;
    struct scene_pose earlier, later; /* with neighbours: the poses a frame earlier and a frame later */
};
void scene_motion_finish(struct scene_motion *motion);

/* Evaluates clips at a time; where two change the same value, the later one counts. Rotations are normalised,
 * values clamped to the protocol's range. ERROR_OUT_OF_MEMORY, ERROR_UNKNOWN_ID ("clips[2].clip"). */
bool scene_pose_evaluate(struct scene_pose *pose, const struct scene *scene, const struct record_clip_use *uses,
                         uint32_t use_count, double time_s, struct error *error);
/* Evaluates the poses from `open_s` on for `shutter_s`; 0 s: one pose. Also one pose if nothing moves in that
 * time; otherwise 2, 3, 5 or 9, so that no unskinned mesh or set of spheres rotates by more than
 * MOTION_TURN_MAX between two poses, as far as MOTION_POSES_MAX allows. Errors as above. */
#define MOTION_TURN_MAX 0.1745 /* radians, 10 degrees: a chord is 0.4 % of the radius inside its arc */
bool scene_motion_evaluate(struct scene_motion *motion, const struct scene *scene,
                           const struct record_clip_use *uses, uint32_t use_count, double open_s, double shutter_s,
                           struct error *error);
/* Adds the poses at two other times. Errors as above. */
bool scene_motion_add_neighbours(struct scene_motion *motion, const struct scene *scene,
                                 const struct record_clip_use *uses, uint32_t use_count, const double times_s[2],
                                 struct error *error);
/* Length of a clip in seconds: its last key. 0: no clip, or no channel. */
double scene_clip_duration_s(const struct scene *scene, uint32_t clip);

/* Get the pose's value, or the scene's where the pose has none or is NULL. */
const float *scene_pose_parent_from_node(const struct scene_pose *pose, const struct scene_node *node);
bool scene_pose_hidden(const struct scene_pose *pose, const struct scene_node *node);
const struct scene_light *scene_pose_light(const struct scene_pose *pose, const struct scene_light *light);
const struct scene_material *scene_pose_material(const struct scene_pose *pose,
                                                 const struct scene_material *material);
/* Weights of the morph targets of a node's mesh: target_count floats into `weights`. */
void scene_pose_weights(const struct scene_pose *pose, const struct scene_node *node,
                        const struct scene_mesh *mesh, float *weights);

/* Whether a node's mesh changes its shape: it has a skin and the mesh has joints, or the mesh has morph targets.
 */
bool scene_node_deforms(const struct scene_node *node, const struct scene_mesh *mesh);
/* Gets world_from_mesh for each joint of the skin, 3x4 row-major; joint_count x 12 floats. */
bool scene_skin_matrices(const struct scene *scene, const struct scene_pose *pose, const struct scene_skin *skin,
                         float *world_from_mesh, struct error *error);
/* Computes the vertices of a node on the CPU: 3 floats per vertex into `positions`, and into `normals`, of unit
 * length, if that is not NULL and the mesh has some. They are in world space with a skin, else in the node's
 * space. The GPU's twin is shaders/gpu_scene/deform.comp. */
bool scene_deform(const struct scene *scene, const struct scene_pose *pose, const struct scene_node *node,
                  float *positions, float *normals, struct error *error);

#endif
