/* SPDX-License-Identifier: MIT */
/* Bounds of all that a scene shows. */
#include "scene/affine.h"
#include "scene/pose.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Maximum of numbers that are read for the bounds of deformed meshes: a second or two, in which no other client is
 * served. Device memory does not hold many more; meshes beyond it count with their rest pose. */
#define DEFORM_NUMBERS_MAX (UINT64_C(1) << 30)

static void extend(float lower[3], float upper[3], const float other_lower[3], const float other_upper[3])
{
    for (int axis = 0; axis < 3; axis++) {
        lower[axis] = fminf(lower[axis], other_lower[axis]);
        upper[axis] = fmaxf(upper[axis], other_upper[axis]);
    }
}

static bool is_finite(const float point[3])
{
    return isfinite(point[0]) && isfinite(point[1]) && isfinite(point[2]);
}

/* Of the vertices that triangles use, where the pose puts them; one that leaves the floats is left out. False:
 * none is left, or out of memory. */
static bool extend_by_deformed(const struct scene *scene, const struct scene_pose *pose,
                               const struct scene_instance *instance, float lower[3], float upper[3])
{
    const struct scene_mesh *mesh = scene_mesh(scene, instance->node->object);
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    float *positions = malloc((size_t)mesh->vertex_count * 3 * sizeof(*positions));
    bool found = false;
    if (positions && scene_deform(scene, pose, instance->node, positions, NULL, NULL)) {
        for (size_t i = 0; i < (size_t)mesh->triangle_count * 3; i++) {
            float point[3];
            affine_point(point, instance->world_from_object, positions + (size_t)indices[i] * 3);
            if (!is_finite(point))
                continue;
            extend(lower, upper, point, point);
            found = true;
        }
    }
    free(positions);
    return found;
}

/* Subtracts the cost of deforming a mesh from the budget. False: the budget does not suffice. */
static bool afford(const struct scene_mesh *mesh, uint64_t *left)
{
    uint64_t cost = (uint64_t)mesh->vertex_count * (1 + mesh->target_count + mesh->influence_count) +
                    (uint64_t)mesh->triangle_count * 3;
    if (cost > *left)
        return false;
    *left -= cost;
    return true;
}

/* Also the root itself; 0: everything is below it. */
static bool is_below(const struct scene *scene, const struct scene_node *node, uint32_t root)
{
    while (node && root != 0 && node->base.id != root)
        node = node->parent ? scene_node(scene, node->parent) : NULL;
    return node != NULL;
}

static bool extend_by_kind(const struct scene *scene, const struct scene_pose *pose, enum node_kind kind,
                           uint32_t root, float lower[3], float upper[3])
{
    struct scene_instance *instances;
    size_t count;
    if (!scene_flatten(scene, pose, kind, &instances, &count))
        return false;
    bool found = false;
    uint64_t left = DEFORM_NUMBERS_MAX;
    for (size_t i = 0; i < count; i++) {
        if (instances[i].singular || !is_below(scene, instances[i].node, root))
            continue;
        uint32_t id = instances[i].node->object;
        const float *object_lower, *object_upper;
        if (kind == NODE_MESH) {
            const struct scene_mesh *mesh = scene_mesh(scene, id);
            if (scene_node_deforms(instances[i].node, mesh) && afford(mesh, &left)) {
                found = extend_by_deformed(scene, pose, &instances[i], lower, upper) || found;
                continue;
            }
            object_lower = mesh->lower, object_upper = mesh->upper;
        } else {
            const struct scene_spheres *spheres = scene_spheres(scene, id);
            object_lower = spheres->lower, object_upper = spheres->upper;
        }
        float world_lower[3], world_upper[3];
        affine_bounds(world_lower, world_upper, instances[i].world_from_object, object_lower, object_upper);
        extend(lower, upper, world_lower, world_upper);
        found = true;
    }
    free(instances);
    return found;
}

static bool extend_by_discs(const struct scene *scene, float lower[3], float upper[3])
{
    size_t cursor = 0;
    void *value;
    bool found = false;
    while (hashmap_next(&scene->objects[OBJECT_DISC], &cursor, NULL, &value)) {
        const struct scene_disc *disc = value;
        float disc_lower[3], disc_upper[3];
        for (int axis = 0; axis < 3; axis++) {
            float n = disc->normal_world[axis];
            float reach = disc->radius * sqrtf(fmaxf(0.0f, 1.0f - n * n));
            disc_lower[axis] = disc->centre_world[axis] - reach;
            disc_upper[axis] = disc->centre_world[axis] + reach;
        }
        extend(lower, upper, disc_lower, disc_upper);
        found = true;
    }
    return found;
}

bool scene_bounds_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root, float lower[3],
                        float upper[3])
{
    for (int axis = 0; axis < 3; axis++) {
        lower[axis] = FLT_MAX;
        upper[axis] = -FLT_MAX;
    }
    bool has_meshes = extend_by_kind(scene, pose, NODE_MESH, root, lower, upper);
    bool has_spheres = extend_by_kind(scene, pose, NODE_SPHERES, root, lower, upper);
    return has_meshes || has_spheres || (root == 0 && extend_by_discs(scene, lower, upper));
}

bool scene_bounds(const struct scene *scene, const struct scene_pose *pose, float lower[3], float upper[3])
{
    return scene_bounds_below(scene, pose, 0, lower, upper);
}
