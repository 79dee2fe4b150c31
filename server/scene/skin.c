/* SPDX-License-Identifier: MIT */
/* Transforms of joints. Each node above them is placed once, however many joints are below it and however deep. */
#include "scene/affine_double.h"
#include "scene/pose.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>

struct placed_nodes {
    struct hashmap places; /* by node id: position in `world`, plus 1 */
    double (*world_from_node)[12];
    size_t count, capacity;
};

static const double *find(const struct placed_nodes *placed, uint32_t node)
{
    uintptr_t place = (uintptr_t)hashmap_get(&placed->places, node);
    return place ? placed->world_from_node[place - 1] : NULL;
}

/* Appends an element; NULL: out of memory. */
static double *add(struct placed_nodes *placed, uint32_t node)
{
    if (placed->count == placed->capacity) {
        size_t capacity = placed->capacity ? placed->capacity * 2 : 64;
        double(*grown)[12] = realloc(placed->world_from_node, capacity * sizeof(*grown));
        if (!grown)
            return NULL;
        placed->world_from_node = grown;
        placed->capacity = capacity;
    }
    /* The map's pointers are numbers. */
    if (!hashmap_put(&placed->places, node, (void *)(uintptr_t)(placed->count + 1)))
        return NULL;
    return placed->world_from_node[placed->count++];
}

/* Places a joint: goes up to the nearest placed node or the root, then back down. */
static bool place(struct placed_nodes *placed, const struct scene *scene, const struct scene_pose *pose,
                  uint32_t joint, double world_from_joint[12], struct error *error)
{
    const struct scene_node *chain[SCENE_DEPTH_MAX];
    size_t length = 0;
    const struct scene_node *node = scene_node(scene, joint);
    const double *above = NULL;
    if (!node)
        return error_set(error, ERROR_INTERNAL, "skin", "node %u, a joint, is not there", joint);
    while (node && length < SCENE_DEPTH_MAX && !(above = find(placed, node->base.id))) {
        chain[length++] = node;
        node = node->value.parent ? scene_node(scene, node->value.parent) : NULL;
    }
    if (above)
        memcpy(world_from_joint, above, 12 * sizeof(*above));
    else
        affine_double_identity(world_from_joint);
    while (length > 0) {
        node = chain[--length];
        affine_double_multiply(world_from_joint, world_from_joint, scene_pose_parent_from_node(pose, node));
        double *kept = add(placed, node->base.id);
        if (!kept)
            return error_set(error, ERROR_OUT_OF_MEMORY, "skin", "no memory for the places of joints");
        memcpy(kept, world_from_joint, 12 * sizeof(*kept));
    }
    return true;
}

bool scene_skin_matrices(const struct scene *scene, const struct scene_pose *pose, const struct scene_skin *skin,
                         float *world_from_mesh, struct error *error)
{
    const uint32_t *joints = (const uint32_t *)(const void *)skin->joints->data;
    const float *joint_from_mesh =
        skin->joint_from_mesh ? (const float *)(const void *)skin->joint_from_mesh->data : NULL;
    struct placed_nodes placed = {0};
    bool fine = true;
    for (size_t i = 0; fine && i < skin->value.joint_count; i++) {
        double matrix[12];
        fine = place(&placed, scene, pose, joints[i], matrix, error);
        if (fine && joint_from_mesh)
            affine_double_multiply(matrix, matrix, joint_from_mesh + i * 12);
        if (fine)
            affine_double_round(world_from_mesh + i * 12, matrix);
    }
    hashmap_finish(&placed.places);
    free(placed.world_from_node);
    return fine;
}
