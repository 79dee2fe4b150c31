// SPDX-License-Identifier: MIT
// Radiance of paths that left the scene: the environment.
// Defines: those of common/environment.glsl; OPEN it is 1 everywhere, whatever the environment; SHARES paths have a share
// of it, and may be limited; HAS_AREA_LIGHTS with SHARES: paths also name the light that they hit; HAS_EMITTERS with
// both: the integrator samples emitters, too.

#include "shared/path.h"
#include "shared/ray.h"
#include "common/environment.glsl"
#include "common/light.glsl"
#include "render/fireflies.glsl"
#include "render/path_texels.glsl"

layout(binding = UNIT_RAYS) uniform samplerBuffer rays; // texels: software GL fetches these faster
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;

path path_at(uint k)
{
    int texel = int(k) * PATH_TEXELS;
    return path_of_texels(texelFetch(paths, texel), texelFetch(paths, texel + 1), texelFetch(paths, texel + 2));
}

#ifdef HAS_AREA_LIGHTS
// Number of the area light that the ray hit, plus 1.
uint met_number(path p)
{
#ifdef HAS_EMITTERS
    return p.light_number & PATH_LIGHT_MASK;
#else
    return p.light_number;
#endif
}
#endif

// Radiance at the end of the path. `of_light`: the part of an area light that it hit.
vec4 radiance_beyond(uint k, out vec3 of_light)
{
    of_light = vec3(0.0);
    path p = path_at(k);
    bool straight = (p.flags & PATH_STRAIGHT) != 0u, seen = straight && frame.environment_kind != ENVIRONMENT_NONE;
    if (straight && environment_is_hidden())
        return vec4(0.0);
    vec3 arriving = vec3(1.0);
#ifndef OPEN
    arriving = environment_radiance(texelFetch(rays, int(2u * k + 1u)).xyz);
#endif
#ifdef SHARES
    arriving *= p.environment_share;
#ifdef HAS_AREA_LIGHTS
    if (met_number(p) != 0u)
        of_light = light_at(met_number(p) - 1u).colour.rgb * p.light_share;
    arriving += of_light;
    vec3 share = of_light / max(arriving, vec3(1e-30));
#endif
#endif
    vec3 brought = vec3(p.weight_r, p.weight_g, p.weight_b) * arriving; // pixels beyond the picture's edge have weight 0
#ifdef SHARES
    brought = limited(p, 1u, brought);
#ifdef HAS_AREA_LIGHTS
    of_light = brought * share;
#endif
#endif
    return vec4(brought, seen ? p.weight_r : 0.0);
}
