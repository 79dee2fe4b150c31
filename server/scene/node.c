/* SPDX-License-Identifier: MIT */
/* What the hierarchy shows: nodes with their world transforms, and the bounds of all of it. */
#include "scene/affine.h"
#include "scene/affine_double.h"
#include "scene/hierarchy.h"
#include "scene/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* World transforms that were worked out so far, by position in the hierarchy. */
struct world {
    double (*world_from_node)[12];
    enum { WORLD_UNKNOWN, WORLD_VISIBLE, WORLD_HIDDEN } * state;
};

static bool world_init(struct world *world, size_t count)
{
    world->world_from_node = malloc(count * sizeof *world->world_from_node);
    world->state = calloc(count, sizeof *world->state);
    return world->world_from_node && world->state;
}

static void world_finish(struct world *world)
{
    free(world->world_from_node);
    free(world->state);
}

/* Goes up to an ancestor that is known, then down again; a chain has at most SCENE_DEPTH_MAX nodes. */
static void world_resolve(struct world *world, const struct hierarchy *hierarchy, uint32_t start)
{
    uint32_t chain[SCENE_DEPTH_MAX];
    size_t length = 0;
    uint32_t above = start;
    while (above != HIERARCHY_NONE && world->state[above] == WORLD_UNKNOWN && length < SCENE_DEPTH_MAX) {
        chain[length++] = above;
        above = hierarchy->parents[above];
    }
    double root[12];
    affine_double_identity(root);
    while (length > 0) {
        uint32_t i = chain[--length];
        bool hidden = hierarchy->nodes[i]->hidden;
        const double *parent = root;
        if (above != HIERARCHY_NONE) {
            parent = world->world_from_node[above];
            hidden = hidden || world->state[above] == WORLD_HIDDEN;
        }
        affine_double_multiply(world->world_from_node[i], parent, hierarchy->nodes[i]->parent_from_node);
        world->state[i] = hidden ? WORLD_HIDDEN : WORLD_VISIBLE;
        above = i;
    }
}

static void fill_instance(struct scene_instance *instance, const struct scene_node *node,
                          const double world_from_node[12])
{
    *instance = (struct scene_instance){.node = node};
    bool is_finite = affine_double_round(instance->world_from_object, world_from_node);
    instance->singular = !is_finite || !affine_double_invert(instance->object_from_world, world_from_node);
    if (!is_finite)
        *instance = (struct scene_instance){.node = node, .singular = true};
}

bool scene_flatten(const struct scene *scene, const struct scene_pose *pose, enum scene_node_kind kind,
                   struct scene_instance **instances, size_t *count)
{
    (void)pose; /* nothing makes poses yet */
    *instances = NULL;
    *count = 0;
    struct hierarchy hierarchy;
    if (!hierarchy_of_scene(&hierarchy, scene))
        return false;
    size_t shown = 0;
    for (size_t i = 0; i < hierarchy.count; i++)
        shown += hierarchy.nodes[i]->kind == kind;
    if (!shown) {
        hierarchy_finish(&hierarchy);
        return true;
    }
    struct world world;
    struct scene_instance *list = malloc(shown * sizeof *list);
    bool complete = world_init(&world, hierarchy.count) && list;
    size_t used = 0;
    for (uint32_t i = 0; complete && i < hierarchy.count; i++) {
        if (hierarchy.nodes[i]->kind != kind)
            continue;
        world_resolve(&world, &hierarchy, i);
        if (world.state[i] == WORLD_VISIBLE)
            fill_instance(&list[used++], hierarchy.nodes[i], world.world_from_node[i]);
    }
    world_finish(&world);
    hierarchy_finish(&hierarchy);
    if (!complete || !used) {
        free(list);
        list = NULL;
    }
    *instances = list;
    *count = used;
    return complete;
}

bool scene_world_from_node(const struct scene *scene, const struct scene_pose *pose, uint32_t node,
                           float world_from_node[12])
{
    (void)pose;
    const struct scene_node *chain[SCENE_DEPTH_MAX];
    size_t length = 0;
    const struct scene_node *above = scene_node(scene, node);
    if (!above)
        return false;
    while (above && length < SCENE_DEPTH_MAX) {
        chain[length++] = above;
        above = above->parent ? scene_node(scene, above->parent) : NULL;
    }
    double world[12];
    affine_double_identity(world);
    while (length > 0)
        affine_double_multiply(world, world, chain[--length]->parent_from_node);
    affine_double_round(world_from_node, world);
    return true;
}

static void extend(float lower[3], float upper[3], const float other_lower[3], const float other_upper[3])
{
    for (int axis = 0; axis < 3; axis++) {
        lower[axis] = fminf(lower[axis], other_lower[axis]);
        upper[axis] = fmaxf(upper[axis], other_upper[axis]);
    }
}

static bool extend_by_kind(const struct scene *scene, enum scene_node_kind kind, float lower[3], float upper[3])
{
    struct scene_instance *instances;
    size_t count;
    if (!scene_flatten(scene, NULL, kind, &instances, &count))
        return false;
    bool found = false;
    for (size_t i = 0; i < count; i++) {
        if (instances[i].singular)
            continue;
        uint32_t id = instances[i].node->object;
        const float *object_lower, *object_upper;
        if (kind == NODE_MESH) {
            const struct scene_mesh *mesh = scene_mesh(scene, id);
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
    while (hashmap_next(&scene->objects[SCENE_DISC], &cursor, NULL, &value)) {
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

bool scene_bounds(const struct scene *scene, const struct scene_pose *pose, float lower[3], float upper[3])
{
    (void)pose;
    for (int axis = 0; axis < 3; axis++) {
        lower[axis] = FLT_MAX;
        upper[axis] = -FLT_MAX;
    }
    bool has_meshes = extend_by_kind(scene, NODE_MESH, lower, upper);
    bool has_spheres = extend_by_kind(scene, NODE_SPHERES, lower, upper);
    return has_meshes || has_spheres || extend_by_discs(scene, lower, upper);
}
