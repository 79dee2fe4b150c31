/* SPDX-License-Identifier: MIT */
/* What a file has stated, as objects of the scene: keys and the ambient light count wherever they are stated, so
 * all is added at the end. */
#include "aff.h"

#include <stdlib.h>

static uint32_t add_node(struct aff *aff, uint32_t parent, const struct placement *place, bool visible,
                         const char *name)
{
    struct message_set_node node = {.parent = parent, .hidden = !visible, .name = name};

    placement_to_floats(place, node.parent_from_node);
    return import_add_node(aff->nff.scene, &node);
}

/* In the pose of the animation's start. */
static bool add_group_nodes(struct aff *aff, struct aff_group *group)
{
    const struct aff_keys *keys = aff_find_keys(aff, group->name);
    struct placement pose = aff_pose_at(keys, (double)aff->start_s);
    uint32_t parent = aff->groups[group->parent]->node;

    if (group->name[0] == '\0') {
        group->node = add_node(aff, parent, &group->parent_from_group, true, "");
        return group->node != 0;
    }
    if (!placement_is_identity(&group->parent_from_group)) {
        parent = add_node(aff, parent, &group->parent_from_group, true, "");
        if (parent == 0)
            return false;
    }
    group->node = add_node(aff, parent, &pose, aff_visible_at(keys, (double)aff->start_s), group->name);
    return group->node != 0;
}

static bool add_groups(struct aff *aff)
{
    for (size_t i = 0; i < aff->group_count; i++) {
        struct aff_group *group = aff->groups[i];

        if ((i > 0 && !add_group_nodes(aff, group)) ||
            !shapes_finish(&group->shapes, group->node, aff->nff.material_ids))
            return false;
        for (size_t m = 0; m < group->morph_count; m++)
            if (!aff_add_morph(aff, group, &group->morphs[m]))
                return false;
    }
    return true;
}

static bool has_shapes(const struct aff *aff)
{
    for (size_t i = 0; i < aff->group_count; i++) {
        const struct aff_group *group = aff->groups[i];

        if (group->shapes.triangle_count > 0 || group->shapes.sphere_count > 0 || group->morph_count > 0)
            return true;
    }
    return false;
}

bool aff_add_all(struct aff *aff)
{
    uint32_t *textures;
    bool added;

    if (!has_shapes(aff))
        return import_fail(
            aff->nff.scene, NULL,
            "it contains nothing that can be shown: no polygon, mesh, sphere, cone or cylinder; a file "
            "that others include is shown with them");
    textures = calloc(aff->texture_count + 1, sizeof(*textures));
    if (!textures)
        return import_fail(aff->nff.scene, NULL, "out of memory");
    added = aff_add_textures(aff, textures) && nff_add_materials(&aff->nff, textures);
    free(textures);
    if (!added || !nff_add_lights(&aff->nff) || !add_groups(aff) ||
        (aff->nff.has_view && !nff_add_camera(&aff->nff)) || !aff_add_clip(aff))
        return false;
    nff_add_background(&aff->nff);
    return true;
}
