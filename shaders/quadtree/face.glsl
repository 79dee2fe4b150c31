// SPDX-License-Identifier: MIT
// Rays in the space of a face (quadtree/layout.h), where they are segments.
#include "quadtree/node.glsl"
#include "common/candidate.glsl"

// Part of a ray that lies in a face. A point u of it, from 0 to 1, is at from + u * along.
struct face_segment {
    vec3 from, along;  // x, y, w
    float t_from, t_to; // distances along the ray at both ends
    float q_from, q_to; // 1 / Z at both ends; for an orthographic face 1
};

vec3 face_vector(uint face, vec3 v)
{
    uint row = FACE(face) * 3u;
    return vec3(dot(quadtree.face_from_world[row].xyz, v), dot(quadtree.face_from_world[row + 1u].xyz, v),
                dot(quadtree.face_from_world[row + 2u].xyz, v));
}

bool is_orthographic()
{
    return quadtree.depths.z != 0.0;
}

// Converts a point along right, down and forward from the eye to x, y, w.
vec3 face_place(vec3 p, float q)
{
    float w = is_orthographic() ? (quadtree.depths.y - p.z) / (quadtree.depths.y - quadtree.depths.x)
                                : quadtree.depths.x * q;
    return vec3(quadtree.scale_centre.zw + quadtree.scale_centre.xy * p.xy * q, w);
}

float face_q(vec3 p)
{
    return is_orthographic() ? 1.0 : 1.0 / p.z;
}

// Clips [t.x, t.y] to the range where a + t * b is not below 0.
void clip_range(float a, float b, inout vec2 t)
{
    float at = -a / b;
    if (b > 0.0)
        t.x = max(t.x, at);
    else if (b < 0.0)
        t.y = min(t.y, at);
    else if (a < 0.0)
        t = vec2(1.0, 0.0);
}

// Range of distances within [t.x, t.y] in which a ray is in a face; empty: it is not.
vec2 clip_to_face(vec3 origin, vec3 direction, vec2 t)
{
    float z_of_sides = is_orthographic() ? 0.0 : 1.0;
    vec2 origin_z = vec2(is_orthographic() ? 1.0 : origin.z), direction_z = vec2(z_of_sides * direction.z);
    vec2 scale = quadtree.scale_centre.xy, centre = quadtree.scale_centre.zw;
    vec2 far_side = vec2(quadtree.width, quadtree.height) - centre;
    vec2 low_a = scale * origin.xy + centre * origin_z, low_b = scale * direction.xy + centre * direction_z;
    vec2 high_a = far_side * origin_z - scale * origin.xy, high_b = far_side * direction_z - scale * direction.xy;
    clip_range(origin.z - quadtree.depths.w, direction.z, t);
    clip_range(low_a.x, low_b.x, t);
    clip_range(low_a.y, low_b.y, t);
    clip_range(high_a.x, high_b.x, t);
    clip_range(high_a.y, high_b.y, t);
    return t;
}

face_segment segment_of(vec3 origin, vec3 direction, vec2 t)
{
    vec3 p_from = origin + t.x * direction, p_to = origin + t.y * direction;
    face_segment s;
    s.t_from = t.x;
    s.t_to = t.y;
    s.q_from = face_q(p_from);
    s.q_to = face_q(p_to);
    s.from = face_place(p_from, s.q_from);
    s.along = face_place(p_to, s.q_to) - s.from;
    return s;
}

float distance_at(face_segment s, float u)
{
    float from = s.q_from * (1.0 - u), to = s.q_to * u;
    return (s.t_from * from + s.t_to * to) / (from + to);
}

// Place at a distance that is not before the segment.
float place_at(face_segment s, float t)
{
    if (t >= s.t_to)
        return 1.0;
    float from = s.q_from * (t - s.t_from), to = s.q_to * (s.t_to - t);
    return max(from / (from + to), 0.0);
}
