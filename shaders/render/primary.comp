// SPDX-License-Identifier: MIT
// Rays and paths of a slice's pixels; the slice's pixels are set to black.
// VISIBILITY defined: what the rasteriser saw is noted in the hits, for primary_fill.comp; else they are left to a
// tracer.

#include "shared/path.h"
#include "shared/ray.h"
#include "shared/hit.h"
#include "common/camera.glsl"
#include "common/dispatch.glsl"
layout(local_size_x = 64) in;

uniform uint first_slot, slot_count;

layout(std430, binding = BIND_RAYS) writeonly buffer ray_block { ray rays[]; };
layout(std430, binding = BIND_PATHS) writeonly buffer path_block { path paths[]; };
layout(std430, binding = BIND_SLICE_PIXELS) writeonly buffer pixel_block { vec4 slice_pixels[]; };
#ifdef VISIBILITY
layout(std430, binding = BIND_HITS) writeonly buffer hit_block { hit hits[]; };
layout(binding = UNIT_PASS_0) uniform usampler2D visible_primitives;
#endif

void main()
{
    uint k = item_index();
    if (k >= slot_count)
        return;
    uvec2 pixel = pixel_of_slot(first_slot + k);
    bool in_picture = pixel.x < frame.width && pixel.y < frame.height;
    vec3 origin, direction;
    float t_min;
    camera_ray(pixel, origin, direction, t_min);
    vec2 cone = camera_cone();
    float weight = in_picture ? 1.0 : 0.0;
    // Dead beyond the picture's edge.
    rays[k] = ray(vec4(origin, t_min), vec4(direction, in_picture ? 1e30 : -1.0));
    paths[k] = path(weight, weight, weight, k, cone.x, cone.y, PATH_STRAIGHT, 0.0);
    slice_pixels[k] = vec4(0.0);
#ifdef VISIBILITY
    uvec2 visible = in_picture ? texelFetch(visible_primitives, ivec2(pixel), 0).xy : uvec2(0u);
    hits[k].distance = visible.x != VISIBLE_NOTHING ? 0.0 : -1.0;
    hits[k].instance = visible.x == VISIBLE_DISC ? HIT_NO_PRIMITIVE : visible.x - 1u;
    hits[k].primitive = visible.y;
#endif
}
