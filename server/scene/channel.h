/* SPDX-License-Identifier: MIT */
/* Properties of each channel path. Private to scene/. */
#ifndef FARLIGHT_SCENE_CHANNEL_H
#define FARLIGHT_SCENE_CHANNEL_H

#include "scene/curve.h"

#include <stdbool.h>

/* Kinds of targets of channels, in the order in which a pose is made. */
enum channel_target { TARGET_NODE, TARGET_WEIGHTS, TARGET_LIGHT, TARGET_MATERIAL, TARGET_VIEW };

struct channel_row {
    enum channel_target target;
    uint32_t width_min, width_max; /* numbers per value */
    double min, max;               /* range of a number in the protocol; evaluated numbers are clamped to it */
};
/* Gets the row of a path; NULL: no such path. */
const struct channel_row *channel_row(enum channel_path path);
/* Gets the kind of object that a target is; false for the view. */
bool channel_object_kind(enum channel_target target, enum object_kind *kind);
/* Number of floats of a key. */
uint32_t channel_key_floats(const struct scene_channel *channel);
/* Curve of the channel's numbers in its clip, which must have them. */
struct curve channel_curve(const struct scene_channel *channel, const struct scene_clip *clip);

#endif
