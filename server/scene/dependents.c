/* SPDX-License-Identifier: MIT */
/* Removes objects together with others: a channel with its clip or its target, a skin with any of its joints. A
 * client that removes a model removes its nodes, and need not know their animation. */
#include "scene/channel.h"
#include "scene/draft.h"

static bool removes_nodes(const struct draft *draft)
{
    return draft->fallen[OBJECT_NODE].count || draft_removes_any(draft, OBJECT_NODE);
}

static bool channels_fall(struct draft *draft)
{
    size_t cursor = 0;
    const struct scene_channel *channel;
    while ((channel = draft_next_untouched(draft, OBJECT_CHANNEL, &cursor))) {
        enum object_kind kind;
        const struct channel_row *row = channel_row(channel->value.path);
        bool has_object = row && channel_object_kind(row->target, &kind);
        if (draft_find(draft, OBJECT_CLIP, channel->value.clip) &&
            (!has_object || draft_remaining(draft, kind, channel->value.object)))
            continue;
        if (!draft_note_fallen(draft, OBJECT_CHANNEL, channel->base.id))
            return false;
    }
    return true;
}

/* Place of the first joint that is removed; joint_count: all remain. */
static uint32_t first_gone(const struct draft *draft, const struct scene_skin *skin)
{
    const uint32_t *joints = (const uint32_t *)(const void *)skin->joints->data;
    uint32_t i = 0;
    while (i < skin->value.joint_count && draft_remaining(draft, OBJECT_NODE, joints[i]))
        i++;
    return i;
}

static bool skins_fall(struct draft *draft, struct hashmap *falling)
{
    size_t cursor = 0;
    const struct scene_skin *skin;
    while ((skin = draft_next_untouched(draft, OBJECT_SKIN, &cursor))) {
        if (first_gone(draft, skin) == skin->value.joint_count)
            continue;
        if (!draft_note_fallen(draft, OBJECT_SKIN, skin->base.id))
            return false;
        if (!hashmap_put(falling, skin->base.id, draft))
            return error_set(draft->error, ERROR_OUT_OF_MEMORY, "edits", "no memory for a table of skins");
    }
    return true;
}

/* Finds the edit that removes a node or an ancestor. */
static const struct scene_edit *removal_of(const struct draft *draft, uint32_t node)
{
    const struct scene_edit *edit = hashmap_get(&draft->last[OBJECT_NODE], node);
    for (int depth = 0; depth < SCENE_DEPTH_MAX && !(edit && edit->kind == EDIT_REMOVE); depth++) {
        const struct scene_node *below = scene_node(draft->scene, node);
        if (!below)
            break;
        node = below->value.parent;
        edit = hashmap_get(&draft->last[OBJECT_NODE], node);
    }
    return edit;
}

static bool skin_in_use(struct draft *draft, const struct scene_node *user)
{
    const struct scene_skin *skin = scene_skin(draft->scene, user->value.skin);
    const uint32_t *joints = (const uint32_t *)(const void *)skin->joints->data;
    uint32_t place = first_gone(draft, skin);
    const struct scene_edit *edit = removal_of(draft, joints[place]);
    struct edit_place at = draft_place(draft, edit ? edit : draft->edits);
    edit_error(&at, ERROR_INVALID, "", "with it goes node %u, joint %u of skin %u, which node %u still has",
               joints[place], place, user->value.skin, user->base.id);
    return error_remedy(draft->error, "remove node %u or its skin in the same transaction", user->base.id);
}

static bool users_check(struct draft *draft, const struct hashmap *falling)
{
    size_t cursor = 0;
    const struct scene_node *node;
    while ((node = draft_next_untouched(draft, OBJECT_NODE, &cursor))) {
        if (node->value.skin && hashmap_get(falling, node->value.skin))
            return skin_in_use(draft, node);
    }
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (edit->kind == EDIT_SET && edit->object == OBJECT_NODE && draft_counts(draft, edit) &&
            edit->set.node.value.skin && hashmap_get(falling, edit->set.node.value.skin))
            return skin_in_use(draft, &edit->set.node);
    }
    return true;
}

bool dependents_check(struct draft *draft)
{
    bool nodes = removes_nodes(draft);
    if ((nodes || draft_removes_any(draft, OBJECT_LIGHT) || draft_removes_any(draft, OBJECT_MATERIAL) ||
         draft_removes_any(draft, OBJECT_CLIP)) &&
        !channels_fall(draft))
        return false;
    if (!nodes)
        return true;
    struct hashmap falling = {0};
    bool fine = skins_fall(draft, &falling) && (!falling.count || users_check(draft, &falling));
    hashmap_finish(&falling);
    return fine;
}
