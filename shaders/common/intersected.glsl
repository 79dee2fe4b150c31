// SPDX-License-Identifier: MIT
// Translucent surfaces that a shadow ray has intersected, if they are stored as samples: one surface may have several
// samples near each other, and must attenuate the light once.
#include "shared/hit.h"
#include "common/candidate.glsl"

// The last ones, which distinguish one surface with two samples from two surfaces: distances, positive if the ray came
// from behind, and materials.
struct intersected_surfaces {
    vec4 distances;
    uvec4 materials;
};

intersected_surfaces intersected_nothing()
{
    return intersected_surfaces(vec4(1e30), uvec4(HIT_NO_PRIMITIVE));
}

// Adds a surface that transmits `through` of the light at a distance to `optical_depth`, unless it is one of the last
// ones; an opaque one always. `side` is positive if the ray comes from behind. Samples of one surface overlap by the
// slack, and where images meet by up to a cell: `near`.
void add_intersected(inout intersected_surfaces intersected, inout vec3 optical_depth, uint material_index,
                     float distance_, float side, float near, vec3 through)
{
    float signed_ = side > 0.0 ? distance_ : -distance_;
    bvec4 same = lessThan(abs(intersected.distances - signed_), vec4(near));
    same = bvec4(uvec4(same) * uvec4(equal(intersected.materials, uvec4(material_index))));
    if (any(same) && through != vec3(0.0))
        return;
    intersected.distances = vec4(signed_, intersected.distances.xyz);
    intersected.materials = uvec4(material_index, intersected.materials.xyz);
    optical_depth = min(optical_depth + optical_depth_of(through), vec3(OPTICAL_DEPTH_MAX));
}
