/* SPDX-License-Identifier: MIT */
/* Table of channel paths. */
#include "scene/channel.h"

#define PLACE_MAX 1e12

const struct channel_row *channel_row(enum channel_path path)
{
    static const struct channel_row rows[] = {
        [CHANNEL_NODE_TRANSLATION] = {TARGET_NODE, 3, 3, -PLACE_MAX, PLACE_MAX},
        [CHANNEL_NODE_ROTATION] = {TARGET_NODE, 4, 4, -1, 1},
        [CHANNEL_NODE_SCALE] = {TARGET_NODE, 3, 3, -PLACE_MAX, PLACE_MAX},
        [CHANNEL_NODE_WEIGHTS] = {TARGET_WEIGHTS, 1, CURVE_WIDTH_MAX, -1e6, 1e6},
        [CHANNEL_NODE_HIDDEN] = {TARGET_NODE, 1, 1, 0, 1},
        [CHANNEL_LIGHT_COLOUR] = {TARGET_LIGHT, 3, 3, 0, 1e12},
        [CHANNEL_LIGHT_SIZE] = {TARGET_LIGHT, 2, 2, 0, 1e12},
        [CHANNEL_MATERIAL_BASE_COLOUR] = {TARGET_MATERIAL, 4, 4, 0, 1},
        [CHANNEL_MATERIAL_EMISSION] = {TARGET_MATERIAL, 3, 3, 0, 1e6},
        [CHANNEL_MATERIAL_METALLIC] = {TARGET_MATERIAL, 1, 1, 0, 1},
        [CHANNEL_MATERIAL_ROUGHNESS] = {TARGET_MATERIAL, 1, 1, 0, 1},
        [CHANNEL_MATERIAL_TRANSMISSION] = {TARGET_MATERIAL, 1, 1, 0, 1},
        [CHANNEL_MATERIAL_IOR] = {TARGET_MATERIAL, 1, 1, 1, 10},
        [CHANNEL_VIEW_EYE] = {TARGET_VIEW, 3, 3, -PLACE_MAX, PLACE_MAX},
        [CHANNEL_VIEW_LOOK_AT] = {TARGET_VIEW, 3, 3, -PLACE_MAX, PLACE_MAX},
        [CHANNEL_VIEW_UP] = {TARGET_VIEW, 3, 3, -1e6, 1e6},
        [CHANNEL_VIEW_FOV_Y] = {TARGET_VIEW, 1, 1, 0.001, 3.1},
        [CHANNEL_VIEW_APERTURE] = {TARGET_VIEW, 1, 1, 0, 1e6},
        [CHANNEL_VIEW_FOCUS] = {TARGET_VIEW, 1, 1, 0, 1e12},
        [CHANNEL_VIEW_EXPOSURE] = {TARGET_VIEW, 1, 1, -64, 64},
    };
    if ((unsigned)path >= sizeof(rows) / sizeof(rows[0]) || !rows[path].width_min)
        return NULL;
    return &rows[path];
}

bool channel_object_kind(enum channel_target target, enum object_kind *kind)
{
    switch (target) {
    case TARGET_NODE:
    case TARGET_WEIGHTS:
        *kind = OBJECT_NODE;
        return true;
    case TARGET_LIGHT:
        *kind = OBJECT_LIGHT;
        return true;
    case TARGET_MATERIAL:
        *kind = OBJECT_MATERIAL;
        return true;
    case TARGET_VIEW:
        break;
    }
    return false;
}

uint32_t channel_key_floats(const struct scene_channel *channel)
{
    bool has_controls = channel->value.interpolation == INTERPOLATION_CUBIC_SPLINE ||
                        channel->value.interpolation == INTERPOLATION_BEZIER;
    return channel->value.width * (has_controls ? 3u : 1u);
}

struct curve channel_curve(const struct scene_channel *channel, const struct scene_clip *clip)
{
    const float *floats = (const float *)(const void *)clip->floats->data;
    return (struct curve){
        .times = floats + channel->value.first_time,
        .values = floats + channel->value.first_value,
        .time_stride = 1,
        .key_stride = channel_key_floats(channel),
        .key_count = channel->value.key_count,
        .width = channel->value.width,
        .interpolation = channel->value.interpolation,
    };
}
