// SPDX-License-Identifier: MIT
// Which primitive a pixel sees: its instance + 1 and its scene-wide number. PRIMITIVE_KIND as in view.vert;
// HAS_CUTOUT: it may have holes; HAS_LAYERS: what lies behind the layer before, if there is one.

#include "shared/path.h"
#include "common/camera.glsl"
#include "common/primary_hit.glsl"

uniform uint instance_index;
uniform uint first_primitive;
uniform uint first_row; // of the strip that is drawn, in the picture
uniform uint layer;     // the sample that is drawn, of the current ones

layout(location = 0) out uvec2 visible;

#ifdef HAS_LAYERS
// One program draws all layers, so that a surface compares equal to itself in the next one.
layout(binding = UNIT_TRACER_2) uniform sampler2D depths_before;
uniform uint has_before;
#endif

// Whether the layer before does not show it, nor anything behind it. Depth is reversed.
bool is_behind(float depth)
{
#ifdef HAS_LAYERS
    return has_before == 0u || depth < texelFetch(depths_before, ivec2(gl_FragCoord.xy), 0).x;
#else
    return true;
#endif
}

#if PRIMITIVE_KIND == 1
// As clip_from_world_point() computes it.
float depth_of(float distance_, vec3 direction)
{
    vec3 axis = world_from_view_vector(vec3(0.0, 0.0, -1.0));
    float along = distance_ * dot(direction, axis), near = frame.extent_near.z;
    if (frame.extent_near.w != 0.0)
        return (frame.far_width.x - along) / (frame.far_width.x - near);
    return near / along;
}
#endif

void main()
{
    vec3 origin, direction;
    float t_min;
    camera_ray_through(vec2(uvec2(gl_FragCoord.xy) + uvec2(0u, first_row)) + sample_place(layer), origin, direction, t_min);
#if PRIMITIVE_KIND == 0
    uint primitive = first_primitive + uint(gl_PrimitiveID);
#ifdef HAS_LAYERS
    if (!is_behind(gl_FragCoord.z))
        discard;
#endif
#ifdef HAS_CUTOUT
    if (is_cut_out(candidate_triangle(instance_index, primitive, origin, direction, 0.0), origin, direction,
                   0.0))
        discard;
#endif
    visible = uvec2(instance_index + 1u, primitive);
#elif PRIMITIVE_KIND == 1
    uint primitive = first_primitive + uint(gl_PrimitiveID) / 12u;
    candidate found = candidate_sphere(instance_index, primitive, origin, direction, t_min);
    float depth = depth_of(found.distance, direction);
#ifdef HAS_LAYERS
    if (found.distance >= 0.0 && !is_behind(depth)) { // the sphere's far side is a surface of its own
        found = candidate_sphere(instance_index, primitive, origin, direction, found.distance);
        depth = depth_of(found.distance, direction);
    }
#endif
    if (found.distance < 0.0 || !is_behind(depth))
        discard;
    gl_FragDepth = depth;
    visible = uvec2(instance_index + 1u, primitive);
#else
    uint primitive = first_primitive + uint(gl_PrimitiveID) / 2u;
#ifdef HAS_LAYERS
    if (!is_behind(gl_FragCoord.z))
        discard;
#endif
    candidate found = candidate_disc(primitive, origin, direction);
    vec3 from_centre = origin + found.distance * direction - disc_at(primitive).centre_radius.xyz;
    float radius = disc_at(primitive).centre_radius.w;
    if (dot(from_centre, from_centre) > radius * radius || is_cut_out(found, origin, direction, 0.0))
        discard;
    visible = uvec2(VISIBLE_DISC, primitive);
#endif
}
