// SPDX-License-Identifier: MIT
// Between two passes, by one invocation: takes what the last one wrote, or halves it where it did not fit; then says
// what the next one takes, and whether leaves are tested before it.
#include "rayspace/layout.h"
#include "shared/bindings.h"
#include "shared/wave.h"
#define GROUP_SIZE 1
#include "common/dispatch.glsl"

layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };

uniform uint from;              // the stack that the next pass takes from
uniform uint capacity;          // pairs of a stack
uniform uint leaves_capacity;   // pairs
uniform uint leaves_wanted;     // so many are worth a dispatch
uniform uint limit_max;         // pairs of a pass
// The last places of a stack are for passes of one pair: one after another, these go down to the leaves with few.
uniform uint reserve;

uvec3 groups_of(uint count, uint each)
{
    uint groups = (count + 64u * each - 1u) / (64u * each), x = min(groups, WAVE_GROUPS_MAX);
    return uvec3(x, x > 0u ? (groups + x - 1u) / x : 1u, 1u);
}

void main()
{
    rayspace_control c = control;
    uint waiting[2] = uint[2](c.waiting_0, c.waiting_1);
    bool fits = true;
    if (c.taken > 0u) {
        fits = c.written <= c.room && c.leaves_written <= c.leaves_room;
        if (fits) {
            waiting[c.from] -= c.taken;
            waiting[1u - c.from] += c.written;
            c.leaves += c.leaves_written;
            c.limit = min(c.limit * 2u, limit_max);
        } else {
            c.halvings++;
            c.limit = max(c.taken / 2u, 1u);
        }
        c.passes++;
        c.pairs_max = max(c.pairs_max, waiting[0] + waiting[1] + c.leaves);
    }
    bool is_done = waiting[0] + waiting[1] == 0u;
    c.leaves_taken = c.leaves >= leaves_wanted || is_done || !fits ? c.leaves : 0u;
    c.leaves -= c.leaves_taken;
    c.from = from;
    c.taken = min(waiting[from], c.limit);
    c.first = waiting[from] - c.taken;
    uint free = capacity - waiting[1u - from];
    c.room = c.taken <= 1u ? free : free - min(free, reserve);
    c.leaves_room = leaves_capacity - c.leaves;
    c.written = c.leaves_written = 0u;
    c.waiting_0 = waiting[0];
    c.waiting_1 = waiting[1];
    uvec3 pass_groups = groups_of(c.taken, RAYSPACE_CHUNK), leaf_groups = groups_of(c.leaves_taken, 1u);
    c.pass_groups_x = pass_groups.x;
    c.pass_groups_y = pass_groups.y;
    c.pass_groups_z = pass_groups.z;
    c.leaf_groups_x = leaf_groups.x;
    c.leaf_groups_y = leaf_groups.y;
    c.leaf_groups_z = leaf_groups.z;
    control = c;
}
