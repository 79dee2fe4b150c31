/* SPDX-License-Identifier: MIT */
/* Checks references between objects: nodes to their objects, primitives to materials, materials to textures,
 * skins to nodes, channels to their targets. */
#include "scene/channel.h"
#include "scene/draft.h"

#include <stdio.h>

/* A reference of an object, in the order of next_reference(). */
struct reference {
    enum object_kind kind; /* kind of the object referred to */
    uint32_t id;           /* never 0 */
    char path[48];
};

static bool node_kind_object(enum node_kind kind, enum object_kind *object)
{
    switch (kind) {
    case NODE_MESH:
        *object = OBJECT_MESH;
        return true;
    case NODE_SPHERES:
        *object = OBJECT_SPHERES;
        return true;
    case NODE_LIGHT:
        *object = OBJECT_LIGHT;
        return true;
    case NODE_CAMERA:
        *object = OBJECT_CAMERA;
        return true;
    case NODE_GROUP:
    case NODE_COUNT:
        break;
    }
    return false;
}

static bool next_in_ranges(const struct record_material_range *ranges, uint32_t count, uint32_t *cursor,
                           struct reference *reference)
{
    while (*cursor < count) {
        uint32_t i = (*cursor)++;
        if (!ranges[i].material)
            continue;
        *reference = (struct reference){.kind = OBJECT_MATERIAL, .id = ranges[i].material};
        snprintf(reference->path, sizeof(reference->path), ".ranges[%u].material", i);
        return true;
    }
    return false;
}

static bool next_in_material(const struct scene_material *material, uint32_t *cursor, struct reference *reference)
{
    while (*cursor < MATERIAL_TEXTURE_COUNT) {
        uint32_t i = (*cursor)++;
        if (!material->textures[i].texture)
            continue;
        *reference = (struct reference){.kind = OBJECT_TEXTURE, .id = material->textures[i].texture};
        snprintf(reference->path, sizeof(reference->path), ".textures[%u].texture", i);
        return true;
    }
    return false;
}

static bool next_in_node(const struct scene_node *node, uint32_t *cursor, struct reference *reference)
{
    if ((*cursor)++ == 0) {
        *reference = (struct reference){.id = node->value.object, .path = ".object"};
        if (node_kind_object(node->value.kind, &reference->kind))
            return true;
        (*cursor)++;
    }
    *reference = (struct reference){.kind = OBJECT_SKIN, .id = node->value.skin, .path = ".skin"};
    return *cursor == 2 && node->value.skin;
}

static bool next_in_skin(const struct scene_skin *skin, uint32_t *cursor, struct reference *reference)
{
    if (*cursor >= skin->value.joint_count)
        return false;
    uint32_t i = (*cursor)++;
    const uint32_t *joints = (const uint32_t *)(const void *)skin->joints->data;
    *reference = (struct reference){.kind = OBJECT_NODE, .id = joints[i]};
    snprintf(reference->path, sizeof(reference->path), ".arrays[0] (joints)[%u]", i);
    return true;
}

static bool next_in_channel(const struct scene_channel *channel, uint32_t *cursor, struct reference *reference)
{
    const struct channel_row *row = channel_row(channel->value.path);
    if ((*cursor)++ == 0) {
        *reference = (struct reference){.kind = OBJECT_CLIP, .id = channel->value.clip, .path = ".clip"};
        return true;
    }
    *reference = (struct reference){.id = channel->value.object, .path = ".object"};
    return *cursor == 2 && row && channel_object_kind(row->target, &reference->kind);
}

/* Iterates over references; *cursor starts at 0. False: no more. */
static bool next_reference(enum object_kind kind, const void *object, uint32_t *cursor,
                           struct reference *reference)
{
    switch (kind) {
    case OBJECT_NODE:
        return next_in_node(object, cursor, reference);
    case OBJECT_MESH: {
        const struct scene_mesh *mesh = object;
        return next_in_ranges(mesh->ranges, mesh->range_count, cursor, reference);
    }
    case OBJECT_SPHERES: {
        const struct scene_spheres *spheres = object;
        return next_in_ranges(spheres->ranges, spheres->range_count, cursor, reference);
    }
    case OBJECT_MATERIAL:
        return next_in_material(object, cursor, reference);
    case OBJECT_DISC:
        *reference =
            (struct reference){OBJECT_MATERIAL, ((const struct scene_disc *)object)->value.material, ".material"};
        return (*cursor)++ == 0 && reference->id;
    case OBJECT_SKIN:
        return next_in_skin(object, cursor, reference);
    case OBJECT_CHANNEL:
        return next_in_channel(object, cursor, reference);
    case OBJECT_TEXTURE:
    case OBJECT_LIGHT:
    case OBJECT_CAMERA:
    case OBJECT_CLIP:
    case OBJECT_ENVIRONMENT:
    case OBJECT_COUNT:
        break;
    }
    return false;
}

static bool set_check(struct draft *draft, const struct scene_edit *edit)
{
    struct edit_place place = draft_place(draft, edit);
    if (edit->object == OBJECT_NODE && edit->set.node.value.kind == NODE_GROUP && edit->set.node.value.object)
        return edit_error(&place, ERROR_INVALID, ".object", "a group shows nothing, so this must be 0");
    struct reference reference;
    uint32_t cursor = 0;
    while (next_reference(edit->object, &edit->set, &cursor, &reference)) {
        if (reference.id && draft_remaining(draft, reference.kind, reference.id))
            continue;
        const char *kind = object_kind_name(reference.kind);
        edit_error(&place, ERROR_UNKNOWN_ID, reference.path, "%s %u does not exist", kind, reference.id);
        return error_remedy(draft->error, "make it in this transaction or before");
    }
    return true;
}

/* Checks that no remaining object of kind `user` refers to one that this transaction removes. */
static bool users_check(struct draft *draft, enum object_kind user)
{
    size_t cursor = 0;
    const struct scene_object *object;
    /* Objects that the transaction itself sets or removes are already checked. */
    while ((object = draft_next_untouched(draft, user, &cursor))) {
        struct reference reference;
        uint32_t reference_cursor = 0;
        while (next_reference(user, object, &reference_cursor, &reference)) {
            const struct scene_edit *edit = hashmap_get(&draft->last[reference.kind], reference.id);
            if (!edit || edit->kind != EDIT_REMOVE)
                continue;
            struct edit_place place = draft_place(draft, edit);
            edit_error(&place, ERROR_INVALID, "", "%s %u still uses it (%s)", object_kind_name(user), object->id,
                       reference.path + 1);
            return error_remedy(draft->error, "change or remove that %s in the same transaction",
                                object_kind_name(user));
        }
    }
    return true;
}

static bool removals_check(struct draft *draft)
{
    bool removes_shown = draft_removes_any(draft, OBJECT_MESH) || draft_removes_any(draft, OBJECT_SPHERES) ||
                         draft_removes_any(draft, OBJECT_LIGHT) || draft_removes_any(draft, OBJECT_CAMERA) ||
                         draft_removes_any(draft, OBJECT_SKIN);
    if (removes_shown && !users_check(draft, OBJECT_NODE))
        return false;
    if (draft_removes_any(draft, OBJECT_MATERIAL) &&
        !(users_check(draft, OBJECT_MESH) && users_check(draft, OBJECT_SPHERES) &&
          users_check(draft, OBJECT_DISC)))
        return false;
    return !draft_removes_any(draft, OBJECT_TEXTURE) || users_check(draft, OBJECT_MATERIAL);
}

bool references_check(struct draft *draft)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (draft_is_abandoned(draft) ||
            (edit->kind == EDIT_SET && draft_counts(draft, edit) && !set_check(draft, edit)))
            return false;
    }
    return removals_check(draft);
}
