// SPDX-License-Identifier: MIT
// From linear light to display values.
#include "common/colour.glsl"

#define TONE_MAP_NEUTRAL 0u
#define TONE_MAP_ACES 1u
#define TONE_MAP_NONE 2u

// Khronos PBR Neutral Tone Mapper, specification 1.0: F_90 = 0.04, K_s = 0.8 - F_90, K_d = 0.15.
vec3 tone_map_neutral(vec3 colour)
{
    const float start = 0.8 - 0.04, desaturation = 0.15;
    float minimum = min(colour.r, min(colour.g, colour.b));
    colour -= minimum < 0.08 ? minimum - 6.25 * minimum * minimum : 0.04;
    float peak = max(colour.r, max(colour.g, colour.b));
    if (peak < start)
        return colour;
    float d = 1.0 - start;
    float new_peak = 1.0 - d * d / (peak + d - start);
    colour *= new_peak / peak;
    float g = 1.0 - 1.0 / (desaturation * (peak - new_peak) + 1.0);
    return mix(colour, vec3(new_peak), g);
}

// Narkowicz. ACES Filmic Tone Mapping Curve. 2015.
vec3 tone_map_aces(vec3 x)
{
    return x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14);
}

vec3 tone_map(vec3 colour, uint kind)
{
    // The curves are ratios of squares: beyond this they have long reached 1, and infinity would become NaN.
    colour = clamp(colour, vec3(0.0), vec3(1e9));
    if (kind == TONE_MAP_NEUTRAL)
        colour = tone_map_neutral(colour);
    else if (kind == TONE_MAP_ACES)
        colour = tone_map_aces(colour);
    return clamp(colour, vec3(0.0), vec3(1.0));
}
