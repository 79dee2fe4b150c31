/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHARED_WAVE_H
#define FARLIGHT_SHARED_WAVE_H
#include "shared/types.h"

/* The number of rays of a wave; counted on the device by the passes that append, read by the host after a pass. */
struct wave_state {
    uint ray_count; /* may exceed the capacity: then the wave has overflowed */
    uint capacity;
    uint pad0, pad1;
};
SHARED_SIZE(wave_state, 16)

/* The number of rays of a wave, if only the device knows it (trace/wave.h), and the work groups of a dispatch with
 * one invocation per ray and 64 per group, over two axes as common/dispatch.glsl counts them. The last three words
 * are the arguments of an indirect dispatch. */
struct wave_counts {
    uint ray_count;
    uint groups_x, groups_y, groups_z;
};
SHARED_SIZE(wave_counts, 16)

#endif
