// SPDX-License-Identifier: MIT
// A ray among 4 x 4 x 4 parts, of a grid's blocks (raster/layout.h) or of what these are divided into.
//
// Axes along which the ray runs down are turned round (`flip` -1), so that to the traversal it runs up all of them: cells
// only go up, so whatever is rounded it ends. Masks of parts are not turned.
#include "raster/layout.h"

// Of a cell of so many along a side; both ways.
ivec3 turned(ivec3 cell, ivec3 flip, int along)
{
    return (cell ^ flip) + (flip & along);
}

// Of a block's third word.
int octant_shift_of(bvec3 down)
{
    return 4 * (int(down.x) + 2 * int(down.y) + 4 * int(down.z));
}

// Of 32, the half of the parts that part `b` is in.
uint part_bit(uvec3 b)
{
    return (b.x & 3u) | (b.y & 3u) << 2 | (b.z & 1u) << 4;
}

// Of 64 parts those that lie in a cube of so many along each side, 2 or 4, which begins with part b and reaches the way
// the ray runs.
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

// How many parts along each side can be passed at once, where part b itself is to be passed in any case.
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

// The cell that the ray o + s d, turned, is in behind its exit at s_out. In whole numbers where it passes a border, so
// that each step goes on.
ivec3 cell_behind(vec3 o, vec3 d, float s_out, vec3 exits, ivec3 cell, ivec3 border)
{
    ivec3 next = clamp(ivec3(o + s_out * d), cell, border - 1);
    return mix(next, border, lessThanEqual(exits, vec3(s_out)));
}
