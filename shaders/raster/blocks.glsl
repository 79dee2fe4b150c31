// SPDX-License-Identifier: MIT
// Traversal of 4 x 4 x 4 parts: those of a grid's blocks (raster/layout.h) or of their parts.
//
// Axes along which the ray descends are mirrored (`flip` -1), so that cells ascend along all of them and the traversal
// ends, whatever the rounding. Masks of parts are not mirrored.
#include "raster/layout.h"

// Mirrors a cell of a grid with `along` cells along a side; its own inverse.
ivec3 turned(ivec3 cell, ivec3 flip, int along)
{
    return (cell ^ flip) + (flip & along);
}

// Shift of the empty space along the ray's octant in a block's third word.
int octant_shift_of(bvec3 down)
{
    return 4 * (int(down.x) + 2 * int(down.y) + 4 * int(down.z));
}

// Bit of part `b` in its half of the mask: 32 of the 64 bits.
uint part_bit(uvec3 b)
{
    return (b.x & 3u) | (b.y & 3u) << 2 | (b.z & 1u) << 4;
}

// Mask of the parts in a cube of `size` (2 or 4) parts along each side, which begins with part b and extends along the
// ray's octant.
uvec2 parts_ahead(uvec3 b, bvec3 down, uint size)
{
    uint many = (1u << size) - 1u, back = size - 1u;
    uint x = down.x ? many << b.x >> back : many << b.x & 15u;
    uint y = (size == 4u ? 0xffffu : 0xffu) << 4u * b.y;
    y = (down.y ? y >> 4u * back : y) & 0xffffu;
    uint z = down.z ? many << b.z >> back : many << b.z;
    uint slice = x * 0x1111u & y;
    return slice * uvec2((z & 1u) | (z & 2u) << 15, (z >> 2 & 1u) | (z & 8u) << 13);
}

// Number of parts along each side that the ray can skip at once; part b itself is empty or done.
int parts_to_pass(uvec2 parts, uvec3 b, bvec3 down)
{
    uvec2 all_ahead = parts & parts_ahead(b, down, 4u), near_ahead = parts & parts_ahead(b, down, 2u);
    return (all_ahead.x | all_ahead.y) == 0u ? 4 : (near_ahead.x | near_ahead.y) == 0u ? 2 : 1;
}

float nearest_exit(vec3 exits)
{
    float s = exits.x < exits.y ? exits.x : exits.y;
    return exits.z < s ? exits.z : s;
}

// Cell of the mirrored ray o + s d after it leaves the current cell at s_out; in integers along the axis of the exit, so
// that each step advances.
ivec3 cell_behind(vec3 o, vec3 d, float s_out, vec3 exits, ivec3 cell, ivec3 border)
{
    ivec3 next = clamp(ivec3(o + s_out * d), cell, border - 1);
    return mix(next, border, lessThanEqual(exits, vec3(s_out)));
}
