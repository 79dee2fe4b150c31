// SPDX-License-Identifier: MIT
// Ray cones: the footprint of a ray, for the level of detail of textures. Akenine-Moeller et al. Texture Level of
// Detail Strategies for Real-Time Ray Tracing. 2019 (Ray Tracing Gems, 20), and Improved Shader and Texture Level of
// Detail Using Ray Cones. 2021.
//
// A cone has a width in metres and a spread, the growth of the width per metre (x, y of a vec2). Behind a surface that
// bends it, the footprint of a ray is longer in one direction than in the other; the width is the side of a square of the
// same area: the geometric mean of the width in the plane of incidence and that across it. Beyond a focus it is below 0.

#include "common/math.glsl"

// Maximum spread, for which the square of a hemisphere's solid angle is 2.5 wide.
const float CONE_SPREAD_MAX = 2.5;

vec2 cone_bounded(float width, float spread)
{
    return vec2(width, clamp(spread, -CONE_SPREAD_MAX, CONE_SPREAD_MAX));
}

// Reflects a cone. `curvature`: 1 / radius, above 0 where the surface bulges towards the ray. A normal that turns by an
// angle turns the mirrored direction by twice as much: Coddington's equations for the two planes, whose mean does not
// depend on the angle.
vec2 cone_mirrored(vec2 cone, float curvature)
{
    return cone_bounded(cone.x, cone.y + 2.0 * curvature * cone.x);
}

// Refracts a cone by Snell's law. `eta`: index behind / index before; cosines of the angles to the normal, above 0.
vec2 cone_refracted(vec2 cone, float curvature, float eta, float cosine_before, float cosine_behind)
{
    float stretch = sqrt(cosine_behind / cosine_before);
    float bent = curvature * cone.x * (eta * cosine_behind / cosine_before - 1.0);
    return cone_bounded(cone.x * stretch, (cone.y - bent) / (eta * stretch));
}

// Factor, to the first order, by which a ray turns with the facet that mirrors or refracts it.
float facet_turn(float eta, bool mirrored)
{
    return mirrored ? 2.0 : abs(1.0 - 1.0 / eta);
}

// Solid angle of a rough lobe: 1 / its density at the peak, which for GGX's facets is 1 / (pi alpha^2). No lobe is wider
// than Lambert's.
float lobe_solid_angle(float alpha, float turn)
{
    return min(PI * square(alpha * turn), PI);
}

// Cone of a ray that represents all directions of a solid angle, steradians. A pixel is such an angle, too, and its
// spread the root of it. Independent spreads add up as squares; a cone that converges towards a focus grows less.
vec2 cone_scattered(vec2 cone, float solid_angle)
{
    float opened = cone.y > 0.0 ? sqrt(cone.y * cone.y + solid_angle) : cone.y + sqrt(solid_angle);
    return cone_bounded(cone.x, opened);
}
