/* SPDX-License-Identifier: MIT */
/* Poses: their evaluation, and look-ups in them. */
#include "scene/pose.h"

#include "scene/player.h"

#include <stdlib.h>
#include <string.h>

bool scene_pose_evaluate(struct scene_pose *pose, const struct scene *scene, const struct record_clip_use *uses,
                         uint32_t use_count, double time_s, struct error *error)
{
    struct player player;
    *pose = (struct scene_pose){0};
    bool made = player_init(&player, scene, uses, use_count, error) && player_pose(&player, time_s, pose, error);
    player_finish(&player);
    return made;
}

void scene_pose_finish(struct scene_pose *pose)
{
    free(pose->nodes);
    free(pose->morphs);
    free(pose->weights);
    free(pose->lights);
    free(pose->materials);
    *pose = (struct scene_pose){0};
}

/* Position of an identifier in a list that ascends by it; `count` if it is missing. The identifier is the u32
 * at the start of each element. */
static size_t find(const void *list, size_t count, size_t element_bytes, uint32_t id)
{
    size_t low = 0, high = count;
    while (low < high) {
        size_t middle = low + (high - low) / 2;
        uint32_t at;
        memcpy(&at, (const char *)list + middle * element_bytes, sizeof(at));
        if (at == id)
            return middle;
        if (at < id)
            low = middle + 1;
        else
            high = middle;
    }
    return count;
}

#define STARTS_WITH_ID(type, member)                                                                              \
    _Static_assert(offsetof(struct type, member) == 0, "find() reads the identifier at the start")
STARTS_WITH_ID(pose_node, node);
STARTS_WITH_ID(pose_weights, node);
STARTS_WITH_ID(scene_light, base.id);
STARTS_WITH_ID(scene_material, base.id);

const struct pose_node *scene_pose_node(const struct scene_pose *pose, uint32_t id)
{
    size_t i = pose ? find(pose->nodes, pose->node_count, sizeof(*pose->nodes), id) : 0;
    return pose && i < pose->node_count ? &pose->nodes[i] : NULL;
}

const float *scene_pose_parent_from_node(const struct scene_pose *pose, const struct scene_node *node)
{
    const struct pose_node *posed = scene_pose_node(pose, node->base.id);
    return posed ? posed->parent_from_node : node->value.parent_from_node;
}

bool scene_pose_hidden(const struct scene_pose *pose, const struct scene_node *node)
{
    const struct pose_node *posed = scene_pose_node(pose, node->base.id);
    return posed ? posed->hidden : node->value.hidden;
}

const struct scene_light *scene_pose_light(const struct scene_pose *pose, const struct scene_light *light)
{
    size_t i = pose ? find(pose->lights, pose->light_count, sizeof(*pose->lights), light->base.id) : 0;
    return pose && i < pose->light_count ? &pose->lights[i] : light;
}

const struct scene_material *scene_pose_material(const struct scene_pose *pose,
                                                 const struct scene_material *material)
{
    size_t i = pose ? find(pose->materials, pose->material_count, sizeof(*pose->materials), material->base.id) : 0;
    return pose && i < pose->material_count ? &pose->materials[i] : material;
}

void scene_pose_weights(const struct scene_pose *pose, const struct scene_node *node,
                        const struct scene_mesh *mesh, float *weights)
{
    size_t i = pose ? find(pose->morphs, pose->morph_count, sizeof(*pose->morphs), node->base.id) : 0;
    const float *from = node->weights ? node->weights : mesh->weights;
    uint32_t count = node->weights ? node->weight_count : mesh->weight_count;
    if (pose && i < pose->morph_count) {
        from = pose->weights + pose->morphs[i].first;
        count = pose->morphs[i].count;
    }
    for (uint32_t target = 0; target < mesh->value.target_count; target++)
        weights[target] = target < count ? from[target] : 0.0f;
}

bool scene_node_deforms(const struct scene_node *node, const struct scene_mesh *mesh)
{
    return (node->value.skin && mesh->value.influence_count) || mesh->value.target_count;
}
