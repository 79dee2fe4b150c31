// SPDX-License-Identifier: MIT
// Traversal from one occupied voxel to the next: a block of 4 x 4 x 4 knows which of its voxels are occupied, or, if none
// is, the extent of the empty space round it; and a voxel knows its occupied ones of 4 x 4 x 4 subvoxels.
#include "abuffer/column.glsl"
#include "raster/blocks.glsl"

layout(binding = UNIT_TRACER_2) uniform usamplerBuffer abuffer_voxels;
layout(binding = UNIT_TRACER_5) uniform usamplerBuffer abuffer_subvoxels;

uniform vec4 abuffer_place; // lower corner, world; size of a cell
uniform int abuffer_grid;   // blocks along a side
uniform bool abuffer_has_subvoxels;

struct voxel_traversal {
    cell_ray ray;
    // In subvoxels, with axes turned as in raster/blocks.glsl.
    vec3 o, d, inverse;
    ivec3 flip; // -1: turned
    ivec3 subvoxel;
    int octant_shift;
    float s, s_end;
    float s_min, s_limit; // range in which intersections count
    float s_behind;         // beginning of that range, if the ray continues after a rejected intersection
    float beyond;           // extension of a sample's plane beyond its texel, in cells
};

// A voxel to be searched, and the part of the ray in it.
struct found_voxel {
    uint what; // ABUFFER_VOXEL_*; 0: none
    float s_in, s_out;
};

// Sets the subvoxel at w.s.
void enter(inout voxel_traversal w)
{
    w.subvoxel = clamp(ivec3(w.o + w.s * w.d), ivec3(0), ivec3((abuffer_grid << 4) - 1));
}

void begin_traversal(trace_ray r, float end, out voxel_traversal w)
{
    float along = float(abuffer_grid << 4), subvoxels_a_cell = along / float(abuffer_resolution);
    w.ray = cell_ray_of(r, abuffer_place, float(abuffer_resolution));
    // The traversal begins at the ray's origin, unless that is far away.
    float s_begin = w.ray.begin > 0.0 ? 0.0 : r.t_min * w.ray.scale;
    w.ray.o += s_begin * w.ray.d;
    w.ray.begin += s_begin;
    bvec3 down = lessThan(w.ray.d, vec3(0.0));
    w.flip = -ivec3(down);
    w.octant_shift = octant_shift_of(down);
    vec3 o = w.ray.o * subvoxels_a_cell;
    w.o = mix(o, along - o, down);
    w.d = abs(w.ray.d) * subvoxels_a_cell;
    w.inverse = 1.0 / w.d;
    w.s_min = r.t_min * w.ray.scale - w.ray.begin;
    w.s_limit = min(end * w.ray.scale, 1e30) - w.ray.begin;
    w.s_behind = w.s_min;
    w.beyond = ABUFFER_SLACK;
    w.s = w.s_min;
    w.s_end = w.s_limit;
    clip(w.s, w.s_end, w.o, w.inverse, vec3(0.0), vec3(along));
    w.s_end = w.ray.scale > 0.0 ? w.s_end : -1e30;
    enter(w);
}

int block_at(uvec3 voxel)
{
    ivec3 b = ivec3(voxel >> 2u);
    return ABUFFER_BLOCK_TEXELS * ((b.z * abuffer_grid + b.y) * abuffer_grid + b.x);
}

int subvoxels_at(uvec3 voxel)
{
    ivec3 p = ivec3(voxel);
    int along = abuffer_grid << 2;
    return abuffer_has_subvoxels ? ABUFFER_SUBVOXELS_TEXELS * ((p.z * along + p.y) * along + p.x) : 0;
}

bool is_set_in(uvec2 bits, uvec3 p)
{
    return ((p.z < 2u ? bits.x : bits.y) >> part_bit(p) & 1u) != 0u;
}

// Bits of an occupied voxel. `b`: its place in the block.
uint what_of(int block, uvec3 b)
{
    uint i = b.x | b.y << 2 | b.z << 4;
    uvec4 words = texelFetch(abuffer_voxels, block + 1 + int(i >> 5));
    uvec2 two = (i & 16u) == 0u ? words.xy : words.zw;
    return ((i & 8u) == 0u ? two.x : two.y) >> 4u * (i & 7u) & 15u;
}

// The part of a ray in one subvoxel, as stored, or in empty space.
struct voxel_step {
    uvec3 subvoxel;
    float s_in, s_out;
};

// Steps past an occupied subvoxel, or past empty space. True: the next one is occupied.
bool step_on(inout voxel_traversal w, out voxel_step step_)
{
    bvec3 down = notEqual(w.flip, ivec3(0));
    uvec3 subvoxel = uvec3(turned(w.subvoxel, w.flip, abuffer_grid << 4)), voxel = subvoxel >> 2u;
    int block = block_at(voxel);
    uvec4 words = texelFetch(abuffer_voxels, block);
    uvec3 b = voxel & 3u;
    bool is_set = is_set_in(words.xy, b);
    uvec2 inner = texelFetch(abuffer_subvoxels, subvoxels_at(voxel) + ABUFFER_SUBVOXELS_ANY).xy;
    bool is_whole = is_set && !abuffer_has_subvoxels;
    // Next one of 64 voxels, or of a voxel's 64 subvoxels.
    uvec2 bits = is_set ? inner : words.xy;
    uvec3 p = is_set ? subvoxel & 3u : b;
    int many = is_whole ? 4 : parts_to_pass(bits, p, down);
    int empty = int(words.z >> w.octant_shift & BLOCK_REACH_MAX);
    bool is_empty = (words.x | words.y) == 0u;
    int shift = is_set ? 0 : is_empty ? 4 : 2;
    ivec3 first = w.subvoxel >> shift;
    ivec3 border = is_empty ? first + (empty > 1 ? empty : 1) : min(first + many, (first | 3) + 1);
    border <<= shift;
    vec3 exits = (vec3(border) - w.o) * w.inverse;
    float s_out = nearest_exit(exits);
    s_out = s_out > w.s ? s_out : w.s;
    step_ = voxel_step(subvoxel, w.s, s_out);
    ivec3 next = cell_behind(w.o, w.d, s_out, exits, w.subvoxel, border);
    w.subvoxel = next;
    w.s = s_out;
    w.s = any(greaterThanEqual(next, ivec3(abuffer_grid << 4))) ? 1e30 : w.s;
    return is_set && is_set_in(bits, p);
}

// The images in which an occupied subvoxel is searched. They are read after the loop over empty space, which does not
// need them.
found_voxel found_in(voxel_step step_)
{
    uvec3 voxel = step_.subvoxel >> 2u, p = step_.subvoxel & 3u;
    int inside = subvoxels_at(voxel);
    uint what = what_of(block_at(voxel), voxel & 3u);
    // Where no single image shows all of a voxel, the images that show the subvoxel's surfaces best.
    uint best = 0u;
    for (int axis = 0; axis < 3; axis++)
        best |= is_set_in(texelFetch(abuffer_subvoxels, inside + axis).xy, p) ? 1u << axis : 0u;
    what &= bitCount(what & ABUFFER_VOXEL_IMAGES) > 1 ? best | ABUFFER_VOXEL_BODY : 15u;
    return found_voxel(what, step_.s_in, step_.s_out);
}

// Advances to the next occupied subvoxel, if there is one.
found_voxel next_voxel(inout voxel_traversal w)
{
    voxel_step step_ = voxel_step(uvec3(0u), 0.0, 0.0);
    bool is_found = false;
    // The condition is needed: without one, llvmpipe gave rays that had found theirs the last step of their neighbours.
    do {
        voxel_step next;
        if (step_on(w, next)) {
            step_ = next;
            is_found = true;
        }
    } while (w.s < w.s_end && !is_found);
    found_voxel found = found_in(step_);
    found.what = is_found ? found.what : 0u;
    return found;
}
