// SPDX-License-Identifier: MIT
// Writes the primitive that a pixel sees: its instance + 1 and its scene-wide number. PRIMITIVE_KIND as in view.vert;
// HAS_CUTOUT: it may have holes. In layers a surface counts once at each depth, for the first one drawn:
//   HAS_LAYERS   the surface behind the previous layer, if there is one (depth peeling)
//   K_BUFFER     the first 2 or 3 surfaces, in one pass, without a depth test. Bavoil, Callahan, Lefohn, Comba, Silva.
//                Multi-Fragment Effects on the GPU using the k-Buffer. 2007.

#include "shared/path.h"
#include "common/camera.glsl"
#include "common/primary_hit.glsl"

uniform uint instance_index;
uniform uint first_primitive;
uniform uint first_row; // first row of the strip in the picture
uniform uint layer;     // index of the current sample that is drawn

#ifdef K_BUFFER
#ifdef GL_EXT_shader_framebuffer_fetch
#define KEPT inout
#else
#define KEPT out // lets the rest of the program be checked without the extension
#endif
layout(location = 0) KEPT uvec2 visible;
layout(location = 1) KEPT uvec2 visible_second;
#if K_BUFFER == 2
layout(location = 2) KEPT vec2 depths;
#else
layout(location = 2) KEPT uvec2 visible_third;
layout(location = 3) KEPT vec4 depths;
#endif
#else
layout(location = 0) out uvec2 visible;
#endif

#ifdef HAS_LAYERS
// A single program draws every layer, so that a surface compares equal to itself in the next one.
layout(binding = UNIT_TRACER_2) uniform sampler2D depths_before;
uniform uint has_before;
#endif

// Whether the surface may be visible there. Depth is reversed.
bool is_wanted(float depth)
{
#ifdef K_BUFFER
    return depth > depths[K_BUFFER - 1];
#elif defined(HAS_LAYERS)
    return has_before == 0u || depth < texelFetch(depths_before, ivec2(gl_FragCoord.xy), 0).x;
#else
    return true;
#endif
}

void see(float depth, uvec2 what)
{
#ifdef K_BUFFER
    if (!is_wanted(depth))
        return;
    depth = min(depth, 1.0); // a depth buffer clamps too
    bool is_first = depth > depths.x, is_second = depth > depths.y;
    if (depth == depths.x || depth == depths.y)
        return;
#if K_BUFFER == 2
    depths = vec2(is_first ? depth : depths.x, is_first ? depths.x : depth);
#else
    visible_third = is_second ? visible_second : what;
    depths.xyz = vec3(is_first ? depth : depths.x, is_first ? depths.x : is_second ? depth : depths.y,
                      is_second ? depths.y : depth);
#endif
    visible_second = is_first ? visible : is_second ? what : visible_second;
    visible = is_first ? what : visible;
#else
    visible = what;
#endif
}

#if PRIMITIVE_KIND == 1
// Depth by the formula of clip_from_world_point().
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
#if defined(HAS_LAYERS) || defined(K_BUFFER)
    if (!is_wanted(gl_FragCoord.z))
        discard;
#endif
#ifdef HAS_CUTOUT
    if (is_cut_out(candidate_triangle(instance_index, primitive, origin, direction, 0.0), origin, direction,
                   0.0))
        discard;
#endif
    see(gl_FragCoord.z, uvec2(instance_index + 1u, primitive));
#elif PRIMITIVE_KIND == 1
    uint primitive = first_primitive + uint(gl_PrimitiveID) / 12u;
    uvec2 what = uvec2(instance_index + 1u, primitive);
    candidate found = candidate_sphere(instance_index, primitive, origin, direction, t_min);
    float depth = depth_of(found.distance, direction);
#ifdef K_BUFFER
    if (found.distance < 0.0 || !is_wanted(depth))
        discard;
    see(depth, what);
    // The far side is a surface of its own.
    found = candidate_sphere(instance_index, primitive, origin, direction, found.distance);
    if (found.distance >= 0.0)
        see(depth_of(found.distance, direction), what);
#else
#ifdef HAS_LAYERS
    if (found.distance >= 0.0 && !is_wanted(depth)) { // the far side of the sphere is a surface of its own
        found = candidate_sphere(instance_index, primitive, origin, direction, found.distance);
        depth = depth_of(found.distance, direction);
    }
#endif
    if (found.distance < 0.0 || !is_wanted(depth))
        discard;
    gl_FragDepth = depth;
    visible = what;
#endif
#else
    uint primitive = first_primitive + uint(gl_PrimitiveID) / 2u;
#if defined(HAS_LAYERS) || defined(K_BUFFER)
    if (!is_wanted(gl_FragCoord.z))
        discard;
#endif
    candidate found = candidate_disc(primitive, origin, direction);
    vec3 from_centre = origin + found.distance * direction - disc_at(primitive).centre_radius.xyz;
    float radius = disc_at(primitive).centre_radius.w;
    if (dot(from_centre, from_centre) > radius * radius || is_cut_out(found, origin, direction, 0.0))
        discard;
    see(gl_FragCoord.z, uvec2(VISIBLE_DISC, primitive));
#endif
}
