/* SPDX-License-Identifier: MIT */
#ifndef FARLIGHT_SHARED_WAVE_H
#define FARLIGHT_SHARED_WAVE_H
#include "shared/types.h"

/* How many rays a wave holds; counted on the device by those who append, read by the host after a pass. */
struct wave_state {
    uint ray_count; /* may exceed the capacity: then the wave has overflowed */
    uint capacity;
    uint pad0, pad1;
};
SHARED_SIZE(wave_state, 16)

/* How many rays of a wave there are, where only the device knows (trace/wave.h), and the work groups that a
 * dispatch with one invocation a ray needs at 64 a group, over two axes as common/dispatch.glsl counts them. The
 * last three words are what an indirect dispatch reads. */
struct wave_counts {
    uint ray_count;
    uint groups_x, groups_y, groups_z;
};
SHARED_SIZE(wave_counts, 16)

#endif
