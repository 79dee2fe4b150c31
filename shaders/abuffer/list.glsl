// SPDX-License-Identifier: MIT
// Reads the list of a texel's nodes.
#include "abuffer/layout.h"
#include "shared/bindings.h"

layout(binding = UNIT_ABUFFER_HEADS) uniform usamplerBuffer heads;
layout(binding = UNIT_ABUFFER_NODES) uniform usamplerBuffer nodes;

const uint ABUFFER_NO_DEPTH = 0xffffffffu; // behind everything

uint head_of(uint texel)
{
    return texelFetch(heads, int(texel)).x;
}

uint next_of(uint node)
{
    return texelFetch(nodes, int(node) - 1).x;
}

// Returns depth, id and bits of the node and advances to the next one; ABUFFER_NO_DEPTH at the end of the list.
uvec3 take(inout uint node)
{
    if (node == 0u)
        return uvec3(ABUFFER_NO_DEPTH);
    uvec4 words = texelFetch(nodes, int(node) - 1);
    node = words.x;
    return words.ywz;
}
