// SPDX-License-Identifier: MIT
// Writes the point of a primitive at the centre of a texel. Lists hold only its depth and id: the material is evaluated
// once for each kept sample (sample.comp). Peeling writes the paper's two targets in each pass.
// Defines:
//   those of raster/fragment.glsl
//   BUILD_PASS 0: each texel's fragments are listed; 1: they are only counted; 2: the nearest of those behind the
//     previous layer is kept (depth peeling)
//   with BUILD_PASS 2 those of ldc/sample.glsl

#include "ldc/layout.h"
#include "shared/bindings.h"
#include "raster/fragment.glsl"
#include "raster/image.glsl"
#include "ldc/sample.glsl"

#if BUILD_PASS == 2
uniform float unit_per_cell; // a power of two, so that nothing is rounded
layout(binding = UNIT_LDC_LAYER) uniform usampler2DArray layer_before; // geometry and primitive words
layout(location = 0) out uvec4 geometry_and_primitive;
layout(location = 1) out uvec4 surface_words;
#else
layout(binding = IMAGE_LDC_COUNTS, r32ui) uniform uimageBuffer counts;
#endif
#if BUILD_PASS == 0
uniform uint texel_count;
uniform uint slots;         // fragments of a texel that have a slot
uniform uint fragments_max; // capacity for fragments without a slot
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_FRAGMENTS, rgba32ui) writeonly uniform uimageBuffer fragments;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };
#endif

#if BUILD_PASS == 0
void record(float depth_cells)
{
    uint texel = texel_number();
    uint number = imageAtomicAdd(counts, int(texel), 1u);
    if (number < slots) {
        imageStore(ordered, int(number * texel_count + texel), uvec4(floatBitsToUint(depth_cells), primitive.x, 0u, 0u));
    } else {
        uint node = atomicAdd(build.unslotted, 1u);
        if (node < fragments_max)
            imageStore(fragments, int(node), uvec4(texel, number, floatBitsToUint(depth_cells), primitive.x));
    }
}
#elif BUILD_PASS == 1
void record(float depth_cells)
{
    imageAtomicAdd(counts, int(texel_number()), 1u);
}
#else
// Nearest of several records of a fragment; there may be none.
float nearest_cells = LDC_NO_DEPTH;

void record(float depth_cells)
{
    uint before = texelFetch(layer_before, ivec3(gl_FragCoord.xy, gl_Layer), 0).x;
    if (depth_cells > uintBitsToFloat(before) && depth_cells < nearest_cells)
        nearest_cells = depth_cells;
}
#endif

void finish()
{
#if BUILD_PASS == 2
    if (nearest_cells == LDC_NO_DEPTH)
        discard;
    gl_FragDepth = nearest_cells * unit_per_cell;
    point p = make_point(primitive.y, primitive.z, primitive.w, gl_Layer, gl_FragCoord.xy, nearest_cells);
    uvec2 geometry_words;
    describe(p, geometry_words, surface_words);
    geometry_and_primitive = uvec4(geometry_words, primitive_words(p));
#endif
}

#if PRIMITIVE_KIND == 0
void main()
{
    if (is_triangle_cut_out())
        discard;
    record(triangle_depth_cells());
    finish();
}
#else
// A surface that leans more to another axis belongs to that image.
void main()
{
    sphere_chord chord = chord_of_sphere();
    if (chord.half_chord < 0.0) // the line misses the sphere
        discard;
    for (int side = 0; side < 2; side++) {
        vec3 normal;
        float depth_cells = intersection_of(chord, side, normal);
        if (is_in_image(abs(normal), gl_Layer) && !is_sphere_cut_out(chord, depth_cells))
            record(depth_in_cube(depth_cells));
    }
    finish();
}
#endif
