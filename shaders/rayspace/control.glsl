// SPDX-License-Identifier: MIT
// Control of a wave's passes, which all of them share.
#include "rayspace/layout.h"
#include "shared/bindings.h"
#include "shared/wave.h"

layout(std430, binding = BIND_RAYSPACE_CONTROL) buffer control_block { rayspace_control control; };

uint waiting_on(uint stack)
{
    return stack == 0u ? control.waiting_0 : control.waiting_1;
}

// Work groups of a dispatch with an invocation for `each` items, counted as in common/dispatch.glsl.
uvec3 groups_of(uint count, uint each)
{
    uint groups = (count + 64u * each - 1u) / (64u * each), x = min(groups, WAVE_GROUPS_MAX);
    return uvec3(x, x > 0u ? (groups + x - 1u) / x : 1u, 1u);
}
