// SPDX-License-Identifier: MIT
// From the root of a tree of tiles to the node of a level that a cell is in (svo/svo.h).
#include "svo/tree.glsl"

// `level`: 0 the root's. Who asks knows that it is there.
int node_of(ivec3 cell, int levels, int level)
{
    int node = 0;
    for (int shift = levels - 1; shift >= levels - level; shift--) {
        ivec3 bits = (cell >> shift) & 1;
        node = int(texelFetch(records, node).x & ~SVO_HOLDS) + (bits.x | bits.y << 1 | bits.z << 2);
    }
    return node;
}
