/* SPDX-License-Identifier: MIT */
/* The transfer curve of sRGB (IEC 61966-2-1), values 0 .. 1; shaders/common/colour.glsl has it in GLSL. */
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

/* The float versions are for whole pictures. */
static inline float linear_from_srgb_f(float srgb)
{
    return srgb <= 0.04045f ? srgb / 12.92f : powf((srgb + 0.055f) / 1.055f, 2.4f);
}

static inline float srgb_from_linear_f(float linear)
{
    return linear <= 0.0031308f ? linear * 12.92f : 1.055f * powf(linear, 1 / 2.4f) - 0.055f;
}

#endif
