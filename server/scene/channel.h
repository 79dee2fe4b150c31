/* SPDX-License-Identifier: MIT */
/* The properties of each channel path. Private to scene/. */
#ifndef FARLIGHT_SCENE_CHANNEL_H
#define FARLIGHT_SCENE_CHANNEL_H

#include "scene/curve.h"

#include <stdbool.h>

/* Kinds of things that channels change, in the order in which a pose is made. */
enum channel_target { TARGET_NODE, TARGET_WEIGHTS, TARGET_LIGHT, TARGET_MATERIAL, TARGET_VIEW };

struct channel_row {
    enum channel_target target;
    uint32_t width_min, width_max; /* numbers of a value */
    double min, max;               /* that a number may be, as the protocol has it; evaluated ones are clamped */
};
/* NULL: no such path. */
const struct channel_row *channel_row(enum channel_path path);
/* Kind of the object that a target is; false for the view. */
bool channel_object_kind(enum channel_target target, enum object_kind *kind);
/* Floats of one key. */
uint32_t channel_key_floats(const struct scene_channel *channel);
/* The channel's numbers in its clip, which must have them. */
struct curve channel_curve(const struct scene_channel *channel, const struct scene_clip *clip);

#endif
