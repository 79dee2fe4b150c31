// SPDX-License-Identifier: MIT
// From the crossings of a closest-hit wave to hits: the second half of every exact tracer. Apart from the walk, whose
// program stays small by it.
//
// Defines: HAS_SPHERES as the scene has them.
#include "shared/ray.h"
#include "common/dispatch.glsl"
#include "common/surface.glsl"

layout(std430, binding = BIND_RAYS) readonly buffer ray_block { ray rays[]; };
layout(std430, binding = BIND_HITS) buffer hit_block { hit hits[]; };

uniform uint ray_count;

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    candidate found = candidate(hits[k].distance, hits[k].primitive, hits[k].instance, vec2(hits[k].u0, hits[k].v0));
    hits[k] = surface_of(found, rays[k].origin_t_min.xyz, rays[k].direction_t_max.xyz);
}
