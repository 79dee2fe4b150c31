// SPDX-License-Identifier: MIT
// Links each fragment into its texel's list, and adds it to the voxels that it touches. Hu, Huang, Zhang, Yuan, Li. Ray
// Tracing via GPU Rasterization. 2014, section 3.1.
// Defines: those of raster/fragment.glsl; ALL_IMAGES (always set) and WITHOUT_STEEP of raster/draw.geom.

#include "abuffer/layout.h"
#include "shared/bindings.h"
#include "raster/face.glsl"
#include "raster/fragment.glsl"

uniform uint nodes_max;         // capacity
uniform uint voxels_along;      // voxels along a side of the grid
uniform float voxels_per_cell;
uniform bool has_subvoxels;

layout(binding = IMAGE_ABUFFER_HEADS, r32ui) uniform uimageBuffer heads;
layout(binding = IMAGE_ABUFFER_NODES, rgba32ui) writeonly uniform uimageBuffer nodes;
layout(binding = IMAGE_ABUFFER_SUMS, r32i) uniform iimageBuffer sums;
layout(binding = IMAGE_ABUFFER_SUBVOXELS, r32ui) uniform uimageBuffer subvoxels;
layout(std430, binding = BIND_ABUFFER_BUILD_COUNTS) buffer build_block { abuffer_build_counts build; };

uint texel_in_tiles()
{
    uvec2 place = uvec2(gl_FragCoord.xy);
    return ABUFFER_TEXEL(ABUFFER_TILES_ALONG(texels_along), uint(gl_Layer), place.x, place.y);
}

// Links the fragment into its texel's list. False: the list is full; the fragment is only counted, and the pass will be
// repeated.
bool link(float depth_cells, uint bits)
{
    uint node = atomicAdd(build.nodes, 1u);
    if (node >= nodes_max) {
        if (node == 0xffffffffu)
            atomicAdd(build.wraps, 1u);
        return false;
    }
    uint before = imageAtomicExchange(heads, int(texel_in_tiles()), node + 1u);
    uvec4 words = uvec4(before, floatBitsToUint(depth_cells), bits, primitive.x);
    imageStore(nodes, int(node), words);
    return true;
}

// Margins by which rounding loses no part of a patch, while a patch that ends at a voxel's side does not touch the next
// voxel. Sides of voxels and subvoxels that do not coincide with those of texels are at least 1 / 512 of a cell away from
// them.
const float DEPTH_MARGIN_CELLS = 1.0 / 64.0;
const float HALF_TEXEL = 0.5 - 1.0 / 1024.0;

// Permutes depth, u and v to x, y and z.
ivec3 turned(ivec3 duv)
{
    return gl_Layer == 0 ? duv : gl_Layer == 1 ? duv.zxy : duv.yzx;
}

// The subvoxels from `first` to `last` that are in one half of a voxel, as bits of a word; `half_`: the number of the
// half in the grid, where halves are stacked along z.
uint subvoxels_between(ivec3 first, ivec3 last, ivec3 half_)
{
    ivec3 lower = half_ * ivec3(4, 4, 2);
    uvec3 from = uvec3(max(first - lower, ivec3(0))), to = uvec3(min(last - lower, ivec3(3, 3, 1)));
    uint x = (2u << to.x) - (1u << from.x), y = (16u << 4u * to.y) - (1u << 4u * from.y);
    return (x * 0x1111u & y) * (from.z == to.z ? 1u << 16u * from.z : 0x10001u);
}

// Marks the patch of a surface behind a texel, between two depths: usually in one or two halves of a voxel. A load is
// cheaper than an atomic, and the bits are usually set already. `looks_along`: dominant axis of the normal.
void mark(float min_cells, float max_cells, int bits, int looks_along)
{
    float subvoxels_per_cell = 4.0 * voxels_per_cell;
    int along = int(voxels_along);
    ivec3 first = ivec3(vec3(min_cells - DEPTH_MARGIN_CELLS, gl_FragCoord.xy - HALF_TEXEL) * subvoxels_per_cell);
    ivec3 last = ivec3(vec3(max_cells + DEPTH_MARGIN_CELLS, gl_FragCoord.xy + HALF_TEXEL) * subvoxels_per_cell);
    first = turned(clamp(first, ivec3(0), ivec3(4 * along - 1)));
    last = turned(clamp(last, ivec3(0), ivec3(4 * along - 1)));
    ivec3 half_first = first >> ivec3(2, 2, 1), half_last = last >> ivec3(2, 2, 1), half_ = half_first;
    do {
        int voxel = ((half_.z >> 1) * along + half_.y) * along + half_.x;
        uint inner = has_subvoxels ? subvoxels_between(first, last, half_) : 0u;
        if ((imageLoad(sums, 4 * voxel + 3).x & bits) != bits)
            imageAtomicOr(sums, 4 * voxel + 3, bits);
        int word = has_subvoxels ? 2 * (ABUFFER_SUBVOXELS_TEXELS * voxel + looks_along) + (half_.z & 1) : 0;
        if ((imageLoad(subvoxels, word).x & inner) != inner)
            imageAtomicOr(subvoxels, word, inner);
        half_.x++;
        half_.yx = half_.x > half_last.x ? ivec2(half_.y + 1, half_first.x) : half_.yx;
        half_.zy = half_.y > half_last.y ? ivec2(half_.z + 1, half_first.y) : half_.zy;
    } while (half_.z <= half_last.z);
}

#ifndef WITHOUT_STEEP
// Stride between voxels along depth, u and v, in texels of the sums.
ivec3 strides()
{
    int along = int(voxels_along), square_ = along * along;
    ivec3 s = gl_Layer == 0 ? ivec3(1, along, square_) : gl_Layer == 1 ? ivec3(along, square_, 1) : ivec3(square_, 1, along);
    return 4 * s;
}

// Adds a unit normal's components along depth, u and v, to the voxel of the texel's centre at this depth.
void add_normal(float depth_cells, vec3 normal_duv)
{
    ivec3 voxel = ivec3(vec3(depth_cells, gl_FragCoord.xy) * voxels_per_cell), step_ = strides();
    voxel = clamp(voxel, ivec3(0), ivec3(int(voxels_along) - 1));
    ivec3 units = ivec3(round(normal_duv * float(ABUFFER_NORMAL_UNIT)));
    int at = voxel.x * step_.x + voxel.y * step_.y + voxel.z * step_.z;
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    if (units.x != 0)
        imageAtomicAdd(sums, at + axis, units.x);
    if (units.y != 0)
        imageAtomicAdd(sums, at + u, units.y);
    if (units.z != 0)
        imageAtomicAdd(sums, at + v, units.z);
}
#endif

// Bits for surfaces that lean to this image's axis, which no other image samples better. `leaves`: the outside faces
// greater depths.
int sum_bits(uint face, bool closed, bool leaves)
{
    uint looks = (leaves ? ABUFFER_SUM_UP : ABUFFER_SUM_DOWN) << gl_Layer;
    return int(face >> 24 & 63u | looks | (closed ? 0u : ABUFFER_SUM_OPEN));
}

#if PRIMITIVE_KIND == 0
int axis_of_plane()
{
    vec2 slope = abs(plane.xy);
    int on = slope.x <= 1.0 && slope.y <= 1.0 ? 0 : slope.x >= slope.y ? 1 : 2, axis = gl_Layer + on;
    return axis < 3 ? axis : axis - 3;
}

void main()
{
    if (is_triangle_cut_out())
        discard;
    uint face = primitive.w;
    float depth_cells = triangle_depth_cells();
    // The rasteriser's own facing is consistent with its coverage: a closed surface has as many entering as leaving
    // fragments in a texel.
    bool leaves = gl_FrontFacing;
    if (!link(depth_cells, face & (FACE_NORMAL_MASK | FACE_CLOSED) | (leaves ? ABUFFER_NODE_LEAVES : 0u)))
        return;
    // Range of the plane's depth in the texel; for a steep one at most the triangle's extent.
    float reach = 0.5 * (abs(plane.x) + abs(plane.y)), min_cells = depth_cells - reach, max_cells = depth_cells + reach;
    if ((face & FACE_STEEP << gl_Layer) != 0u) {
        min_cells = max(min_cells, depths.y);
        max_cells = min(max_cells, depths.z);
    }
    if ((face & FACE_LEANS << gl_Layer) != 0u)
        mark(min_cells, max_cells, sum_bits(face, (face & FACE_CLOSED) != 0u, leaves), axis_of_plane());
#ifndef WITHOUT_STEEP
    if ((face & FACE_DOMINANT) != 0u) {
        vec3 normal = vec3(1.0, -plane.xy) * inversesqrt(1.0 + dot(plane.xy, plane.xy));
        add_normal(depth_cells, leaves ? normal : -normal);
    }
#endif
}
#else
// Range of a sphere's surface in the texel's square, from its intersection with the line through the texel's centre. On
// the outer side the tangent plane and the square's point nearest to the sphere's centre bound it; on the inner side the
// rim does, if that is in the square.
void reach_of(sphere_chord c, vec3 normal, int side, float depth_cells, out float min_cells,
              out float max_cells)
{
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    vec3 half_u = 0.5 * cell_world * vec3(c.rows[0][u], c.rows[1][u], c.rows[2][u]);
    vec3 half_v = 0.5 * cell_world * vec3(c.rows[0][v], c.rows[1][v], c.rows[2][v]);
    float nearer = 2.0 * length(c.closest) * (length(half_u) + length(half_v)) / dot(c.step_object, c.step_object);
    float tangent = 0.5 * (abs(normal[u]) + abs(normal[v])) / max(abs(normal[axis]), 1e-6 * max_component(abs(normal)));
    float outwards = min(tangent, sqrt(nearer)), inwards = min(c.half_chord, 2.0 * tangent + 0.75);
    min_cells = depth_cells - (side == 0 ? outwards : inwards);
    max_cells = depth_cells + (side == 0 ? inwards : outwards);
}

void main()
{
    sphere_chord chord = chord_of_sphere();
    if (chord.half_chord < 0.0) // the line misses the sphere
        discard;
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    bool closed = (primitive.w & DRAWN_CLOSED) != 0u;
    for (int side = 0; side < 2; side++) {
        vec3 normal;
        float depth_cells = intersection_of(chord, side, normal), min_cells, max_cells;
        if (is_sphere_cut_out(chord, depth_cells))
            continue;
        reach_of(chord, normal, side, depth_cells, min_cells, max_cells);
        depth_cells = depth_in_cube(depth_cells);
        normal = normalize(normal / max_component(abs(normal)));
        uint face = face_of(normal);
#ifdef WITHOUT_STEEP
        if (!is_shown(face, axis))
            continue;
#endif
        if (!link(depth_cells, face & FACE_NORMAL_MASK | (closed ? ABUFFER_NODE_CLOSED : 0u) |
                                   (side == 1 ? ABUFFER_NODE_LEAVES : 0u)))
            continue;
        if ((face & FACE_LEANS << axis) != 0u)
            mark(min_cells, max_cells, sum_bits(face, closed, side == 1), axis_of(abs(normal)));
#ifndef WITHOUT_STEEP
        if (axis_of(abs(normal)) == axis)
            add_normal(depth_cells, vec3(normal[axis], normal[u], normal[v]));
#endif
    }
}
#endif
