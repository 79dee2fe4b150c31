/* SPDX-License-Identifier: MIT */
/* Checks pairs of objects: the numbers of channels lie in their clips, the joints of meshes in skins. They must
 * hold after an edit of either object. */
#include "scene/channel.h"
#include "scene/draft.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

/* ---- channels and clips ------------------------------------------------------------------------- */

/* Maximum of key times that one transaction compares one by one. Beyond it, the ascending runs of a clip's numbers
 * are found once: many channels may share their times, and must not multiply the cost. */
#define COMPARED_TIMES_MAX (UINT64_C(1) << 26)

struct ascents {
    uint64_t compared;
    struct hashmap clips; /* by identifier: the number of ascending values from each one on; owned u32s */
};

static void ascents_finish(struct ascents *ascents)
{
    size_t cursor = 0;
    void *lengths;
    while (hashmap_next(&ascents->clips, &cursor, NULL, &lengths))
        free(lengths);
    hashmap_finish(&ascents->clips);
}

/* Ascending runs of a clip; NULL: out of memory. */
static const uint32_t *ascents_of(struct ascents *ascents, const struct scene_clip *clip)
{
    uint32_t *lengths = hashmap_get(&ascents->clips, clip->base.id);
    size_t count = clip->floats->size_bytes / sizeof(float);
    const float *floats = (const float *)(const void *)clip->floats->data;
    if (lengths || !(lengths = malloc(count * sizeof(*lengths))))
        return lengths;
    for (size_t i = count; i-- > 0;) {
        bool ascends = i + 1 < count && floats[i + 1] > floats[i];
        lengths[i] = !ascends ? 1 : lengths[i + 1] < UINT32_MAX ? lengths[i + 1] + 1 : UINT32_MAX;
    }
    if (!hashmap_put(&ascents->clips, clip->base.id, lengths)) {
        free(lengths);
        return NULL;
    }
    return lengths;
}

/* Whether the clip has `count` numbers from `first` on. */
static bool has_numbers(const struct scene_clip *clip, uint64_t first, uint64_t count)
{
    uint64_t floats = clip->floats->size_bytes / sizeof(float);
    return first <= floats && count <= floats - first;
}

/* Finds the first key whose time is not after its predecessor's; key_count: all ascend. False: out of memory. */
static bool first_unordered(struct ascents *ascents, const struct scene_channel *channel,
                            const struct scene_clip *clip, uint32_t *key)
{
    const float *times = (const float *)(const void *)clip->floats->data + channel->value.first_time;
    ascents->compared += channel->value.key_count;
    if (ascents->compared > COMPARED_TIMES_MAX) {
        const uint32_t *lengths = ascents_of(ascents, clip);
        *key = !lengths || lengths[channel->value.first_time] > channel->value.key_count
                   ? channel->value.key_count
                   : lengths[channel->value.first_time];
        return lengths != NULL;
    }
    for (*key = 1; *key < channel->value.key_count && times[*key] > times[*key - 1];)
        ++*key;
    return true;
}

/* Whether a channel fits its clip. `whose` is the channel's own edit, or that of its clip. */
static bool channel_fits(struct ascents *ascents, const struct scene_channel *channel,
                         const struct scene_clip *clip, const struct edit_place *whose)
{
    bool own = whose->edit->object == OBJECT_CHANNEL;
    char text[160];
    const char *path = own ? ".first_time" : ".arrays[0] (times and values)";
    uint64_t value_floats = (uint64_t)channel->value.key_count * channel_key_floats(channel);
    uint64_t floats = clip->floats->size_bytes / sizeof(float);
    if (!has_numbers(clip, channel->value.first_time, channel->value.key_count)) {
        snprintf(text, sizeof(text), "its %u times from %u on reach beyond the %" PRIu64 " numbers of clip %u",
                 channel->value.key_count, channel->value.first_time, floats, channel->value.clip);
    } else if (!has_numbers(clip, channel->value.first_value, value_floats)) {
        path = own ? ".first_value" : path;
        snprintf(text, sizeof(text),
                 "its %" PRIu64 " numbers of values from %u on reach beyond the %" PRIu64 " numbers of clip %u",
                 value_floats, channel->value.first_value, floats, channel->value.clip);
    } else {
        uint32_t unordered;
        if (!first_unordered(ascents, channel, clip, &unordered))
            return edit_error(whose, ERROR_OUT_OF_MEMORY, path, "no memory to look at clip %u",
                              channel->value.clip);
        if (unordered == channel->value.key_count)
            return true;
        snprintf(text, sizeof(text), "its key %u is not after the one before it", unordered);
    }
    return own ? edit_error(whose, ERROR_INVALID, path, "%s", text)
               : edit_error(whose, ERROR_INVALID, path, "channel %u: %s", channel->base.id, text);
}

static bool channels_of_set_clips(struct draft *draft, struct ascents *ascents)
{
    size_t cursor = 0;
    const struct scene_channel *channel;
    while (draft->last[OBJECT_CLIP].count && (channel = draft_next_untouched(draft, OBJECT_CHANNEL, &cursor))) {
        const struct scene_edit *edit = hashmap_get(&draft->last[OBJECT_CLIP], channel->value.clip);
        if (!edit || edit->kind != EDIT_SET)
            continue;
        struct edit_place place = draft_place(draft, edit);
        if (!channel_fits(ascents, channel, &edit->set.clip, &place))
            return error_remedy(draft->error, "set or remove that channel in the same transaction");
    }
    return true;
}

/* ---- nodes, meshes and skins -------------------------------------------------------------------- */

static bool node_fits(struct draft *draft, const struct scene_node *node, const struct scene_edit *whose)
{
    const struct scene_mesh *mesh = draft_find(draft, OBJECT_MESH, node->value.object);
    const struct scene_skin *skin = draft_find(draft, OBJECT_SKIN, node->value.skin);
    if (!mesh || !skin || mesh->joint_places <= skin->value.joint_count)
        return true;
    struct edit_place place = draft_place(draft, whose);
    const char *path = whose->object == OBJECT_NODE   ? ".skin"
                       : whose->object == OBJECT_MESH ? ".arrays[7] (joints)"
                                                      : ".joint_count";
    edit_error(&place, ERROR_INVALID, path,
               "mesh %u refers to joint %u, but skin %u has %u; node %u shows that mesh with that skin",
               node->value.object, mesh->joint_places - 1, node->value.skin, skin->value.joint_count,
               node->base.id);
    return error_remedy(draft->error, "change the node, the mesh or the skin in the same transaction");
}

static const struct scene_edit *set_edit(const struct draft *draft, enum object_kind kind, uint32_t id)
{
    const struct scene_edit *edit = hashmap_get(&draft->last[kind], id);
    return edit && edit->kind == EDIT_SET ? edit : NULL;
}

static bool nodes_of_set_objects(struct draft *draft)
{
    size_t cursor = 0;
    const struct scene_node *node;
    bool any_skin = draft->scene->objects[OBJECT_SKIN].count > 0;
    if (!any_skin || !(draft->last[OBJECT_MESH].count || draft->last[OBJECT_SKIN].count))
        return true;
    while ((node = draft_next_untouched(draft, OBJECT_NODE, &cursor))) {
        if (!node->value.skin)
            continue;
        const struct scene_edit *edit = set_edit(draft, OBJECT_MESH, node->value.object);
        if (!edit)
            edit = set_edit(draft, OBJECT_SKIN, node->value.skin);
        if (edit && !node_fits(draft, node, edit))
            return false;
    }
    return true;
}

static bool set_objects_check(struct draft *draft, struct ascents *ascents)
{
    for (size_t i = 0; i < draft->edit_count; i++) {
        const struct scene_edit *edit = &draft->edits[i];
        if (draft_is_abandoned(draft))
            return false;
        if (edit->kind != EDIT_SET || !draft_counts(draft, edit))
            continue;
        if (edit->object == OBJECT_NODE && edit->set.node.value.skin && !node_fits(draft, &edit->set.node, edit))
            return false;
        if (edit->object != OBJECT_CHANNEL)
            continue;
        const struct scene_channel *channel = &edit->set.channel;
        struct edit_place place = draft_place(draft, edit);
        if (!channel_fits(ascents, channel, draft_find(draft, OBJECT_CLIP, channel->value.clip), &place))
            return false;
    }
    return true;
}

bool links_check(struct draft *draft)
{
    struct ascents ascents = {0};
    bool fine = set_objects_check(draft, &ascents) && channels_of_set_clips(draft, &ascents) &&
                nodes_of_set_objects(draft);
    ascents_finish(&ascents);
    return fine;
}
