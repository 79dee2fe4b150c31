// SPDX-License-Identifier: MIT
// Samples of a light for a surface: one that scatters light to its other side also samples lights behind it, from there.
//
// Defines: those of common/light.glsl and render/shade.glsl.

#include "common/light.glsl"
#include "render/shade.glsl"

// Samples a light. `origin`: of shadow rays on the viewer's side; becomes that of this one.
light_sample light_seen(surface s, float distance_, uint index, vec2 u, inout vec3 origin)
{
    light_sample sampled = light_sample_at(index, origin, u);
#ifdef HAS_DIFFUSE_TRANSMISSION
    if (dot(sampled.direction, s.geometric) < 0.0) {
        origin = off_surface(s, distance_, -s.geometric);
        sampled = light_sample_at(index, origin, u);
    }
#endif
    return sampled;
}

// Factor of a light's highlight: 0 for a steady one in a smooth mirror. Renderers with such lights showed in mirrors only
// objects that rays meet, and no ray meets a point.
float light_shine(uint index, float roughness)
{
    int kind = int(texelFetch(lights, int(index) * LIGHT_TEXELS).w);
    return kind == LIGHT_KIND_STEADY && roughness < ROUGHNESS_MIN_LIGHT ? 0.0 : 1.0;
}
