/* SPDX-License-Identifier: MIT */
/* The answer of a shadow ray on the host: shared/ray.h. shaders/common/visibility.glsl has it for GLSL. */
#ifndef FARLIGHT_TRACE_VISIBILITY_H
#define FARLIGHT_TRACE_VISIBILITY_H

#include "shared/ray.h"

#include <math.h>

/* Of three transmittances, 0 to 1. */
static inline uint visibility_of(const float transmittance[3])
{
    uint light = 0;
    for (unsigned k = 0; k < 3; k++)
        light |= (uint)lrintf(cbrtf(transmittance[k]) * (float)VISIBILITY_MAX) << VISIBILITY_BITS * k;
    return light ? light | ~VISIBILITY_LIT : 0;
}

/* channel 0 to 2: red, green, blue. */
static inline double visibility_transmittance(uint visibility, unsigned channel)
{
    const double root = (double)(visibility >> VISIBILITY_BITS * channel & VISIBILITY_MAX) / VISIBILITY_MAX;
    return root * root * root;
}

#endif
