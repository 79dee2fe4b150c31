// SPDX-License-Identifier: MIT
// Runs between two passes, by one invocation: accepts the output of the last one, or halves the pass where it did not
// fit; then sets the size of the next one, and whether leaves are tested before it.
#define GROUP_SIZE 1
#include "common/dispatch.glsl"
#include "rayspace/control.glsl"

layout(std430, binding = BIND_RAYSPACE_STOPPED) buffer stopped_block { uint stopped[]; };

uniform uint last_from, last_to; // the stacks of the last pass
uniform uint from, to;           // stacks of the next pass
uniform uint capacity;         // pairs of a stack, and of the leaves
// Number of leaves that is worth a dispatch; 0: test all, 0xffffffff: none can be tested now.
uniform uint leaves_wanted;
uniform uint limit_max;        // pairs of a pass
// Places at the end of a stack that are kept for passes of one pair: one after another, these descend to the leaves in
// few.
uniform uint reserve;
uniform uint children; // children that must fit for each pair of a pass; 0: it takes as many pairs as there are
uniform uint seeds;        // pairs pushed onto stack `from` since
uniform uint ends;         // RAYSPACE_END_*
uniform uint stopped_word; // word of `stopped`; 0xffffffff: the slice cannot be stopped

void main()
{
    rayspace_control c = control;
    uint waiting[RAYSPACE_STACKS] = uint[RAYSPACE_STACKS](c.waiting_0, c.waiting_1);
    bool fits = true;
    if (c.taken > 0u) {
        fits = c.written <= c.room && c.leaves_written <= c.leaves_room;
        if (fits) {
            waiting[last_from] -= c.taken;
            waiting[last_to] += c.written;
            c.leaves += c.leaves_written;
            c.limit = min(c.limit * 2u, limit_max);
            c.failed_in_turn = 0u;
        } else {
            c.halvings++;
            c.failed_in_turn++;
            c.limit = max(c.taken / 2u, 1u);
        }
        c.passes++;
    }
    waiting[from] += seeds;
    uint all = waiting[0] + waiting[1];
    c.pairs_max = max(c.pairs_max, all + c.leaves);
    bool is_due = c.leaves >= leaves_wanted || all == 0u || !fits;
    c.leaves_taken = is_due && leaves_wanted != 0xffffffffu ? c.leaves : 0u;
    c.leaves -= c.leaves_taken;
    c.taken = ends != RAYSPACE_END_NOTHING ? 0u : min(waiting[from], c.limit);
    uint free = capacity - waiting[to], unreserved = free - min(free, reserve);
    if (children > 0u && c.taken > 1u)
        c.taken = clamp(unreserved / children, 1u, c.taken);
    c.room = c.taken <= 1u ? free : unreserved;
    c.first = waiting[from] - c.taken;
    c.leaves_room = capacity - c.leaves;
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
    if (ends >= RAYSPACE_END_BATCH && all + c.leaves > 0u)
        c.left_over = 1u;
    control = c;
    if (ends == RAYSPACE_END_WAVE && stopped_word != 0xffffffffu && c.left_over != 0u && stopped[stopped_word] == 0u)
        stopped[stopped_word] = WAVE_STOPPED_LONG;
}
