// SPDX-License-Identifier: MIT
// Translucent surfaces that a shadow ray has crossed, where these are stored as samples: one surface may have several
// near each other, and takes of the light once.
#include "shared/hit.h"
#include "common/candidate.glsl"

// The last of them, to tell one that two samples have from two: distances, greater than 0 where the ray came from behind,
// and materials.
struct crossed_surfaces {
    vec4 distances;
    uvec4 materials;
};

crossed_surfaces crossed_nothing()
{
    return crossed_surfaces(vec4(1e30), uvec4(HIT_NO_PRIMITIVE));
}

// One that lets `through` of the light pass is crossed at a distance; `side` is positive where the ray comes from behind.
// Samples of one surface overlap by the slack, and where images meet by up to a cell: `near`. Adds what it takes to
// `taken`, if it is not one of the last, or lets nothing pass.
void cross_surface(inout crossed_surfaces crossed, inout vec3 taken, uint material_index, float distance_, float side,
                   float near, vec3 through)
{
    float signed_ = side > 0.0 ? distance_ : -distance_;
    bvec4 same = lessThan(abs(crossed.distances - signed_), vec4(near));
    same = bvec4(uvec4(same) * uvec4(equal(crossed.materials, uvec4(material_index))));
    if (any(same) && through != vec3(0.0))
        return;
    crossed.distances = vec4(signed_, crossed.distances.xyz);
    crossed.materials = uvec4(material_index, crossed.materials.xyz);
    taken = min(taken + taken_by(through), vec3(TAKEN_ALL));
}
