// SPDX-License-Identifier: MIT
// The frame's camera and the order of its pixels (shared/frame.h).

#include "shared/frame.h"
#include "common/math.glsl"

layout(std140, binding = UNIFORM_FRAME) uniform frame_block { frame_uniforms frame_in_block; };
#ifdef UNIFORMS_AT_START // server/gpu/uniforms.h
#define COPY(member) f.member = at_start(frame_in_block.member)
frame_uniforms frame_at_start()
{
    frame_uniforms f;
    COPY(world_from_view[0]), COPY(world_from_view[1]), COPY(world_from_view[2]);
    COPY(extent_near), COPY(far_width), COPY(eye_steps), COPY(eyes_middle), COPY(lens), COPY(environment_colour);
    COPY(irradiance[0]), COPY(irradiance[1]), COPY(irradiance[2]), COPY(irradiance[3]), COPY(irradiance[4]);
    COPY(irradiance[5]), COPY(irradiance[6]), COPY(irradiance[7]), COPY(irradiance[8]);
    COPY(width), COPY(height), COPY(tiles_across), COPY(sample_index), COPY(sample_shift), COPY(environment_kind);
    COPY(light_count), COPY(depth), COPY(seed), COPY(group_shift), COPY(view_width), COPY(view_height);
    return f;
}
frame_uniforms frame = frame_at_start(); // but for what is found by an index
#else
#define frame frame_in_block
#endif

// Pixel of a slot: x to the right, y down. May lie outside the picture at its right and lower edges.
uvec2 pixel_of_slot(uint slot)
{
    uint tile = slot >> 6, m = slot & 63u;
    uvec2 in_tile = uvec2((m & 1u) | (m >> 1 & 2u) | (m >> 2 & 4u), (m >> 1 & 1u) | (m >> 2 & 2u) | (m >> 3 & 4u));
    uint row = quotient(tile, frame.tiles_across);
    return uvec2(tile - row * frame.tiles_across, row) * 8u + in_tile;
}

uint slot_of_pixel(uvec2 pixel)
{
    uvec2 tile = pixel >> 3, p = pixel & 7u;
    uint m = (p.x & 1u) | (p.y & 1u) << 1 | (p.x & 2u) << 1 | (p.y & 2u) << 2 | (p.x & 4u) << 2 | (p.y & 4u) << 3;
    return (tile.y * frame.tiles_across + tile.x) << 6 | m;
}

// The view of the picture that a pixel belongs to: its number from the left and from above.
uvec2 view_of_pixel(uvec2 pixel)
{
    if (frame.view_width == frame.width && frame.view_height == frame.height)
        return uvec2(0u);
    return uvec2(quotient(pixel.x, frame.view_width), quotient(pixel.y, frame.view_height));
}

// A pixel within its view, which names its random numbers: they are those of a picture that shows the view alone.
uvec2 pixel_in_view(uvec2 pixel)
{
    return pixel - view_of_pixel(pixel) * uvec2(frame.view_width, frame.view_height);
}

// How far a view's eye is from the camera's, in view space.
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
// the near plane. The eye is the camera's: those of several views look in parallel to it.
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

// Where in a pixel that one of the current samples is, if it is the same in all.
vec2 sample_place(uint i)
{
    vec4 two = frame_in_block.sample_places[i >> 1];
    return (i & 1u) != 0u ? two.zw : two.xy;
}

// Shirley and Chiu. A Low Distortion Map Between Disk and Square. 1997. From [0, 1)^2 to the unit disc.
vec2 disc_from_square(vec2 u)
{
    vec2 p = 2.0 * u - 1.0;
    if (p.x == 0.0 && p.y == 0.0)
        return vec2(0.0);
    bool wide = abs(p.x) > abs(p.y);
    float radius = wide ? p.x : p.y;
    float angle = wide ? PI / 4.0 * (p.y / p.x) : PI / 2.0 - PI / 4.0 * (p.x / p.y);
    return radius * vec2(cos(angle), sin(angle));
}

// Through a thin lens, which leads all rays of one point of the picture through one point of the plane in focus (Cook,
// Porter, Carpenter. Distributed Ray Tracing. 1984). `on_lens`: where they meet it, on the unit disc.
void camera_ray_lens(vec2 view_place, vec2 on_lens, out vec3 origin, out vec3 direction, out float t_min)
{
    vec2 place = view_place / vec2(frame.view_width, frame.view_height) * 2.0 - 1.0;
    place *= vec2(frame.extent_near.x, -frame.extent_near.y);
    float focus = frame.lens.y;
    bool orthographic = frame.extent_near.w != 0.0;
    vec3 on_view = vec3(frame.lens.x * on_lens + (orthographic ? place : vec2(0.0)), 0.0);
    // towards the point in focus, as far as distance 1 along the view
    vec3 towards = vec3((orthographic ? vec2(0.0) : place) - frame.lens.x * on_lens / focus, -1.0);
    float stretch = length(towards);
    origin = eye_world() + world_from_view_vector(on_view);
    direction = world_from_view_vector(towards / stretch);
    t_min = frame.extent_near.z * stretch;
}

float filter_place(int i)
{
    return frame_in_block.filter_places[i >> 2][i & 3];
}

// The offset of a sample from its pixel's centre, in pixels: server/render/pixel_filter.h.
float filter_offset(float number)
{
    float side = 2.0 * number - 1.0, at = sqrt(1.0 - abs(side)) * 64.0;
    int i = min(int(at), 63);
    float place = mix(filter_place(i), filter_place(i + 1), at - float(i));
    return side < 0.0 ? -place : place;
}

// Clip coordinates of a point so that a pixel's centre shows what camera_ray_through() sees through that place in it.
// Row 0 of the target is the picture's uppermost. Depth is reversed: 1 at the near plane; 0 infinitely far away, or, in
// an orthographic view, at the far distance.
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

// Ray cone of a primary ray: width at the origin and growth per length. Many samples share a pixel.
vec2 camera_cone()
{
    float step = 2.0 * frame.extent_near.y / float(frame.view_height) * frame.far_width.y;
    return frame.extent_near.w != 0.0 ? vec2(step, 0.0) : vec2(0.0, step);
}
