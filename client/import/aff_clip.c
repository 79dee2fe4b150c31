/* SPDX-License-Identifier: MIT */
#include "aff_channel.h"

#include <stdlib.h>

#define CLIP_NAME "animation"

static bool add_group_keys(struct aff_clip *clip, struct aff_keys *keys, uint32_t node)
{
    const struct aff_curve *curves;
    bool moves;

    if (!keys)
        return true;
    curves = keys->curves;
    moves = curves[AFF_TRANSL].count + curves[AFF_ROT].count + curves[AFF_SCALE].count > 0;
    return aff_add_channels(clip, keys, node, ~0u) && (!moves || aff_add_constant_channels(clip, curves, node));
}

static bool add_groups(struct aff_clip *clip)
{
    struct aff *aff = clip->aff;

    for (size_t i = 0; i < aff->group_count; i++) {
        const struct aff_group *group = aff->groups[i];

        if (group->name[0] != '\0' && !add_group_keys(clip, aff_find_keys(aff, group->name), group->node))
            return false;
        for (size_t m = 0; m < group->morph_count; m++)
            if (!aff_add_morph_channel(clip, &group->morphs[m]))
                return false;
    }
    return true;
}

static bool add_camera_and_lights(struct aff_clip *clip)
{
    struct aff *aff = clip->aff;
    struct aff_keys *camera = aff_find_keys(aff, "camera");

    if (camera && aff->nff.camera_node == 0)
        import_note(aff->nff.scene, PROTOCOL_SEVERITY_WARNING, NULL,
                    "there are keys of the camera but no 'v', which gives its angle; they are left out");
    else if (!aff_add_channels(clip, camera, aff->nff.camera_node, 1u << AFF_TRANSL | 1u << AFF_ROT))
        return false;
    for (size_t i = 0; i < aff->named_light_count; i++) {
        const struct aff_named_light *light = &aff->named_lights[i];

        if (!aff_add_channels(clip, aff_find_keys(aff, light->name), aff->nff.lights[light->light].node,
                              1u << AFF_TRANSL | 1u << AFF_VISIBILITY))
            return false;
    }
    return true;
}

static void note_unused(struct aff *aff)
{
    for (size_t i = 0; i < aff->key_count; i++)
        if (!aff_find_keys(aff, aff->keys[i].name)->used)
            import_note(aff->nff.scene, PROTOCOL_SEVERITY_INFO, NULL,
                        "nothing is named '%s': its keys are left out", aff->keys[i].name);
}

/* Frames as the file wants them, in the words of the command line. */
static void note_frames(const struct aff *aff)
{
    double duration_s = (double)aff->end_s - (double)aff->start_s;

    if (aff->has_animation && aff->frames > 1 && duration_s > 0)
        import_note(aff->nff.scene, PROTOCOL_SEVERITY_INFO, NULL,
                    "the animation has %u frames in %g s: --clip %s --clip-once --fps %g", aff->frames, duration_s,
                    CLIP_NAME, (aff->frames - 1) / duration_s);
}

bool aff_add_clip(struct aff *aff)
{
    struct aff_clip clip = {.aff = aff};
    bool added = add_groups(&clip) && add_camera_and_lights(&clip);

    if (added && clip.id != 0) {
        added = import_add_clip(aff->nff.scene, clip.id, CLIP_NAME, clip.floats, (uint32_t)clip.float_count);
        clip.floats = NULL;
        import_list_clip(aff->nff.scene, clip.id, CLIP_NAME, clip.channel_count, clip.end_s);
        note_frames(aff);
    }
    note_unused(aff);
    free(clip.floats);
    free(clip.times);
    free(clip.values);
    return added;
}
