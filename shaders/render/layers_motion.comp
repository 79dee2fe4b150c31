// SPDX-License-Identifier: MIT
// Writes the layer `motion`: the displacement of the point that the first sample of a pixel shows, a frame later and a
// frame earlier, in pixels to the right and up. A point keeps its place in its object, or in its triangle where that
// deforms; the background keeps its direction. 0 for all other samples, and for points behind the camera then.
//
// Defines: HAS_MOTION objects move while the shutter is open (common/motion.glsl); their places as it opens count.

#include "shared/hit.h"
#include "shared/layers.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"
#include "common/motion.glsl"
#include "render/path_texels.glsl"

uniform uint ray_count;
uniform uint first_slot;       // first slot of the slice
uniform uint first_sum;        // first sum of the layer
uniform uint has_moves;        // 0: only the camera moves
uniform uint is_orthographic;
uniform vec4 world_from_views[9]; // rows: the camera a frame earlier, now, a frame later
uniform vec4 pixels_a_metre;      // at distance 1, or in a parallel view; for the same times

layout(binding = UNIT_RAYS) uniform samplerBuffer rays;
layout(binding = UNIT_SHADE_HITS) uniform usamplerBuffer hits;
layout(binding = UNIT_SHADE_PATHS) uniform usamplerBuffer paths;
layout(std430, binding = BIND_LAYER_SUMS) writeonly buffer layer_block { vec4 layer_sums[]; };
layout(std430, binding = BIND_MOVES) readonly buffer move_block { move moves[]; };
layout(std430, binding = BIND_MOVED_VERTICES) readonly buffer vertex_block { float moved_vertices[]; };

#define EARLIER 0u
#define NOW 1u
#define LATER 2u
struct places { // in the world, by time; w 0: a direction
    vec4 at[3];
};

// Weights of a triangle's corners in the nearest point of its plane.
vec3 weights_of(vec3 point, vec3 corners[3])
{
    vec3 a = corners[1] - corners[0], b = corners[2] - corners[0], p = point - corners[0];
    float aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), pa = dot(p, a), pb = dot(p, b);
    float area = aa * bb - ab * ab;
    vec2 others = area > 0.0 ? vec2(bb * pa - ab * pb, aa * pb - ab * pa) / area : vec2(0.0);
    return vec3(1.0 - others.x - others.y, others);
}

vec3 moved_vertex(uint number)
{
    return vec3(moved_vertices[3u * number], moved_vertices[3u * number + 1u], moved_vertices[3u * number + 2u]);
}

// Corners of a triangle in object space, by time.
void deform(move m, geometry g, uint primitive, float time, inout vec3 points[3])
{
    uvec3 vertices = texelFetch(triangles, int(primitive)).xyz;
    vec3 corners[3];
    for (int k = 0; k < 3; k++)
        corners[k] = position_at_time(vertices[k], g.close_offset, time);
    vec3 weights = weights_of(points[NOW], corners);
    points = vec3[3](vec3(0.0), vec3(0.0), vec3(0.0));
    for (int k = 0; k < 3; k++) {
        uint number = m.first_vertex - 1u + vertices[k] - g.first_vertex;
        points[EARLIER] += weights[k] * moved_vertex(number);
        points[NOW] += weights[k] * position_at_time(vertices[k], g.close_offset, 0.0);
        points[LATER] += weights[k] * moved_vertex(number + g.vertex_count);
    }
}

places places_of(uvec4 h, vec3 place, float time)
{
    places p;
    p.at[EARLIER] = p.at[NOW] = p.at[LATER] = vec4(place, 1.0);
    if (has_moves == 0u || h.w == HIT_NO_PRIMITIVE)
        return p;
    move m = moves[h.w];
    instance opens = instance_at(h.w);
    vec3 points[3];
    points[EARLIER] = points[NOW] = points[LATER] = affine_point(instance_at_time(h.w, time).object_from_world, place);
    if (m.first_vertex != 0u)
        deform(m, geometry_at(opens.geometry), h.z, time, points);
    p.at[EARLIER].xyz = affine_point(m.earlier, points[EARLIER]);
    p.at[NOW].xyz = affine_point(opens.world_from_object, points[NOW]);
    p.at[LATER].xyz = affine_point(m.later, points[LATER]);
    return p;
}

// Place in pixels from the middle of that eye's view. False: it is not in front of the camera.
bool in_picture(vec4 place, uint time, vec2 eye, out vec2 at)
{
    vec4 rows[3] = vec4[3](world_from_views[3u * time], world_from_views[3u * time + 1u], world_from_views[3u * time + 2u]);
    vec3 d = place.xyz - place.w * vec3(rows[0].w, rows[1].w, rows[2].w);
    vec3 v = d.x * rows[0].xyz + d.y * rows[1].xyz + d.z * rows[2].xyz;
    float along = is_orthographic != 0u ? place.w : -v.z;
    at = (v.xy - place.w * eye) * (pixels_a_metre[time] / along);
    return along > 0.0 && !any(isinf(at)) && !any(isnan(at));
}

vec4 motion_of(places p, vec2 eye)
{
    vec2 earlier, now, later;
    bool was_there = in_picture(p.at[EARLIER], EARLIER, eye, earlier);
    bool is_there = in_picture(p.at[NOW], NOW, eye, now);
    bool will_be_there = in_picture(p.at[LATER], LATER, eye, later);
    return vec4(is_there && will_be_there ? later - now : vec2(0.0), is_there && was_there ? earlier - now : vec2(0.0));
}

void main()
{
    uint k = item_index();
    if (k >= ray_count)
        return;
    int texel = int(k) * PATH_TEXELS;
    path p = path_of_texels(texelFetch(paths, texel), texelFetch(paths, texel + 1), texelFetch(paths, texel + 2));
    vec4 motion = vec4(0.0);
    if (frame.sample_index + (p.sample_slot & (1u << frame.sample_shift) - 1u) == 0u) {
        vec3 origin = texelFetch(rays, int(2u * k)).xyz, direction = texelFetch(rays, int(2u * k + 1u)).xyz;
        uvec4 h = texelFetch(hits, int(3u * k));
        float distance_ = uintBitsToFloat(h.x);
        places seen;
        if (distance_ >= 0.0)
            seen = places_of(h, origin + distance_ * direction, p.time);
        else
            seen.at[EARLIER] = seen.at[NOW] = seen.at[LATER] = vec4(direction, 0.0);
        motion = motion_of(seen, eye_of_view(view_of_pixel(pixel_of_slot(first_slot + (p.sample_slot >> frame.sample_shift)))));
    }
    layer_sums[first_sum + k] = motion;
}
