// SPDX-License-Identifier: MIT
// Sorts the rays of a wave by cells of origin and direction, whose bits are interleaved (a Morton code in five
// dimensions). Within a cell the order is random: no answer depends on it.
//
// Defines: SORT_COUNT counts the rays of each bin; SORT_SCAN finds the beginning of each, in one group; SORT_PLACE puts
// rays at their places.
#ifdef SORT_SCAN
#define GROUP_SIZE 256
#endif
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "common/unit.glsl"
#include "rayspace/control.glsl"
#include "rayspace/ray.glsl"

layout(std430, binding = BIND_RAYSPACE_BINS) buffer bin_block { uint bins[]; };
layout(std430, binding = BIND_RAYSPACE_ORDER) writeonly buffer order_block { uint order_written[]; };

uniform vec3 lower_world, cells_per_metre;
uniform uint bin_shift; // low bits that bins ignore: few rays have few bins

#ifdef SORT_SCAN

shared uint sums[GROUP_SIZE];

void main()
{
    uint own = gl_LocalInvocationIndex, sum = 0u, each = (RAYSPACE_BINS >> bin_shift) / GROUP_SIZE;
    if (control.sorted == 0u)
        return;
    for (uint i = 0u; i < each; i++)
        sum += bins[own * each + i];
    sums[own] = sum;
    barrier();
    uint before = 0u;
    for (uint k = 0u; k < own; k++)
        before += sums[k];
    for (uint i = 0u; i < each; i++) {
        uint count = bins[own * each + i];
        bins[own * each + i] = before;
        before += count;
    }
}

#else

// Spreads the lower bits of a value, with four free places behind each.
uint spread(uint value)
{
    uint spread_ = 0u;
    for (uint i = 0u; i < RAYSPACE_DIRECTION_BITS; i++)
        spread_ |= (value >> i & 1u) << (5u * i);
    return spread_;
}

// Bin of a ray. The highest bits are the origin's alone, then bits of v, u, z, y, x take turns.
uint bin_of(live_ray r)
{
    uvec3 p = uvec3(clamp((r.origin - lower_world) * cells_per_metre, 0.0, float((1u << RAYSPACE_POSITION_BITS) - 1u)));
    vec2 uv = octahedral_from_unit(r.direction);
    uvec2 q = uvec2(clamp((uv * 0.5 + 0.5) * float(1u << RAYSPACE_DIRECTION_BITS), 0.0,
                          float((1u << RAYSPACE_DIRECTION_BITS) - 1u)));
    uint low = spread(p.x) | spread(p.y) << 1 | spread(p.z) << 2 | spread(q.x) << 3 | spread(q.y) << 4;
    uvec3 high = p >> RAYSPACE_DIRECTION_BITS;
    return low | (high.x | high.y << 1 | high.z << 2) << (5u * RAYSPACE_DIRECTION_BITS);
}

void main()
{
    uint ray = item_index();
    if (ray >= ray_count)
        return;
    // Rays behind the wave's end, which only the device knows, are dead and stay at the end.
    uint bin = (RAYSPACE_BINS >> bin_shift) - 1u;
    if (ray < ray_end) {
        live_ray r = live_ray_at(ray);
        if (r.end >= 0.0)
            bin = bin_of(r) >> bin_shift;
    }
#ifdef SORT_COUNT
    atomicAdd(bins[bin], 1u);
#else
    order_written[atomicAdd(bins[bin], 1u)] = ray;
#endif
}

#endif
