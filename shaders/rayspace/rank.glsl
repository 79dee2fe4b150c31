// SPDX-License-Identifier: MIT
// Ranks of primitives among those of all instances.
#include "rayspace/layout.h"
#include "shared/bindings.h"

layout(binding = UNIT_RAYSPACE_RANKS) uniform usamplerBuffer ranks;

uniform uint instance_count;

uint first_rank_of(uint instance_index)
{
    return texelFetch(ranks, int(instance_index)).x;
}

// Last instance whose first rank is not above `rank`; those without primitives come before it.
uint instance_of_rank(uint rank)
{
    uint low = 0u, high = instance_count;
    while (low + 1u < high) {
        uint middle = (low + high) / 2u;
        if (first_rank_of(middle) <= rank)
            low = middle;
        else
            high = middle;
    }
    return low;
}
