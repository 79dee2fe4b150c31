/* SPDX-License-Identifier: MIT */
/* The transfer curve of sRGB (IEC 61966-2-1), values 0 .. 1. shaders/common/colour.glsl has it for GLSL. */
#ifndef FARLIGHT_PROTOCOL_COMMON_SRGB_H
#define FARLIGHT_PROTOCOL_COMMON_SRGB_H

#include <math.h>

static inline double linear_from_srgb(double srgb)
{
    return srgb <= 0.04045 ? srgb / 12.92 : pow((srgb + 0.055) / 1.055, 2.4);
}

static inline double srgb_from_linear(double linear)
{
    return linear <= 0.0031308 ? linear * 12.92 : 1.055 * pow(linear, 1 / 2.4) - 0.055;
}

#endif
