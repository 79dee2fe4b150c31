/* SPDX-License-Identifier: MIT */
/* Who refers to whom: nodes to what hangs there, primitives to materials, materials to textures. */
#include "scene/draft.h"

#include <stdio.h>

/* One reference of an object, in the order that next_reference() gives. */
struct reference {
    enum scene_object_kind kind; /* of what is referred to */
    uint32_t id;                 /* never 0 */
    char path[48];
};

static bool node_kind_object(enum scene_node_kind kind, enum scene_object_kind *object)
{
    switch (kind) {
    case NODE_MESH:
        *object = SCENE_MESH;
        return true;
    case NODE_SPHERES:
        *object = SCENE_SPHERES;
        return true;
    case NODE_LIGHT:
        *object = SCENE_LIGHT;
        return true;
    case NODE_CAMERA:
        *object = SCENE_CAMERA;
        return true;
    case NODE_GROUP:
        break;
    }
    return false;
}

static bool next_in_ranges(const struct material_range *ranges, uint32_t count, uint32_t *cursor,
                           struct reference *reference)
{
    while (*cursor < count) {
        uint32_t i = (*cursor)++;
        if (!ranges[i].material)
            continue;
        *reference = (struct reference){.kind = SCENE_MATERIAL, .id = ranges[i].material};
        snprintf(reference->path, sizeof reference->path, ".ranges[%u].material", i);
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
        *reference = (struct reference){.kind = SCENE_TEXTURE, .id = material->textures[i].texture};
        snprintf(reference->path, sizeof reference->path, ".textures[%u].texture", i);
        return true;
    }
    return false;
}

/* *cursor starts at 0. False: no more references. */
static bool next_reference(enum scene_object_kind kind, const void *object, uint32_t *cursor,
                           struct reference *reference)
{
    if (kind == SCENE_MESH) {
        const struct scene_mesh *mesh = object;
        return next_in_ranges(mesh->ranges, mesh->range_count, cursor, reference);
    }
    if (kind == SCENE_SPHERES) {
        const struct scene_spheres *spheres = object;
        return next_in_ranges(spheres->ranges, spheres->range_count, cursor, reference);
    }
    if (kind == SCENE_MATERIAL)
        return next_in_material(object, cursor, reference);
    if ((*cursor)++)
        return false;
    if (kind == SCENE_NODE) {
        const struct scene_node *node = object;
        *reference = (struct reference){.id = node->object, .path = ".object"};
        return node_kind_object(node->kind, &reference->kind);
    }
    if (kind == SCENE_DISC) {
        *reference =
            (struct reference){SCENE_MATERIAL, ((const struct scene_disc *)object)->material, ".material"};
        return reference->id != 0;
    }
    return false;
}

static bool set_check(struct draft *draft, const struct scene_edit *edit)
{
    struct edit_place place = draft_place(draft, edit);
    if (edit->object == SCENE_NODE && edit->set.node.kind == NODE_GROUP && edit->set.node.object)
        return edit_error(&place, ERROR_INVALID, ".object", "a group shows nothing, so this must be 0");
    struct reference reference;
    uint32_t cursor = 0;
    while (next_reference(edit->object, &edit->set, &cursor, &reference)) {
        if (reference.id && draft_find(draft, reference.kind, reference.id))
            continue;
        const char *kind = object_kind_name(reference.kind);
        edit_error(&place, ERROR_UNKNOWN_ID, reference.path, "there is no %s %u", kind, reference.id);
        return error_remedy(draft->error, "make it in this transaction or before");
    }
    return true;
}

/* All remaining objects of `user` are asked whether they refer to something that this transaction removes. */
static bool users_check(struct draft *draft, enum scene_object_kind user, const struct hashmap *fallen)
{
    size_t map_cursor = 0;
    uint64_t id;
    void *object;
    while (hashmap_next(&draft->scene->objects[user], &map_cursor, &id, &object)) {
        /* What is set or removed itself has been looked at. */
        if (hashmap_get(&draft->last[user], id) || (user == SCENE_NODE && hashmap_get(fallen, id)))
            continue;
        struct reference reference;
        uint32_t cursor = 0;
        while (next_reference(user, object, &cursor, &reference)) {
            const struct scene_edit *edit = hashmap_get(&draft->last[reference.kind], reference.id);
            if (!edit || edit->kind != EDIT_REMOVE)
                continue;
            struct edit_place place = draft_place(draft, edit);
            edit_error(&place, ERROR_INVALID, "", "%s %u still uses it (%s)", object_kind_name(user), (uint32_t)id,
                       reference.path + 1);
            return error_remedy(draft->error, "change or remove that %s in the same transaction",
                                object_kind_name(user));
        }
    }
    return true;
}

static bool removes_any(const struct draft *draft, enum scene_object_kind kind)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&draft->last[kind], &cursor, NULL, &value)) {
        if (((const struct scene_edit *)value)->kind == EDIT_REMOVE)
            return true;
    }
    return false;
}

static bool removals_check(struct draft *draft)
{
    struct hashmap fallen = {0};
    bool removes_shown = removes_any(draft, SCENE_MESH) || removes_any(draft, SCENE_SPHERES) ||
                         removes_any(draft, SCENE_LIGHT) || removes_any(draft, SCENE_CAMERA);
    bool fine = true;
    for (size_t i = 0; fine && removes_shown && i < draft->fallen_count; i++)
        fine = hashmap_put(&fallen, draft->fallen[i], draft) ||
               error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory for a table of removed nodes");
    if (fine && removes_shown)
        fine = users_check(draft, SCENE_NODE, &fallen);
    if (fine && removes_any(draft, SCENE_MATERIAL))
        fine = users_check(draft, SCENE_MESH, NULL) && users_check(draft, SCENE_SPHERES, NULL) &&
               users_check(draft, SCENE_DISC, NULL);
    if (fine && removes_any(draft, SCENE_TEXTURE))
        fine = users_check(draft, SCENE_MATERIAL, NULL);
    hashmap_finish(&fallen);
    return fine;
}

bool references_check(struct draft *draft)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (edit->kind == EDIT_SET && draft_counts(draft, edit) && !set_check(draft, edit))
            return false;
    }
    return removals_check(draft);
}
