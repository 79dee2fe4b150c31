/* SPDX-License-Identifier: MIT */
/* Rounding of depths to multiples of a step of 1 / depth. */
#include "protocol/pixels/inverse_depth.h"

#include <math.h>

float inverse_depth_step(float pixels, float radius, uint32_t height, float fov_y)
{
    const double pixels_a_radian = (double)height / (2.0 * tan((double)fov_y / 2.0));
    /* The error is at most half of it. */
    return (float)(2.0 * (double)pixels / (pixels_a_radian * (double)radius));
}

bool inverse_depth_round(const float *depths, size_t count, float step, uint16_t *rounded)
{
    const float inverse_step = 1.0f / step;
    bool good = isfinite(inverse_step);
    for (size_t i = 0; i < count; i++) {
        const float steps = depths[i] == 0.0f ? 0.0f : inverse_step / depths[i] + 0.5f;
        const bool fits = steps >= 0.0f && steps < 65536.0f;
        rounded[i] = (uint16_t)(fits ? steps : 0.0f);
        good &= fits;
    }
    return good;
}

void inverse_depth_restore(const uint16_t *rounded, size_t count, float step, float *depths)
{
    for (size_t i = 0; i < count; i++)
        depths[i] = rounded[i] == 0 ? 0.0f : 1.0f / ((float)rounded[i] * step);
}
