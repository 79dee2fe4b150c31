// SPDX-License-Identifier: MIT
// Collects the samples that a ray intersects in a traversal of cubes.
//
// Defines: those of trace/wave.comp.
#include "shared/hit.h"
#include "common/intersected.glsl"
#include "common/sampled.glsl"
#include "ldc/cube.glsl"

// The nearest sample found, and the end of the remaining search.
struct ldc_found {
    float end; // in lengths of the direction
#ifdef ANY_HIT
    vec3 optical_depth;
#ifdef HAS_TRANSLUCENT
    intersected_surfaces intersected;
    bool stops; // RAY_STOPS_T_MIN
#endif
#else
    uint sample_index; // HIT_NO_PRIMITIVE: none
#endif
};

#ifdef ANY_HIT

#ifdef HAS_TRANSLUCENT
// Transmittance of a sample for a shadow ray, by transmittance_of() of common/alpha.glsl. Surfaces that a mask cuts away
// have no samples.
vec3 transmittance_of_sample(uvec4 words)
{
    material m = material_at(sample_material(words));
    vec3 through = vec3(0.0);
#ifdef HAS_TRANSMISSION
    float transmission = m.transmission * (1.0 - m.metallic * sample_metallic(words)) * sample_transmission(words);
    if (transmission > 0.0)
        through = transmission * clamp(m.base_colour.rgb * sample_base_colour(words).rgb, 0.0, 1.0) *
                  vec3(m.body_red, m.body_green, m.body_blue);
#endif
    float alpha = m.base_colour.a * sample_alpha(words);
    return (m.flags & MATERIAL_ALPHA_BLEND) != 0u ? mix(vec3(1.0), through, clamp(alpha, 0.0, 1.0)) : through;
}
#endif

// Records an intersection with a sample at a distance between t_min and found.end. `near` is a cell, as a distance.
void offer_sample(inout ldc_found found, uint sample_index, float distance_, float side, float near)
{
#ifdef HAS_TRANSLUCENT
    uvec4 words = texelFetch(ldc_surface, int(sample_index));
    add_intersected(found.intersected, found.optical_depth, sample_material(words), distance_, side, near,
                    found.stops ? vec3(0.0) : transmittance_of_sample(words));
    if (min_component(found.optical_depth) >= OPTICAL_DEPTH_BLACK)
        found.end = -1.0;
#else
    found.optical_depth = vec3(OPTICAL_DEPTH_MAX);
    found.end = -1.0;
#endif
}

ldc_found ldc_found_of(trace_ray r, vec3 optical_depth)
{
#ifdef HAS_TRANSLUCENT
    return ldc_found(r.t_max, optical_depth, intersected_nothing(), r.t_min == RAY_STOPS_T_MIN);
#else
    return ldc_found(r.t_max, optical_depth);
#endif
}

#else

void offer_sample(inout ldc_found found, uint sample_index, float distance_, float side, float near)
{
    found.end = distance_;
    found.sample_index = sample_index;
}

ldc_found ldc_found_of(trace_ray r, candidate best)
{
    return ldc_found(best.distance, HIT_NO_PRIMITIVE);
}

#endif
