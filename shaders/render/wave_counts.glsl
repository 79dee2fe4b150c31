// SPDX-License-Identifier: MIT
// Counts of a wave's lists, for the passes that make these.
#include "shared/path.h"
#include "shared/wave.h"

layout(std430, binding = BIND_WAVE) buffer state_block { wave_state state; };

wave_counts counts_of(uint count)
{
    uint groups = (count + 63u) / 64u, x = min(groups, WAVE_GROUPS_MAX);
    return wave_counts(count, x, x > 0u ? (groups + x - 1u) / x : 1u, 1u);
}

wave_counts blocks_of(uint count)
{
    return counts_of((count + COMPACT_BLOCK - 1u) / COMPACT_BLOCK);
}
