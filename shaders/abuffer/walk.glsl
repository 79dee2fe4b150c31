// SPDX-License-Identifier: MIT
// The walk through the voxels, from one that holds something to the next: a block of 4 x 4 x 4 tells which of its own do,
// and how far it is empty around it where none does.
#include "abuffer/column.glsl"

layout(binding = UNIT_TRACER_2) uniform usamplerBuffer abuffer_voxels;

uniform vec4 abuffer_place; // lower corner, world; size of a cell
uniform int abuffer_grid;   // blocks along a side

struct voxel_walk {
    cell_ray ray;
    // Axes along which the ray runs down are turned round, so that to the walk it runs up all of them. In voxels.
    vec3 o, d, inverse;
    ivec3 flip; // -1: turned
    ivec3 voxel;
    int octant_shift;
    float s, s_end;
    float s_least, s_limit; // between which a crossing counts
};

// A voxel to be searched, and where the ray is in it.
struct found_voxel {
    uint what; // ABUFFER_VOXEL_*; 0: there is none
    float s_in, s_out;
};

void begin_walk(trace_ray r, float end, out voxel_walk w)
{
    float along = float(abuffer_grid << 2), voxels_a_cell = along / float(abuffer_resolution);
    w.ray = cell_ray_of(r, abuffer_place, float(abuffer_resolution));
    // Its origin is where it begins, unless that is far away.
    float s_begin = w.ray.begin > 0.0 ? 0.0 : r.t_min * w.ray.scale;
    w.ray.o += s_begin * w.ray.d;
    w.ray.begin += s_begin;
    bvec3 down = lessThan(w.ray.d, vec3(0.0));
    w.flip = -ivec3(down);
    w.octant_shift = 4 * (int(down.x) + 2 * int(down.y) + 4 * int(down.z));
    vec3 o = w.ray.o * voxels_a_cell;
    w.o = mix(o, along - o, down);
    w.d = abs(w.ray.d) * voxels_a_cell;
    w.inverse = 1.0 / w.d;
    w.s_least = r.t_min * w.ray.scale - w.ray.begin;
    w.s_limit = min(end * w.ray.scale, 1e30) - w.ray.begin;
    w.s = w.s_least;
    w.s_end = w.s_limit;
    clip(w.s, w.s_end, w.o, w.inverse, vec3(0.0), vec3(along));
    w.s_end = w.ray.scale > 0.0 ? w.s_end : -1e30;
    w.voxel = clamp(ivec3(w.o + w.s * w.d), ivec3(0), ivec3(int(along) - 1));
}

// Not turned.
uvec3 voxel_of(voxel_walk w, ivec3 voxel)
{
    return uvec3((voxel ^ w.flip) + (w.flip & (abuffer_grid << 2)));
}

int block_at(uvec3 voxel)
{
    ivec3 b = ivec3(voxel >> 2u);
    return ABUFFER_BLOCK_TEXELS * ((b.z * abuffer_grid + b.y) * abuffer_grid + b.x);
}

// What is known of one that holds something. `b`: its place in the block.
uint what_of(int block, uvec3 b)
{
    uint i = b.x | b.y << 2 | b.z << 4;
    uvec4 words = texelFetch(abuffer_voxels, block + 1 + int(i >> 5));
    uvec2 two = (i & 16u) == 0u ? words.xy : words.zw;
    return ((i & 8u) == 0u ? two.x : two.y) >> 4u * (i & 7u) & 15u;
}

// Of the 64 voxels of a block those that lie in a cube of so many along each side, 2 or 4, which begins with voxel b and
// reaches the way the ray runs.
uvec2 voxels_ahead(uvec3 b, bvec3 down, uint size)
{
    uint many = (1u << size) - 1u, back = size - 1u;
    uint x = down.x ? many << b.x >> back : many << b.x & 15u;
    uint y = (size == 4u ? 0xffffu : 0xffu) << 4u * b.y;
    y = (down.y ? y >> 4u * back : y) & 0xffffu;
    uint z = down.z ? many << b.z >> back : many << b.z;
    uint slice = x * 0x1111u & y;
    return slice * uvec2((z & 1u) | (z & 2u) << 15, (z >> 2 & 1u) | (z & 8u) << 13);
}

// Past a voxel that holds something, which is `found`, or as far as nothing does.
void step_on(inout voxel_walk w, inout found_voxel found)
{
    ABUFFER_COUNT(x);
    bvec3 down = notEqual(w.flip, ivec3(0));
    uvec3 voxel = voxel_of(w, w.voxel), b = voxel & 3u;
    int block = block_at(voxel);
    uvec4 words = texelFetch(abuffer_voxels, block);
    uint bit = b.x | b.y << 2 | (b.z & 1u) << 4; // of 32
    bool is_set = ((b.z < 2u ? words.x : words.y) >> bit & 1u) != 0u;
    uvec2 all_voxels = words.xy & voxels_ahead(b, down, 4u), near_voxels = words.xy & voxels_ahead(b, down, 2u);
    int empty = int(words.z >> w.octant_shift & 15u);
    bool is_empty = (words.x | words.y) == 0u;
    int many = (all_voxels.x | all_voxels.y) == 0u ? 4 : (near_voxels.x | near_voxels.y) == 0u ? 2 : 1;
    ivec3 first = w.voxel >> 2;
    ivec3 block_end = (first + (is_empty && empty > 1 ? empty : 1)) << 2;
    ivec3 border = is_empty ? block_end : min(w.voxel + many, block_end);
    vec3 exits = (vec3(border) - w.o) * w.inverse;
    float s_out = exits.x < exits.y ? exits.x : exits.y;
    s_out = exits.z < s_out ? exits.z : s_out;
    s_out = s_out > w.s ? s_out : w.s;
    if (is_set)
        found = found_voxel(what_of(block, b), w.s, s_out);
    ivec3 next = clamp(ivec3(w.o + s_out * w.d), w.voxel, border - 1);
    // In whole numbers, so that each step goes on.
    next = mix(next, border, lessThanEqual(exits, vec3(s_out)));
    w.voxel = next;
    w.s = s_out;
    // Voxels only go up, so whatever is rounded the walk ends.
    w.s = any(greaterThanEqual(next, ivec3(abuffer_grid << 2))) ? 1e30 : w.s;
}

// To the next voxel that holds something, if one does.
found_voxel next_voxel(inout voxel_walk w)
{
    found_voxel found = found_voxel(0u, 0.0, 0.0);
    do {
        step_on(w, found);
    } while (w.s < w.s_end && found.what == 0u);
    return found;
}
