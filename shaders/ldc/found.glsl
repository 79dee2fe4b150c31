// SPDX-License-Identifier: MIT
// What a walk through cubes does with the samples that a ray crosses.
//
// Defines: those of trace.comp.
#include "shared/hit.h"
#include "common/sampled.glsl"
#include "ldc/cube.glsl"

// What a ray has found, and up to where it is still looking.
struct ldc_found {
    float end; // in lengths of the direction
#ifdef ANY_HIT
    vec3 taken;
#ifdef HAS_TRANSLUCENT
    // The last crossings of translucent surfaces, to tell one that two samples have from two: distances, greater than 0
    // where the ray came from behind, and materials.
    vec4 crossed;
    uvec4 materials;
#endif
#else
    uint sample_index; // HIT_NO_PRIMITIVE: none
#endif
};

#ifdef ANY_HIT

#ifdef HAS_TRANSLUCENT
// What of a shadow ray's light passes a sample: transmittance_of() of common/alpha.glsl. What a mask cuts away has no
// samples.
vec3 transmittance_of_sample(uvec4 words)
{
    material m = materials[sample_material(words)];
    vec3 through = vec3(0.0);
#ifdef HAS_TRANSMISSION
    float transmission = m.transmission * (1.0 - m.metallic) * sample_transmission(words);
    if (transmission > 0.0)
        through = transmission * clamp(m.base_colour.rgb * sample_base_colour(words).rgb, 0.0, 1.0);
#endif
    float alpha = m.base_colour.a * sample_alpha(words);
    return (m.flags & MATERIAL_ALPHA_BLEND) != 0u ? mix(vec3(1.0), through, clamp(alpha, 0.0, 1.0)) : through;
}
#endif

// The ray crosses a sample at a distance between its t_min and found.end. `near` is a cell, as a distance.
void offer_sample(inout ldc_found found, uint sample_index, float distance_, float side, float near)
{
#ifdef HAS_TRANSLUCENT
    uvec4 words = texelFetch(ldc_surface, int(sample_index));
    uint material_index = sample_material(words);
    // Samples of one surface overlap by the slack, and where images meet by up to a cell.
    float signed_ = side > 0.0 ? distance_ : -distance_;
    bvec4 same = lessThan(abs(found.crossed - signed_), vec4(near));
    same = bvec4(uvec4(same) * uvec4(equal(found.materials, uvec4(material_index))));
    vec3 through = transmittance_of_sample(words);
    if (any(same) && through != vec3(0.0))
        return;
    found.crossed = vec4(signed_, found.crossed.xyz);
    found.materials = uvec4(material_index, found.materials.xyz);
    found.taken = min(found.taken + taken_by(through), vec3(TAKEN_ALL));
    if (least(found.taken) >= TAKEN_BLACK)
        found.end = -1.0;
#else
    found.taken = vec3(TAKEN_ALL);
    found.end = -1.0;
#endif
}

ldc_found ldc_found_of(trace_ray r, vec3 taken)
{
#ifdef HAS_TRANSLUCENT
    return ldc_found(r.t_max, taken, vec4(1e30), uvec4(HIT_NO_PRIMITIVE));
#else
    return ldc_found(r.t_max, taken);
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
