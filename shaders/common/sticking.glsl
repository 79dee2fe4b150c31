// SPDX-License-Identifier: MIT
// Share of a surface's radiance that depends on the eye: that of mirrors, glass and highlights, if
//
//   all lights shine without shadows, from their middles, and the light of these and the environment comes from all
//   around, in equal parts
//
// Reflection counts by the share of the mirror ray: the rough rest is blurred, and hardly changes within the radius of a
// key view. Refraction counts whole, as a window turns light by a fraction of its facets' turn. Light through blended
// surfaces counts as well: its source lies behind the surface.
//
// Defines: those of common/material.glsl and common/light.glsl.

#include "common/colour.glsl"
#include "common/environment.glsl"
#include "common/light.glsl"
#include "common/scattering.glsl"

// Light of all lights at a surface that is not glass seen from inside: the highlights, and the sum that counts as coming
// from all around.
vec2 light_of_lights(surface s, split parts, vec3 view, float NoV)
{
    vec2 sum = vec2(0.0);
    parts.scattered = vec3(0.0);
#ifdef HAS_SHEEN
    s.sheen = vec3(0.0);
#endif
    for (uint i = 0u; i < frame.light_count; i++) {
        light_sample sampled = light_sample_at(i, s.position, vec2(0.5));
        vec3 irradiance = sampled.irradiance * max(dot(s.normal, sampled.direction), 0.0);
        sum += vec2(luminance(brdf(s, parts, view, NoV, sampled.direction) * irradiance),
                    luminance(irradiance) * INVERSE_PI);
    }
    return sum;
}

float sticking_of(surface s, vec3 direction)
{
    if (s.unlit)
        return 1.0 - s.alpha;
    float NoV = clamp(-dot(s.normal, direction), 1e-4, 1.0); // a shading normal may lean away
    split parts = split_light(s, -direction, NoV);
    vec2 lit = in_glass(s) ? vec2(0.0) : light_of_lights(s, parts, -direction, NoV);
    float around = lit.y + luminance(environment_irradiance(s.normal));
    around = around > 0.0 ? around : 1.0;
    float mirrored = around * luminance(parts.mirror) + lit.x, refracted = around * luminance(parts.refracted);
    float coat = around * coat_ray_of(s, parts);
    float scattered = around * luminance(parts.scattered + sheen_of(parts) + passed_of(parts));
    float all = mirrored + refracted + scattered + luminance(s.emission) + coat;
    float sticks = parts.mirror_ray * mirrored + refracted + coat;
    return 1.0 - s.alpha * (1.0 - (all > 0.0 ? min(sticks / all, 1.0) : 0.0)); // NaN counts as 0
}
