/* SPDX-License-Identifier: MIT */
/* Keys of AFF as channels of a clip, whose time 0 is the animation's start. */
#ifndef FARLIGHT_IMPORT_AFF_CHANNEL_H
#define FARLIGHT_IMPORT_AFF_CHANNEL_H

#include "aff.h"

struct aff_clip {
    struct aff *aff;
    uint32_t id; /* 0: no channel so far */
    float *floats;
    size_t float_count, float_capacity;
    uint32_t channel_count;
    double end_s;
    /* Of the channel that is made, its times and its values. */
    float *times, *values;
    size_t time_count, time_capacity, value_count, value_capacity;
};

/* Each false: the scene has failed. */

/* Of the node that has the keys (NULL: none). `wanted`: a bit for each property that counts. */
bool aff_add_channels(struct aff_clip *clip, struct aff_keys *keys, uint32_t node, unsigned wanted);
/* Adds a constant for each of translation, rotation and scale that has no keys, so that they are all in the clip
 * and the node's matrix need not be taken apart. */
bool aff_add_constant_channels(struct aff_clip *clip, const struct aff_curve *curves, uint32_t node);
bool aff_add_morph_channel(struct aff_clip *clip, const struct aff_morph *morph);

#endif
