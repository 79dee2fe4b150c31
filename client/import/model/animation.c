/* SPDX-License-Identifier: MIT */
/* Skins, clips, channels and variants of the scene under construction. */
#include "edits.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool all_within(const float *values, size_t count, float maximum)
{
    for (size_t i = 0; i < count; i++)
        if (!(fabsf(values[i]) <= maximum)) /* NaN fails, too */
            return false;
    return true;
}

uint32_t import_reserve_id(struct import_scene *scene, enum protocol_object_kind kind)
{
    return import_next_id(scene, kind);
}

static bool skin_valid(struct import_scene *scene, const char *name, uint32_t joint_count, const uint32_t *joints,
                       const float *joint_from_mesh)
{
    if (scene->failed)
        return false;
    if (!joints || joint_count == 0 || joint_count > IMPORT_JOINTS_MAX)
        return import_fail(scene, name, "a skin of %u joints; 1 to %d are allowed", joint_count,
                           IMPORT_JOINTS_MAX);
    for (uint32_t i = 0; i < joint_count; i++)
        if (joints[i] == 0 || joints[i] > scene->last_id[PROTOCOL_OBJECT_NODE])
            return import_fail(scene, name, "joint %u of a skin is not a node", i);
    if (joint_from_mesh && !all_within(joint_from_mesh, (size_t)joint_count * 12, 3e38f))
        return import_fail(scene, name, "a skin has a matrix that is not finite");
    return true;
}

bool import_add_skin(struct import_scene *scene, uint32_t skin, const char *name, uint32_t joint_count,
                     uint32_t *joints, float *joint_from_mesh)
{
    struct import_edit *edit = NULL;

    if (skin_valid(scene, name, joint_count, joints, joint_from_mesh))
        edit = import_append(scene, MESSAGE_SET_SKIN);
    if (!edit) {
        free(joints);
        free(joint_from_mesh);
        return false;
    }
    edit->message.set_skin.skin = skin;
    edit->message.set_skin.value.joint_count = joint_count;
    edit->message.set_skin.name = import_copy_name(scene, name);
    edit->message.set_skin.arrays_count = joint_from_mesh ? 2 : 1;
    edit->blobs[0] = import_add_blob(scene, joints, (uint64_t)joint_count * sizeof(*joints));
    edit->blobs[1] =
        import_add_blob(scene, joint_from_mesh, (uint64_t)joint_count * 12 * sizeof(*joint_from_mesh));
    return !scene->failed;
}

bool import_add_clip(struct import_scene *scene, uint32_t clip, const char *name, float *floats, uint32_t count)
{
    struct import_edit *edit = NULL;

    if (!scene->failed && (!floats || count == 0 || !all_within(floats, count, 3e38f)))
        import_fail(scene, name, "a clip has numbers that are not finite, or none");
    else
        edit = import_append(scene, MESSAGE_SET_CLIP);
    if (!edit) {
        free(floats);
        return false;
    }
    edit->message.set_clip.clip = clip;
    edit->message.set_clip.name = import_copy_name(scene, name);
    edit->message.set_clip.arrays_count = 1;
    edit->blobs[0] = import_add_blob(scene, floats, (uint64_t)count * sizeof(*floats));
    return !scene->failed;
}

uint32_t import_add_channel(struct import_scene *scene, const struct message_set_channel *channel)
{
    struct import_edit *edit = import_append(scene, MESSAGE_SET_CHANNEL);

    if (!edit)
        return 0;
    edit->message.set_channel = *channel;
    return edit->message.set_channel.channel = import_next_id(scene, PROTOCOL_OBJECT_CHANNEL);
}

void import_list_clip(struct import_scene *scene, uint32_t clip, const char *name, uint32_t channels,
                      double duration_s)
{
    struct import_clip *grown =
        import_grow(scene, scene->clips, scene->clip_count, &scene->clip_capacity, sizeof(*grown));
    struct import_clip *listed;

    if (!grown)
        return;
    scene->clips = grown;
    listed = &grown[scene->clip_count++];
    import_prefix_name(scene, listed->name, name);
    listed->clip = clip;
    listed->channels = channels;
    listed->duration_s = duration_s >= 0 && duration_s <= 1e9 ? (float)duration_s : 0;
}

void import_list_variant(struct import_scene *scene, const char *name)
{
    struct import_variant *grown =
        import_grow(scene, scene->variants, scene->variant_count, &scene->variant_capacity, sizeof(*grown));

    if (!grown)
        return;
    scene->variants = grown;
    import_copy_text(grown[scene->variant_count++].name, sizeof(grown->name), name);
}
