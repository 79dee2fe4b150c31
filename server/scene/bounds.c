/* SPDX-License-Identifier: MIT */
/* Bounds of the visible scene, and its extent in given directions. */
#include "scene/affine.h"
#include "scene/pose.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Maximum of numbers read for the bounds of deformed meshes: a second or two, in which no other client is
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

/* Extends a box by the vertices that triangles use, deformed by the pose, except those that leave the range of
 * floats. False: none is left, or out of memory. */
static bool extend_by_deformed(const struct scene *scene, const struct scene_pose *pose,
                               const struct scene_instance *instance, float lower[3], float upper[3])
{
    const struct scene_mesh *mesh = scene_mesh(scene, instance->node->value.object);
    const uint32_t *indices = (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data;
    float *positions = malloc((size_t)mesh->value.vertex_count * 3 * sizeof(*positions));
    bool found = false;
    if (positions && scene_deform(scene, pose, instance->node, positions, NULL, NULL)) {
        for (size_t i = 0; i < (size_t)mesh->value.triangle_count * 3; i++) {
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
    uint64_t cost =
        (uint64_t)mesh->value.vertex_count * (1 + mesh->value.target_count + mesh->value.influence_count) +
        (uint64_t)mesh->value.triangle_count * 3;
    if (cost > *left)
        return false;
    *left -= cost;
    return true;
}

/* Whether a node is the root or below it; root 0: everything is below it. */
static bool is_below(const struct scene *scene, const struct scene_node *node, uint32_t root)
{
    while (node && root != 0 && node->base.id != root)
        node = node->value.parent ? scene_node(scene, node->value.parent) : NULL;
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
        uint32_t id = instances[i].node->value.object;
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
            float n = disc->value.normal_world[axis];
            float reach = disc->value.radius * sqrtf(fmaxf(0.0f, 1.0f - n * n));
            disc_lower[axis] = disc->value.centre_world[axis] - reach;
            disc_upper[axis] = disc->value.centre_world[axis] + reach;
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

#define PI 3.14159265358979323846
#define RIM_PLACES 64u

/* ---- supports ----------------------------------------------------------------------------------- */

struct direction {
    double object[3]; /* its dot product with a point in object space, plus the offset, is the one in world
                         space */
    double offset;
};

/* State of the search: the maximum dot products so far. */
struct reach {
    const struct scene *scene;
    const struct scene_pose *pose;
    const double (*directions)[3];
    const double *axis; /* NULL, or x and z of the vertical about which everything turns */
    double *supports;
    size_t count;
    uint64_t left; /* rest of the budget for deformed meshes */
    bool found;
    /* Current instance: its place, and the directions in its own space. */
    const float *world_from_object;
    struct direction own[SCENE_SUPPORTS_MAX];
};

static double dot(const double a[3], const float b[3])
{
    return a[0] * (double)b[0] + a[1] * (double)b[1] + a[2] * (double)b[2];
}

static void take_instance(struct reach *reach, const float m[12])
{
    struct direction *own = reach->own;
    reach->world_from_object = m;
    for (size_t i = 0; i < reach->count; i++) {
        const double *world = reach->directions[i];
        for (int axis = 0; axis < 3; axis++)
            own[i].object[axis] =
                world[0] * (double)m[axis] + world[1] * (double)m[4 + axis] + world[2] * (double)m[8 + axis];
        own[i].offset = world[0] * (double)m[3] + world[1] * (double)m[7] + world[2] * (double)m[11];
    }
}

static void note(struct reach *reach, size_t i, double support)
{
    if (isfinite(support))
        reach->supports[i] = fmax(reach->supports[i], support);
}

static void to_world(const struct reach *reach, const float place[3], double world[3])
{
    const float *m = reach->world_from_object;
    for (int row = 0; row < 3; row++)
        world[row] = (double)m[4 * row] * (double)place[0] + (double)m[4 * row + 1] * (double)place[1] +
                     (double)m[4 * row + 2] * (double)place[2] + (double)m[4 * row + 3];
}

/* Support of a ball on its way round the axis. */
static double turning_support(const struct reach *reach, size_t i, const double centre_world[3], double radius)
{
    const double *d = reach->directions[i], *axis = reach->axis, level = hypot(d[0], d[2]);
    const double away = hypot(centre_world[0] - axis[0], centre_world[2] - axis[1]);
    return d[0] * axis[0] + d[1] * centre_world[1] + d[2] * axis[1] + level * away + hypot(level, d[1]) * radius;
}

static void note_turning(struct reach *reach, const float place[3])
{
    double world[3];
    to_world(reach, place, world);
    for (size_t i = 0; i < reach->count; i++)
        note(reach, i, turning_support(reach, i, world, 0.0));
}

/* Processes one direction after the other: the loops are short enough to be vectorised. */
static void reach_points(struct reach *reach, const float *positions, const uint32_t *indices, size_t count)
{
    const struct direction *own = reach->own;
    for (size_t k = 0; reach->axis && k < count; k++)
        note_turning(reach, positions + 3 * (indices ? (size_t)indices[k] : k));
    if (reach->axis)
        return;
    for (size_t i = 0; i < reach->count; i++) {
        const double *d = own[i].object;
        double most = -INFINITY;
        for (size_t k = 0; k < count; k++) {
            const double at = dot(d, positions + 3 * (indices ? (size_t)indices[k] : k));
            most = at > most ? at : most; /* false for a place that is not finite */
        }
        note(reach, i, most + own[i].offset);
    }
}

/* Processes the vertices within the bounds; those outside belong to other meshes. */
static void reach_vertices(struct reach *reach, const struct scene_mesh *mesh)
{
    const struct direction *own = reach->own;
    const float *p = (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data;
    const float *lower = mesh->lower, *upper = mesh->upper;
    double most[SCENE_SUPPORTS_MAX];
    for (size_t i = 0; i < reach->count; i++)
        most[i] = -INFINITY;
    for (uint32_t k = 0; k < mesh->value.vertex_count; k++, p += 3) {
        if (p[0] < lower[0] || p[0] > upper[0] || p[1] < lower[1] || p[1] > upper[1] || p[2] < lower[2] ||
            p[2] > upper[2])
            continue;
        if (reach->axis) {
            note_turning(reach, p);
            continue;
        }
        for (size_t i = 0; i < reach->count; i++) {
            const double at = dot(own[i].object, p);
            most[i] = at > most[i] ? at : most[i];
        }
    }
    for (size_t i = 0; i < reach->count; i++)
        note(reach, i, most[i] + own[i].offset);
}

/* Processes a deforming mesh. False: out of memory. */
static bool reach_deformed(struct reach *reach, const struct scene_instance *instance)
{
    const struct scene_mesh *mesh = scene_mesh(reach->scene, instance->node->value.object);
    float *positions = malloc((size_t)mesh->value.vertex_count * 3 * sizeof(*positions));
    const bool deformed =
        positions && scene_deform(reach->scene, reach->pose, instance->node, positions, NULL, NULL);
    if (deformed)
        reach_points(reach, positions, (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data,
                     (size_t)mesh->value.triangle_count * 3);
    free(positions);
    return deformed;
}

static void reach_mesh(struct reach *reach, const struct scene_instance *instance)
{
    const struct scene_mesh *mesh = scene_mesh(reach->scene, instance->node->value.object);
    const size_t corners = (size_t)mesh->value.triangle_count * 3;
    if (scene_node_deforms(instance->node, mesh) && afford(mesh, &reach->left) && reach_deformed(reach, instance))
        return;
    if (mesh->value.vertex_count < corners)
        reach_vertices(reach, mesh);
    else
        reach_points(reach, (const float *)(const void *)mesh->arrays[MESH_POSITIONS]->data,
                     (const uint32_t *)(const void *)mesh->arrays[MESH_INDICES]->data, corners);
}

static void reach_spheres(struct reach *reach, const struct scene_spheres *spheres)
{
    const float *sphere = (const float *)(const void *)spheres->centres_radii->data, *m = reach->world_from_object;
    const struct direction *own = reach->own;
    /* Mean scale, as spheres stay spheres. */
    const double scale = sqrt((double)(m[0] * m[0] + m[1] * m[1] + m[2] * m[2]));
    for (uint32_t k = 0; reach->axis && k < spheres->value.sphere_count; k++) {
        double world[3];
        to_world(reach, sphere + 4 * k, world);
        for (size_t i = 0; i < reach->count; i++)
            note(reach, i, turning_support(reach, i, world, scale * (double)sphere[4 * k + 3]));
    }
    for (size_t i = 0; !reach->axis && i < reach->count; i++) {
        const double *d = own[i].object, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        double most = -INFINITY;
        for (uint32_t k = 0; k < spheres->value.sphere_count; k++)
            most = fmax(most, dot(d, sphere + 4 * k) + length * (double)sphere[4 * k + 3]);
        note(reach, i, most + own[i].offset);
    }
}

/* Whether an instance's box extends beyond the supports so far; a deforming mesh's may. */
static bool goes_beyond(const struct reach *reach, const float lower[3], const float upper[3])
{
    const struct direction *own = reach->own;
    for (unsigned corner = 0; reach->axis && corner < 8; corner++) {
        const float place[3] = {(corner & 1 ? upper : lower)[0], (corner & 2 ? upper : lower)[1],
                                (corner & 4 ? upper : lower)[2]};
        double world[3];
        to_world(reach, place, world);
        for (size_t i = 0; i < reach->count; i++)
            if (!(turning_support(reach, i, world, 0.0) <= reach->supports[i]))
                return true;
    }
    for (size_t i = 0; !reach->axis && i < reach->count; i++) {
        double support = own[i].offset;
        for (int axis = 0; axis < 3; axis++) {
            const double d = own[i].object[axis];
            support += d * (double)(d > 0.0 ? upper[axis] : lower[axis]);
        }
        if (!(support <= reach->supports[i]))
            return true;
    }
    return false;
}

static void reach_kind(struct reach *reach, enum node_kind kind, uint32_t root)
{
    struct scene_instance *instances;
    size_t count;
    if (!scene_flatten(reach->scene, reach->pose, kind, &instances, &count))
        return;
    for (size_t i = 0; i < count; i++) {
        const struct scene_node *node = instances[i].node;
        if (instances[i].singular || !is_below(reach->scene, node, root))
            continue;
        const struct scene_mesh *mesh = kind == NODE_MESH ? scene_mesh(reach->scene, node->value.object) : NULL;
        const struct scene_spheres *spheres = mesh ? NULL : scene_spheres(reach->scene, node->value.object);
        take_instance(reach, instances[i].world_from_object);
        if (!(mesh && scene_node_deforms(node, mesh)) &&
            !goes_beyond(reach, mesh ? mesh->lower : spheres->lower, mesh ? mesh->upper : spheres->upper))
            continue;
        if (mesh)
            reach_mesh(reach, &instances[i]);
        else
            reach_spheres(reach, spheres);
        reach->found = true;
    }
    free(instances);
}

/* Processes places of a disc's rim as it turns; between two of them the rim reaches a thousandth of its radius
 * farther. */
static void turn_disc(struct reach *reach, const struct scene_disc *disc)
{
    const float *n = disc->value.normal_world;
    const int least =
        fabsf(n[0]) < fabsf(n[1]) ? (fabsf(n[0]) < fabsf(n[2]) ? 0 : 2) : (fabsf(n[1]) < fabsf(n[2]) ? 1 : 2);
    const int b = (least + 1) % 3, c = (least + 2) % 3;
    const double length = hypot((double)n[b], (double)n[c]);
    double across[3] = {0}, other[3], place[3];
    across[b] = (double)n[c] / length;
    across[c] = -(double)n[b] / length;
    for (int i = 0; i < 3; i++) {
        const int next = (i + 1) % 3, after = (i + 2) % 3;
        other[i] = (double)n[next] * across[after] - (double)n[after] * across[next];
    }
    for (unsigned k = 0; k < RIM_PLACES; k++) {
        const double angle = 2.0 * PI * k / RIM_PLACES;
        for (int i = 0; i < 3; i++)
            place[i] = (double)disc->value.centre_world[i] +
                       (double)disc->value.radius * (cos(angle) * across[i] + sin(angle) * other[i]);
        for (size_t i = 0; i < reach->count; i++)
            note(reach, i, turning_support(reach, i, place, 0.0));
    }
}

static void reach_discs(struct reach *reach)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&reach->scene->objects[OBJECT_DISC], &cursor, NULL, &value)) {
        const struct scene_disc *disc = value;
        if (reach->axis)
            turn_disc(reach, disc);
        for (size_t i = 0; !reach->axis && i < reach->count; i++) {
            const double *d = reach->directions[i], along = dot(d, disc->value.normal_world);
            const double across = fmax(0.0, d[0] * d[0] + d[1] * d[1] + d[2] * d[2] - along * along);
            note(reach, i, dot(d, disc->value.centre_world) + (double)disc->value.radius * sqrt(across));
        }
        reach->found = true;
    }
}

bool scene_supports_below(const struct scene *scene, const struct scene_pose *pose, uint32_t root,
                          const double *axis, const double (*directions)[3], double *supports, size_t count)
{
    struct reach reach = {.scene = scene,
                          .pose = pose,
                          .directions = directions,
                          .axis = axis,
                          .supports = supports,
                          .count = count,
                          .left = DEFORM_NUMBERS_MAX};
    for (size_t i = 0; i < count; i++)
        supports[i] = -INFINITY;
    reach_kind(&reach, NODE_MESH, root);
    reach_kind(&reach, NODE_SPHERES, root);
    if (!reach.found && root == 0)
        reach_discs(&reach);
    for (size_t i = 0; i < count; i++)
        reach.found &= isfinite(supports[i]) != 0;
    return reach.found;
}
