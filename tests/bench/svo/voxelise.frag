// SPDX-License-Identifier: MIT
// Cells that a primitive is in, noted in a list: the one under the middle of the texel, along the axis that the surface
// leans to most. Such cells of a plane let no path from cell to neighbouring cell through. With planes all cells that
// it is in under the texel, as a ray asks each for itself: up to three.
// Defines: those of raster/fragment.glsl; SVO_PLANES; SVO_TILES

#include "shared/bindings.h"
#include "common/unit.glsl"
#include "raster/fragment.glsl"
#include "raster/image.glsl"
#include "svo/svo.h"

uniform uint fragments_max;

#if defined SVO_PLANES || defined SVO_TILES
layout(binding = IMAGE_SVO_FRAGMENTS, rgba32ui) writeonly uniform uimageBuffer fragments;
#else
layout(binding = IMAGE_SVO_FRAGMENTS, rg32ui) writeonly uniform uimageBuffer fragments;
#endif
layout(std430, binding = BIND_SVO_COUNTS) buffer counts_block { svo_counts counts; };

void record(vec3 place_cells, int depth, vec3 normal)
{
    uint number = atomicAdd(counts.fragments, 1u);
    if (number >= fragments_max)
        return;
    ivec3 cell = ivec3(place_cells);
    cell[gl_Layer] = depth;
    cell = clamp(cell, ivec3(0), ivec3(int(texels_along) - 1));
    uvec4 words = uvec4(cell.x | cell.y << 10 | cell.z << 20, primitive.x, 0u, 0u);
#if defined SVO_PLANES || defined SVO_TILES
    words.z = pack_unit(normal);
    words.w = floatBitsToUint(dot(normal, place_cells - (vec3(cell) + 0.5)));
#endif
    imageStore(fragments, int(number), words);
}

// `first`, `last`: where the surface begins and ends under the texel.
void record_all(float depth_cells, float first, float last, vec3 normal)
{
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    vec3 place;
    place[u] = gl_FragCoord.x;
    place[v] = gl_FragCoord.y;
    place[axis] = depth_cells;
#ifdef SVO_PLANES
    int end = int(floor(last));
    for (int depth = int(floor(first)); depth <= end; depth++)
        record(place, depth, normal);
#else
    record(place, int(floor(depth_cells)), normal);
#endif
}

#if PRIMITIVE_KIND == 0
void main()
{
    if (is_triangle_cut_out())
        discard;
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    float depth = triangle_depth_cells(), reach = 0.5 * (abs(plane.x) + abs(plane.y));
    vec3 normal;
    normal[u] = -plane.x;
    normal[v] = -plane.y;
    normal[axis] = 1.0;
    record_all(depth, max(depth - reach, depths.y), min(depth + reach, depths.z),
               normalize(gl_FrontFacing ? normal : -normal));
}
#else
void main()
{
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    sphere_chord chord = chord_of_sphere();
    if (!(chord.half_chord >= 0.0)) // passes it
        discard;
    for (int side = 0; side < 2; side++) {
        vec3 normal;
        float depth = intersection_of(chord, side, normal);
        normal = normalize(normal);
        vec3 lean = abs(normal);
        float reach = 0.5 * (lean[u] + lean[v]) / lean[axis];
        if (is_in_image(lean, axis) && !is_sphere_cut_out(chord, depth))
            record_all(depth, depth - reach, depth + reach, normal);
    }
}
#endif
