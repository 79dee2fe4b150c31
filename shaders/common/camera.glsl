// SPDX-License-Identifier: MIT
// Rays and projections of the frame's camera (shared/frame.h).

#include "common/slots.glsl"

// Offset of a view's eye from the camera, in view space.
vec2 eye_of_view(uvec2 view)
{
    vec2 steps = vec2(view) - frame.eyes_middle.xy;
    return steps.x * frame.eye_steps.xy + steps.y * frame.eye_steps.zw;
}

vec3 world_from_view_vector(vec3 v)
{
    return vec3(dot(frame.world_from_view[0].xyz, v), dot(frame.world_from_view[1].xyz, v),
                dot(frame.world_from_view[2].xyz, v));
}

vec3 eye_world()
{
    return vec3(frame.world_from_view[0].w, frame.world_from_view[1].w, frame.world_from_view[2].w);
}

vec3 view_from_world_point(vec3 p)
{
    vec3 d = p - eye_world();
    return d.x * vec3(frame.world_from_view[0].x, frame.world_from_view[0].y, frame.world_from_view[0].z) +
           d.y * vec3(frame.world_from_view[1].x, frame.world_from_view[1].y, frame.world_from_view[1].z) +
           d.z * vec3(frame.world_from_view[2].x, frame.world_from_view[2].y, frame.world_from_view[2].z);
}

// The ray through a point of a view, in pixels from its top left, from the centre of the lens; unit direction, t_min at
// the near plane. The directions are the camera's: the eyes of several views look in parallel.
void camera_ray_through(vec2 view_place, out vec3 origin, out vec3 direction, out float t_min)
{
    vec2 place = view_place / vec2(frame.view_width, frame.view_height) * 2.0 - 1.0;
    place *= vec2(frame.extent_near.x, -frame.extent_near.y);
    if (frame.extent_near.w != 0.0) {
        origin = eye_world() + world_from_view_vector(vec3(place, 0.0));
        direction = world_from_view_vector(vec3(0.0, 0.0, -1.0));
        t_min = frame.extent_near.z;
    } else {
        vec3 towards = vec3(place, -1.0);
        float stretch = length(towards);
        origin = eye_world();
        direction = world_from_view_vector(towards / stretch);
        t_min = frame.extent_near.z * stretch;
    }
}

// Place in its pixel of one of the current samples, if that is the same in all pixels.
vec2 sample_place(uint i)
{
    vec4 two = frame_in_block.sample_places[i >> 1];
    return (i & 1u) != 0u ? two.zw : two.xy;
}

// Clip coordinates of a point, such that a pixel's centre shows what camera_ray_through() meets through `place` in it.
// Row 0 of the target is the uppermost of the picture. Depth is reversed: 1 at the near plane; 0 infinitely far away, or,
// in an orthographic view, at the far distance.
vec4 clip_from_world_point(vec3 p, vec2 place)
{
    vec3 v = view_from_world_point(p);
    vec2 shift = (1.0 - 2.0 * place) / vec2(frame.view_width, frame.view_height);
    vec2 scaled = v.xy / vec2(frame.extent_near.x, -frame.extent_near.y);
    float near = frame.extent_near.z;
    if (frame.extent_near.w != 0.0) {
        float far = frame.far_width.x;
        return vec4(scaled + shift, (far + v.z) / (far - near), 1.0);
    }
    return vec4(scaled - shift * v.z, near, -v.z);
}

// Ray cone of a primary ray: width at the origin and growth per length. The samples of a pixel share it.
vec2 camera_cone()
{
    float step = 2.0 * frame.extent_near.y / float(frame.view_height) * frame.far_width.y;
    return frame.extent_near.w != 0.0 ? vec2(step, 0.0) : vec2(0.0, step);
}
