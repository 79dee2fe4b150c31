// SPDX-License-Identifier: MIT
// Makes the rays and paths of a slice's samples, those of one pixel side by side; sets the slice's sums to black.
// Defines:
//   VISIBILITY  the rasterised primitives are noted in the hits, for primary_fill.comp; otherwise a tracer finds them
//   SPREAD      each pixel places its samples by its own random numbers; otherwise all use frame.sample_places
//   HAS_LENS    rays start on a lens and meet in the plane of focus
//   HAS_TILES   rays through texels of a key view that no eye reads are dead (render/tiles.glsl)
//   HAS_TILE_SAMPLES tiles may have stopped: their rays are dead (server/render/picture/noise.h)
//   HAS_TIMES   something moves: rays have a time

#include "shared/path.h"
#include "shared/ray.h"
#include "shared/hit.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"
#include "common/sample_place.glsl"
#include "render/path_texels.glsl"
#include "render/tiles.glsl"
layout(local_size_x = 64) in;

uniform uint first_slot, slot_count;
#ifdef HAS_TILES
layout(binding = UNIT_KEY_MARKS) uniform usamplerBuffer key_marks;
uniform uint first_mark; // first mark of the layer
#endif

#ifdef HAS_TILE_SAMPLES
layout(binding = UNIT_TILE_SAMPLES) uniform usamplerBuffer tile_samples;
#endif

layout(std430, binding = BIND_RAYS) writeonly buffer ray_block { ray rays[]; };
layout(std430, binding = BIND_PATHS) writeonly buffer path_block { uvec4 paths[]; }; // PATH_TEXELS each
layout(std430, binding = BIND_SLICE_SUMS) writeonly buffer sum_block { vec4 slice_sums[]; };
#ifdef HAS_TIMES
layout(std430, binding = BIND_RAY_TIMES) writeonly buffer time_block { float times[]; };
#endif
#ifdef VISIBILITY
layout(std430, binding = BIND_HITS) writeonly buffer hit_block { uvec4 hits[]; }; // HIT_TEXELS each
// Primitives, with a layer for each of the current samples. They are an image, as llvmpipe compiles later programs for
// the state of a sampler, too.
layout(binding = IMAGE_VISIBLE, rg32ui) readonly uniform uimage2DArray visible_primitives;
uniform uint first_row; // row of the picture that is their first
#endif

#ifdef HAS_LENS
// Maps [0, 1)^2 to the unit disc. Shirley and Chiu. A Low Distortion Map Between Disk and Square. 1997.
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

// Ray through a thin lens, which leads all rays of one point of the picture through one point of the plane of focus
// (Cook, Porter, Carpenter. Distributed Ray Tracing. 1984). `on_lens`: their place on it, on the unit disc.
void camera_ray_lens(vec2 view_place, vec2 on_lens, out vec3 origin, out vec3 direction, out float t_min)
{
    vec2 place = view_place / vec2(frame.view_width, frame.view_height) * 2.0 - 1.0;
    place *= vec2(frame.extent_near.x, -frame.extent_near.y);
    float focus = frame.lens.y;
    bool orthographic = frame.extent_near.w != 0.0;
    vec3 on_view = vec3(frame.lens.x * on_lens + (orthographic ? place : vec2(0.0)), 0.0);
    // Direction to the point in focus, up to distance 1 along the view.
    vec3 towards = vec3((orthographic ? vec2(0.0) : place) - frame.lens.x * on_lens / focus, -1.0);
    float stretch = length(towards);
    origin = eye_world() + world_from_view_vector(on_view);
    direction = world_from_view_vector(towards / stretch);
    t_min = frame.extent_near.z * stretch;
}
#endif

void main()
{
    uint k = item_index();
    if (k >= slot_count << frame.sample_shift)
        return;
    uvec2 pixel = pixel_of_picture_slot(first_slot + (k >> frame.sample_shift));
    bool in_picture = pixel.x < frame.width && pixel.y < frame.height;
    uvec2 in_view = pixel_in_view(pixel);
    uvec2 seed = sequence_seed(in_view, frame.seed);
    uint sample_ = k & (1u << frame.sample_shift) - 1u, index = frame.sample_index + sample_;
#ifdef SPREAD
    vec2 place = place_of_sample(in_view, sample_);
#else
    vec2 place = vec2(in_view) + sample_place(sample_);
#endif
    vec3 origin, direction;
    float t_min, time = 0.0;
#ifdef HAS_LENS
    camera_ray_lens(place, disc_from_square(sequence_pair(seed, SEQUENCE_LENS, index)), origin, direction, t_min);
#else
    camera_ray_through(place, origin, direction, t_min);
#endif
    origin += world_from_view_vector(vec3(eye_of_view(view_of_pixel(pixel)), 0.0));
#ifdef HAS_TIMES
    time = sequence_number(seed, SEQUENCE_TIME, index);
    times[k] = time;
#endif
#ifdef HAS_TILES
    if (in_picture)
        in_picture = texelFetch(key_marks, int(first_mark + pixel.y * frame.width + pixel.x)).x != 0u;
#endif
#ifdef HAS_TILE_SAMPLES
    in_picture = in_picture && texelFetch(tile_samples, int(first_slot + (k >> frame.sample_shift) >> 6)).x == 0u;
#endif
    vec2 cone = camera_cone();
    float weight = in_picture ? 1.0 : 0.0;
    // Rays are dead beyond the picture's edge, and where a tile has stopped.
    rays[k] = ray(vec4(origin, t_min), vec4(direction, in_picture ? 1e30 : -1.0));
    path_texels texels =
        texels_of_path(path(weight, weight, weight, k, cone.x, cone.y, PATH_STRAIGHT, time, 0u, 0.0, 0.0, 1.0));
    paths[uint(PATH_TEXELS) * k] = texels.a;
    paths[uint(PATH_TEXELS) * k + 1u] = texels.b;
    paths[uint(PATH_TEXELS) * k + 2u] = texels.c;
    slice_sums[k] = vec4(0.0);
#ifdef VISIBILITY
    uvec2 visible = uvec2(VISIBLE_NOTHING, 0u);
    if (in_picture)
        visible = imageLoad(visible_primitives, ivec3(pixel - uvec2(0u, first_row), sample_)).xy;
    // layers.comp reads the flags of the material, even for misses.
    hits[HIT_TEXELS * k] = uvec4(floatBitsToUint(visible.x != VISIBLE_NOTHING ? 0.0 : -1.0), 0u, visible.y,
                                 visible.x == VISIBLE_DISC ? HIT_NO_PRIMITIVE : visible.x - 1u);
#endif
}
