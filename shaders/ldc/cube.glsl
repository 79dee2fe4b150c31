// SPDX-License-Identifier: MIT
// Rays in the cells of a cube, and their intersections with samples.
//
// The cubes of a scene, `ldc_cubes` of them, are traversed in order; each has its own lower corner, cell size and
// places in the buffers.
//
// Rays in a cube are those of common/cell_ray.glsl.
//
// Defines: LDC_CUBES 1 or 2; LDC_TOLERANCE a hit is where the ray comes within LDC_TOLERANCE_CELLS of a sample's depth,
// else where it intersects the sample's plane.
#include "shared/bindings.h"
#include "common/cell_ray.glsl"
#include "ldc/plane.glsl"

#ifndef LDC_CELLS
layout(binding = UNIT_TRACER_0) uniform usamplerBuffer ldc_texels;
layout(binding = UNIT_TRACER_1) uniform samplerBuffer ldc_quads;
#endif
layout(binding = UNIT_TRACER_2) uniform usamplerBuffer ldc_geometry;
layout(binding = UNIT_TRACER_3) uniform usamplerBuffer ldc_surface;

uniform vec4 ldc_place[LDC_CUBES]; // lower corner, world; size of a cell
uniform int ldc_resolution[LDC_CUBES];
uniform int ldc_first_texel[LDC_CUBES];
uniform int ldc_first_node[LDC_CUBES];

// A uniform with the same index for a whole SIMD group is read once; with an index per lane, lane by lane.
#if LDC_CUBES == 1
#define CUBE(number) 0
#else
#define CUBE(number) number
#endif

cell_ray cube_ray_of(trace_ray r, int cube)
{
    return cell_ray_of(r, ldc_place[CUBE(cube)], float(ldc_resolution[CUBE(cube)]));
}

// Intersects the ray (o, d in the image) with a sample of a texel. `normal` may have any length; `side` is positive if
// the ray comes from behind; `beside` is how far beyond the texel the intersection is, in cells.
bool intersect_sample(vec3 o, vec3 d, int cube, vec2 texel, float depth, vec3 normal, out float s, out float side,
                      out float beside)
{
    vec3 to_sample = vec3(texel + 0.5, depth) - o;
    float height = dot(normal, to_sample);
    side = dot(normal, d);
#ifdef LDC_TOLERANCE
    // The point of the ray in the texel that is nearest to the sample's depth.
    vec2 inverse = 1.0 / d.xy;
    vec2 a = (to_sample.xy - 0.5) * inverse, b = (to_sample.xy + 0.5) * inverse;
    vec2 near = min(a, b), far = max(a, b);
    s = min(max(to_sample.z / d.z, max(near.x, near.y)), min(far.x, far.y));
    beside = 0.0;
    bool intersects = abs(s * d.z - to_sample.z) <= LDC_TOLERANCE_CELLS;
    // A ray that begins this near to a sample's plane leaves its surface.
    bool is_own = height * height < LDC_TOLERANCE_CELLS * LDC_TOLERANCE_CELLS * dot(normal, normal);
#else
    s = height / side;
    vec2 from_middle = abs(s * d.xy - to_sample.xy);
    beside = max(from_middle.x, from_middle.y) - 0.5;
    bool intersects = true;
    float own = side > 0.0 ? LDC_OWN_BEHIND * LDC_OWN_BEHIND : LDC_OWN_BEFORE * LDC_OWN_BEFORE;
    bool is_own = s < LDC_OWN_WAY && height * height < own * dot(normal, normal);
#endif
    return intersects && !is_own;
}
