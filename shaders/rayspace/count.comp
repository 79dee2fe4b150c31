// SPDX-License-Identifier: MIT
// Runs after the last pass of a wave, by one invocation: adds its counts to the sums of the frame.
#define GROUP_SIZE 1
#include "common/dispatch.glsl"
#include "common/range.glsl"
#include "rayspace/control.glsl"

layout(std430, binding = BIND_RAYSPACE_COUNTS) buffer counts_block { rayspace_counts counts_of_kinds[]; };

uniform uint kind; // kind of the wave's rays

void add(inout uint low, inout uint high, uint number)
{
    uint carry;
    low = uaddCarry(low, number, carry);
    high += carry;
}

void main()
{
    uint wave_rays = ray_end;
    if (wave_rays == 0u) // the wave was queued in case there are rays
        return;
    rayspace_counts c = counts_of_kinds[kind];
    c.waves++;
    c.sorted += control.sorted;
    c.turned += control.turned;
    c.passes += control.passes;
    c.halvings += control.halvings;
    c.pairs_max = max(c.pairs_max, control.pairs_max);
    add(c.rays_low, c.rays_high, wave_rays);
    add(c.cone_tests_low, c.cone_tests_high, control.cone_tests);
    add(c.triangle_tests_low, c.triangle_tests_high, control.triangle_tests);
    counts_of_kinds[kind] = c;
}
