// SPDX-License-Identifier: MIT
// Where a primitive lies under the middle of a texel: only its depth and its id are noted, of what it is made is found
// out once for each sample that stays (sample.comp).
// Defines:
//   PRIMITIVE_KIND  as in build.geom
//   HAS_CUTOUT      triangles or spheres may have holes
//   HAS_SPHERES     with PRIMITIVE_KIND 1
//   BUILD_PASS      0: each texel's fragments are noted; 1: they are counted only; 2: of those behind the layer
//                   before, the nearest is kept (depth peeling)

#include "shared/ldc.h"
#include "shared/ldc_build.h"
#include "shared/bindings.h"
#include "ldc/image.glsl"
#include "common/alpha.glsl"

uniform uint texels_along; // a side of the images
uniform float cell_world;
uniform vec3 lower_world;

#if PRIMITIVE_KIND == 0
layout(location = 0) flat in vec4 plane;
layout(location = 1) flat in vec3 depths;
#ifdef HAS_CUTOUT
layout(location = 3) in vec2 barycentrics;
#endif
#endif
layout(location = 2) flat in uvec3 primitive;

#if BUILD_PASS == 2
uniform float unit_per_cell; // a power of two, so that nothing is rounded
layout(binding = UNIT_LDC_LAYER) uniform usampler2DArray layer_before; // depth, id
layout(location = 0) out uvec2 visible;
#else
layout(binding = IMAGE_LDC_COUNTS, r32ui) uniform uimageBuffer counts;
#endif
#if BUILD_PASS == 0
uniform uint texel_count;
uniform uint slots;         // fragments of a texel that have a slot
uniform uint fragments_max; // that there is room for without
layout(binding = IMAGE_LDC_ORDERED, rg32ui) writeonly uniform uimageBuffer ordered;
layout(binding = IMAGE_LDC_FRAGMENTS, rgba32ui) writeonly uniform uimageBuffer fragments;
layout(std430, binding = BIND_LDC_BUILD_COUNTS) buffer build_block { ldc_build_counts build; };
#endif

uint texel_number()
{
    return (uint(gl_Layer) * texels_along + uint(gl_FragCoord.y)) * texels_along + uint(gl_FragCoord.x);
}

// Depths of what lies on the sides of the cube may be rounded out of it.
float depth_in_cube(float depth_cells)
{
    return min(max(depth_cells, 0.0), float(texels_along));
}

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
// Of several records of one fragment the nearest counts; none may be there.
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
    visible = uvec2(floatBitsToUint(nearest_cells), primitive.x);
#endif
}

#if PRIMITIVE_KIND == 0
void main()
{
#ifdef HAS_CUTOUT
    candidate found = candidate(0.0, primitive.z, primitive.y, barycentrics);
    if (is_cut_out(found, vec3(0.0), vec3(0.0), 0.0))
        discard;
#endif
    precise float along_u = (gl_FragCoord.x - plane.z) * plane.x;
    precise float along_v = (gl_FragCoord.y - plane.w) * plane.y;
    precise float depth_cells = depths.x + along_u + along_v;
    // Not behind nor before the triangle, where it is thin and its plane uncertain; and on the cube.
    depth_cells = min(max(depth_cells, depths.y), depths.z);
    record(depth_in_cube(depth_cells));
    finish();
}
#else
// Along the axis through the texel's middle; what leans more to another axis is in that one's image.
void main()
{
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    vec3 origin = vec3(0.0), direction = vec3(0.0);
    origin[u] = gl_FragCoord.x * cell_world;
    origin[v] = gl_FragCoord.y * cell_world;
    origin += lower_world;
    direction[axis] = cell_world; // depths are in cells
    vec4 rows[3] = instance_at(primitive.y).object_from_world;
    vec4 sphere = texelFetch(spheres, int(primitive.z));
    precise vec3 from_centre = affine_point(rows, origin) - sphere.xyz;
    precise vec3 step_object = affine_vector(rows, direction);
    precise float squared = dot(step_object, step_object);
    precise float nearest = -dot(from_centre, step_object) / squared;
    precise vec3 closest = from_centre + nearest * step_object;
    precise float half_chord = sqrt((sphere.w * sphere.w - dot(closest, closest)) / squared);
    if (!(half_chord >= 0.0)) // passes it
        discard;
    for (int side = 0; side < 2; side++) {
        precise float reach = side == 0 ? -half_chord : half_chord;
        precise float depth_cells = nearest + reach;
        vec3 lean = abs(affine_covector(rows, closest + reach * step_object));
        bool there = is_in_image(lean, axis);
#ifdef HAS_CUTOUT
        candidate found = candidate(depth_cells, primitive.z, primitive.y, vec2(0.0));
        there = there && !is_cut_out(found, origin, direction, 0.0);
#endif
        if (there)
            record(depth_in_cube(depth_cells));
    }
    finish();
}
#endif
