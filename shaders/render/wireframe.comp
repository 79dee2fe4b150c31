// SPDX-License-Identifier: MIT
// Paints the edges of triangles black where the rays of a slice first meet them, by the colour of the hit, which
// multiplies the material's. Integrators then shade them like any surface, and the samples of a pixel smooth them.
//
// On a triangle's plane each barycentric coordinate is linear, and 0 on the opposite edge; divided by its change from one
// pixel to the next it is the distance from that edge in pixels. Baerentzen, Nielsen, Gjoel, Larsen and Christensen.
// Single-pass Wireframe Rendering. 2006, with Igehy's differentials of the eye's rays (Tracing Ray Differentials. 1999,
// section 3.1) in the place of a rasteriser's derivatives.
//
// Defines: HAS_MOTION something moves: rays have a time.

#include "shared/hit.h"
#include "shared/path.h"
#include "shared/ray.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"
#include "common/math.glsl"
#include "common/motion.glsl"

layout(local_size_x = 64) in;

uniform uint ray_count;
uniform float half_width; // half width of a line, pixels

layout(binding = UNIT_RAYS) uniform samplerBuffer rays;
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;
layout(std430, binding = BIND_HITS) buffer hit_block { hit hits[]; };

// Displacement of the place on the plane if the ray is that of the next pixel along an axis of the view.
vec3 moved(vec3 axis_view, vec3 direction, vec3 normal, float pixel)
{
    vec3 aside = pixel * world_from_view_vector(axis_view);
    return aside - direction * (dot(normal, aside) / dot(normal, direction));
}

float pixels_from(vec3 corner, vec3 edge, vec3 normal, vec3 place, vec3 across, vec3 down)
{
    vec3 gradient = cross(normal, edge);
    return abs(dot(gradient, place - corner)) / length(vec2(dot(gradient, across), dot(gradient, down)));
}

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    hit h = hits[k];
    if (!(h.distance >= 0.0) || h.primitive == HIT_NO_PRIMITIVE || h.instance == HIT_NO_PRIMITIVE)
        return;
    float time = uintBitsToFloat(texelFetch(paths, int(k) * PATH_TEXELS + 1).w);
    instance i = instance_at_time(h.instance, time);
    geometry g = geometry_at(i.geometry);
    if (g.kind != GEOMETRY_MESH)
        return;
    uvec4 triangle = texelFetch(triangles, int(h.primitive));
    vec3 a = affine_point(i.world_from_object, position_at_time(triangle.x, g.close_offset, time));
    vec3 b = affine_point(i.world_from_object, position_at_time(triangle.y, g.close_offset, time));
    vec3 c = affine_point(i.world_from_object, position_at_time(triangle.z, g.close_offset, time));
    vec3 direction = texelFetch(rays, int(2u * k + 1u)).xyz, normal = cross(b - a, c - a);
    vec3 place = texelFetch(rays, int(2u * k)).xyz + h.distance * direction;
    float pixel = 2.0 * frame.extent_near.y / float(frame.view_height);
    pixel *= frame.extent_near.w != 0.0 ? 1.0 : -view_from_world_point(place).z;
    vec3 across = moved(vec3(1.0, 0.0, 0.0), direction, normal, pixel);
    vec3 down = moved(vec3(0.0, 1.0, 0.0), direction, normal, pixel);
    float nearest = min(pixels_from(b, c - b, normal, place, across, down),
                        min(pixels_from(c, a - c, normal, place, across, down),
                            pixels_from(a, b - a, normal, place, across, down)));
    if (nearest < half_width) // false for NaN
        hits[k].colour = h.colour & 0xff000000u;
}
