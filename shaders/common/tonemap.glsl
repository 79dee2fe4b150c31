// SPDX-License-Identifier: MIT
// Tone mapping from linear light to display values.
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

// Hill. A fit of the ACES reference and output transforms, 2016: to its colours and back, with light divided by 0.6, as
// viewers of glTF do ("ACESFilmic" of three.js).
vec3 tone_map_aces(vec3 colour)
{
    const mat3 from_linear = mat3(0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777);
    const mat3 to_linear = mat3(1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602);
    vec3 x = from_linear * (colour / 0.6);
    return to_linear * ((x * (x + 0.0245786) - 0.000090537) / (x * (0.983729 * x + 0.4329510) + 0.238081));
}

vec3 tone_map(vec3 colour, uint kind)
{
    // The curves are ratios of squares: at this limit they have long reached 1, and infinity would become NaN.
    colour = clamp(colour, vec3(0.0), vec3(1e9));
    if (kind == TONE_MAP_NEUTRAL)
        colour = tone_map_neutral(colour);
    else if (kind == TONE_MAP_ACES)
        colour = tone_map_aces(colour);
    return clamp(colour, vec3(0.0), vec3(1.0));
}
