/* SPDX-License-Identifier: MIT */
/* Visible part of the hierarchy: nodes with their world transforms, and its bounds. */
#include "scene/affine.h"
#include "scene/affine_double.h"
#include "scene/hierarchy.h"
#include "scene/pose.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* World transforms computed so far, by position in the hierarchy. */
struct world {
    const struct scene_pose *pose;
    double (*world_from_node)[12];
    enum { WORLD_UNKNOWN, WORLD_VISIBLE, WORLD_HIDDEN } * state;
    uint8_t *light_groups; /* the node's own, or the nearest ancestor's; 0: none */
};

static bool world_init(struct world *world, const struct scene_pose *pose, size_t count)
{
    world->pose = pose;
    world->world_from_node = malloc(count * sizeof(*world->world_from_node));
    world->state = calloc(count, sizeof(*world->state));
    world->light_groups = malloc(count);
    return world->world_from_node && world->state && world->light_groups;
}

static void world_finish(struct world *world)
{
    free(world->world_from_node);
    free(world->state);
    free(world->light_groups);
}

/* Resolves a node: goes up to the nearest known ancestor, then back down; a chain has at most SCENE_DEPTH_MAX
 * nodes. */
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
        const struct scene_node *node = hierarchy->nodes[i];
        bool hidden = scene_pose_hidden(world->pose, node);
        const double *parent = root;
        world->light_groups[i] = (uint8_t)node->value.light_group;
        if (above != HIERARCHY_NONE) {
            parent = world->world_from_node[above];
            hidden = hidden || world->state[above] == WORLD_HIDDEN;
            if (node->value.light_group == 0)
                world->light_groups[i] = world->light_groups[above];
        }
        affine_double_multiply(world->world_from_node[i], parent, scene_pose_parent_from_node(world->pose, node));
        world->state[i] = hidden ? WORLD_HIDDEN : WORLD_VISIBLE;
        above = i;
    }
}

/* Whether joints place the vertices, in world space. */
static bool is_skinned(const struct scene *scene, const struct scene_node *node)
{
    const struct scene_mesh *mesh =
        node->value.skin && node->value.kind == NODE_MESH ? scene_mesh(scene, node->value.object) : NULL;
    return mesh && mesh->value.influence_count;
}

static void fill_instance(struct scene_instance *instance, const struct scene *scene,
                          const struct scene_node *node, const double world_from_node[12])
{
    *instance = (struct scene_instance){.node = node};
    if (is_skinned(scene, node)) {
        affine_identity(instance->world_from_object);
        affine_identity(instance->object_from_world);
        return;
    }
    bool is_finite = affine_double_round(instance->world_from_object, world_from_node);
    instance->singular = !is_finite || !affine_double_invert(instance->object_from_world, world_from_node);
    if (!is_finite)
        *instance = (struct scene_instance){.node = node, .singular = true};
}

bool scene_flatten(const struct scene *scene, const struct scene_pose *pose, enum node_kind kind,
                   struct scene_instance **instances, size_t *count)
{
    *instances = NULL;
    *count = 0;
    struct hierarchy hierarchy;
    if (!hierarchy_of_scene(&hierarchy, scene))
        return false;
    size_t shown = 0;
    for (size_t i = 0; i < hierarchy.count; i++)
        shown += hierarchy.nodes[i]->value.kind == kind;
    if (!shown) {
        hierarchy_finish(&hierarchy);
        return true;
    }
    struct world world;
    struct scene_instance *list = malloc(shown * sizeof(*list));
    bool complete = world_init(&world, pose, hierarchy.count) && list;
    size_t used = 0;
    for (uint32_t i = 0; complete && i < hierarchy.count; i++) {
        if (hierarchy.nodes[i]->value.kind != kind)
            continue;
        world_resolve(&world, &hierarchy, i);
        if (world.state[i] != WORLD_VISIBLE)
            continue;
        fill_instance(&list[used], scene, hierarchy.nodes[i], world.world_from_node[i]);
        list[used++].light_group = world.light_groups[i];
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
    const struct scene_node *chain[SCENE_DEPTH_MAX];
    size_t length = 0;
    const struct scene_node *above = scene_node(scene, node);
    if (!above)
        return false;
    while (above && length < SCENE_DEPTH_MAX) {
        chain[length++] = above;
        above = above->value.parent ? scene_node(scene, above->value.parent) : NULL;
    }
    double world[12];
    affine_double_identity(world);
    while (length > 0)
        affine_double_multiply(world, world, scene_pose_parent_from_node(pose, chain[--length]));
    affine_double_round(world_from_node, world);
    return true;
}
