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

#endif
