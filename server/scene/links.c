/* SPDX-License-Identifier: MIT */
/* Checks of what two objects have in common: the numbers of channels lie in their clips, the joints of meshes in
 * skins. Whichever of the two is set, they must fit afterwards. */
#include "scene/channel.h"
#include "scene/draft.h"

#include <inttypes.h>
#include <stdio.h>

/* ---- channels and clips ------------------------------------------------------------------------- */

/* `count` numbers from `first` on are there. */
static bool has_numbers(const struct scene_clip *clip, uint64_t first, uint64_t count)
{
    uint64_t floats = clip->floats->size_bytes / sizeof(float);
    return first <= floats && count <= floats - first;
}

/* Key whose time is not after that of the one before; key_count: all ascend. */
static uint32_t first_unordered(const struct scene_channel *channel, const struct scene_clip *clip)
{
    const float *times = (const float *)(const void *)clip->floats->data + channel->first_time;
    for (uint32_t i = 1; i < channel->key_count; i++) {
        if (!(times[i] > times[i - 1]))
            return i;
    }
    return channel->key_count;
}

/* `whose` is the channel's own edit, or that of its clip. */
static bool channel_fits(const struct scene_channel *channel, const struct scene_clip *clip,
                         const struct edit_place *whose)
{
    bool own = whose->edit->object == SCENE_CHANNEL;
    char text[160];
    const char *path = own ? ".first_time" : ".arrays[0] (times and values)";
    uint64_t value_floats = (uint64_t)channel->key_count * channel_key_floats(channel);
    uint64_t floats = clip->floats->size_bytes / sizeof(float);
    if (!has_numbers(clip, channel->first_time, channel->key_count)) {
        snprintf(text, sizeof text, "its %u times from %u on reach beyond the %" PRIu64 " numbers of clip %u",
                 channel->key_count, channel->first_time, floats, channel->clip);
    } else if (!has_numbers(clip, channel->first_value, value_floats)) {
        path = own ? ".first_value" : path;
        snprintf(text, sizeof text,
                 "its %" PRIu64 " numbers of values from %u on reach beyond the %" PRIu64 " numbers of clip %u",
                 value_floats, channel->first_value, floats, channel->clip);
    } else {
        uint32_t unordered = first_unordered(channel, clip);
        if (unordered == channel->key_count)
            return true;
        snprintf(text, sizeof text, "its key %u is not after the one before it", unordered);
    }
    return own ? edit_error(whose, ERROR_INVALID, path, "%s", text)
               : edit_error(whose, ERROR_INVALID, path, "channel %u: %s", channel->base.id, text);
}

static bool channels_of_set_clips(struct draft *draft)
{
    size_t cursor = 0;
    const struct scene_channel *channel;
    while (draft->last[SCENE_CLIP].count && (channel = draft_next_untouched(draft, SCENE_CHANNEL, &cursor))) {
        const struct scene_edit *edit = hashmap_get(&draft->last[SCENE_CLIP], channel->clip);
        if (!edit || edit->kind != EDIT_SET)
            continue;
        struct edit_place place = draft_place(draft, edit);
        if (!channel_fits(channel, &edit->set.clip, &place))
            return error_remedy(draft->error, "set or remove that channel in the same transaction");
    }
    return true;
}

/* ---- nodes, meshes and skins -------------------------------------------------------------------- */

static bool node_fits(struct draft *draft, const struct scene_node *node, const struct scene_edit *whose)
{
    const struct scene_mesh *mesh = draft_find(draft, SCENE_MESH, node->object);
    const struct scene_skin *skin = draft_find(draft, SCENE_SKIN, node->skin);
    if (!mesh || !skin || mesh->joint_places <= skin->joint_count)
        return true;
    struct edit_place place = draft_place(draft, whose);
    const char *path = whose->object == SCENE_NODE   ? ".skin"
                       : whose->object == SCENE_MESH ? ".arrays[7] (joints)"
                                                     : ".joint_count";
    edit_error(&place, ERROR_INVALID, path,
               "mesh %u refers to joint %u, but skin %u has %u; node %u shows that mesh with that skin",
               node->object, mesh->joint_places - 1, node->skin, skin->joint_count, node->base.id);
    return error_remedy(draft->error, "change the node, the mesh or the skin in the same transaction");
}

static const struct scene_edit *set_edit(const struct draft *draft, enum scene_object_kind kind, uint32_t id)
{
    const struct scene_edit *edit = hashmap_get(&draft->last[kind], id);
    return edit && edit->kind == EDIT_SET ? edit : NULL;
}

static bool nodes_of_set_objects(struct draft *draft)
{
    size_t cursor = 0;
    const struct scene_node *node;
    bool any_skin = draft->scene->objects[SCENE_SKIN].count > 0;
    if (!any_skin || !(draft->last[SCENE_MESH].count || draft->last[SCENE_SKIN].count))
        return true;
    while ((node = draft_next_untouched(draft, SCENE_NODE, &cursor))) {
        if (!node->skin)
            continue;
        const struct scene_edit *edit = set_edit(draft, SCENE_MESH, node->object);
        if (!edit)
            edit = set_edit(draft, SCENE_SKIN, node->skin);
        if (edit && !node_fits(draft, node, edit))
            return false;
    }
    return true;
}

bool links_check(struct draft *draft)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (edit->kind != EDIT_SET || !draft_counts(draft, edit))
            continue;
        if (edit->object == SCENE_NODE && edit->set.node.skin && !node_fits(draft, &edit->set.node, edit))
            return false;
        if (edit->object != SCENE_CHANNEL)
            continue;
        const struct scene_channel *channel = &edit->set.channel;
        struct edit_place place = draft_place(draft, edit);
        if (!channel_fits(channel, draft_find(draft, SCENE_CLIP, channel->clip), &place))
            return false;
    }
    return channels_of_set_clips(draft) && nodes_of_set_objects(draft);
}
