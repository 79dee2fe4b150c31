// SPDX-License-Identifier: MIT
// Lets the eye's rays that met nothing meet the ground (server/render/passes/ground/ground.h): they become hits with HIT_GROUND. The
// ground lies below all objects, so they hide it and never the other way round; from below it is invisible.

#include "shared/hit.h"
#include "shared/path.h"
#include "common/dispatch.glsl"
#include "common/intersect.glsl"
#include "common/unit.glsl"
#include "render/wave.glsl"

layout(local_size_x = 64) in;

uniform vec4 ground_centre_radius;
uniform vec4 ground_normal; // unit

layout(binding = UNIT_RAYS) uniform samplerBuffer rays;
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;
layout(std430, binding = BIND_HITS) buffer hit_block { hit hits[]; };

void main()
{
    uint k = item_index();
    if (k >= wave.rays.count || hits[k].distance >= 0.0)
        return;
    vec4 origin = texelFetch(rays, int(2u * k)), direction = texelFetch(rays, int(2u * k + 1u));
    bool of_eye = (texelFetch(paths, int(k) * PATH_TEXELS + 1).z & PATH_STRAIGHT) != 0u;
    float distance_;
    bool is_met = intersect_disc(origin.xyz, direction.xyz, ground_centre_radius.xyz, ground_normal.xyz,
                                 ground_centre_radius.w, distance_);
    if (!of_eye || !is_met || !(dot(direction.xyz, ground_normal.xyz) < 0.0) || distance_ <= max(origin.w, 0.0) ||
        distance_ >= direction.w)
        return;
    uint normal = pack_unit(ground_normal.xyz);
    hits[k] = hit(distance_, HIT_GROUND, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE, uvec4(0u), normal, normal, 0u, 0xffffffffu);
}
