/* SPDX-License-Identifier: MIT */
/* Encoding of a shadow ray's answer on the host (shared/ray.h); shaders/common/visibility.glsl is its
 * counterpart in GLSL. */
#ifndef FARLIGHT_TRACE_VISIBILITY_H
#define FARLIGHT_TRACE_VISIBILITY_H

#include "shared/ray.h"

#include <math.h>

/* Encodes three transmittances, 0 to 1. */
static inline uint visibility_of(const float transmittance[3])
{
    uint light = 0;
    for (unsigned k = 0; k < 3; k++)
        light |= (uint)lrintf(cbrtf(transmittance[k]) * (float)VISIBILITY_MAX) << VISIBILITY_BITS * k;
    return light ? light | ~VISIBILITY_LIT : 0;
}

/* Transmittance of channel 0 to 2: red, green, blue. */
static inline double visibility_transmittance(uint visibility, unsigned channel)
{
    const double root = (double)(visibility >> VISIBILITY_BITS * channel & VISIBILITY_MAX) / VISIBILITY_MAX;
    return root * root * root;
}

#endif
