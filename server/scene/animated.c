/* SPDX-License-Identifier: MIT */
/* Checks animated objects, each alone: weights of morph targets, skins, clips and their channels. */
#include "scene/channel.h"
#include "scene/edit.h"

#include <float.h>
#include <stdio.h>

#define MORPH_WEIGHT_MAX 1e6f

bool weights_check(const float *weights, uint32_t count, const struct edit_place *place)
{
    size_t bad = first_bad_float(weights, count, MORPH_WEIGHT_MAX);
    if (count > MESH_TARGETS_MAX)
        return edit_error(place, ERROR_INVALID, ".weights", "%u are more than %d", count, MESH_TARGETS_MAX);
    if (bad == count)
        return true;
    char path[32];
    snprintf(path, sizeof(path), ".weights[%zu]", bad);
    return edit_error(place, ERROR_INVALID, path, "%g is not finite or beyond 1e6", (double)weights[bad]);
}

bool node_check(const struct scene_node *node, const struct edit_place *place)
{
    if (node->value.skin && node->value.kind != NODE_MESH)
        return edit_error(place, ERROR_INVALID, ".skin",
                          "only a node that shows a mesh has a skin, so this must be 0");
    return weights_check(node->weights, node->weight_count, place);
}

static const char matrices_path[] = ".arrays[1] (joint_from_mesh)";
static const char clip_floats_path[] = ".arrays[0] (times and values)";

bool skin_check_shape(const struct scene_skin *skin, const struct edit_place *place)
{
    const char *joints = ".arrays[0] (joints)";
    if (!skin->value.joint_count || skin->value.joint_count > SKIN_JOINTS_MAX)
        return edit_error(place, ERROR_INVALID, ".joint_count", "%u is not within 1 .. %d",
                          skin->value.joint_count, SKIN_JOINTS_MAX);
    if (!skin->joints)
        return edit_error(place, ERROR_INVALID, joints, "a skin needs this array");
    return array_size_check(skin->joints, skin->value.joint_count, 4, joints, place) &&
           (!skin->joint_from_mesh ||
            array_size_check(skin->joint_from_mesh, skin->value.joint_count, 48, matrices_path, place));
}

bool skin_check_content(const struct scene_skin *skin, const struct edit_place *place)
{
    if (!skin->joint_from_mesh)
        return true;
    const float *values = (const float *)(const void *)skin->joint_from_mesh->data;
    size_t count = (size_t)skin->value.joint_count * 12, bad = first_bad_float(values, count, COORDINATE_MAX);
    if (bad == count)
        return true;
    edit_error(place, ERROR_INVALID, matrices_path, "the matrix of joint %zu has %g as entry %zu", bad / 12,
               (double)values[bad], bad % 12);
    return error_remedy(place->error, "numbers must be finite and not beyond 1e18");
}

bool clip_check_shape(const struct scene_clip *clip, const struct edit_place *place)
{
    const char *path = clip_floats_path;
    if (!clip->floats)
        return edit_error(place, ERROR_INVALID, path, "a clip needs this array");
    if (clip->floats->size_bytes % 4)
        return edit_error(place, ERROR_INVALID, path, "the array has %zu bytes, which are no whole floats",
                          clip->floats->size_bytes);
    return true;
}

bool clip_check_content(const struct scene_clip *clip, const struct edit_place *place)
{
    const float *values = (const float *)(const void *)clip->floats->data;
    size_t count = clip->floats->size_bytes / 4, bad = first_bad_float(values, count, FLT_MAX);
    if (bad == count)
        return true;
    return edit_error(place, ERROR_INVALID, clip_floats_path, "number %zu is %g, which is not finite", bad,
                      (double)values[bad]);
}

bool channel_check(const struct scene_channel *channel, const struct edit_place *place)
{
    const struct channel_row *row = channel_row(channel->value.path);
    enum object_kind kind;
    if (!row)
        return edit_error(place, ERROR_INVALID, ".path", "%u is no path", (unsigned)channel->value.path);
    if ((unsigned)channel->value.interpolation > INTERPOLATION_BEZIER)
        return edit_error(place, ERROR_INVALID, ".interpolation", "%u is no interpolation",
                          (unsigned)channel->value.interpolation);
    if (channel->value.width < row->width_min || channel->value.width > row->width_max)
        return edit_error(place, ERROR_INVALID, ".width", "values of this path have %u numbers, not %u",
                          row->width_min, channel->value.width);
    if (!channel->value.key_count)
        return edit_error(place, ERROR_INVALID, ".key_count", "a channel has at least one key");
    if (!channel_object_kind(row->target, &kind) && channel->value.object)
        return edit_error(place, ERROR_INVALID, ".object", "the view is no object, so this must be 0");
    return true;
}
