// SPDX-License-Identifier: MIT
// Sends a triangle to the image whose axis its normal leans to most, and to others where images overlap, with its plane
// in cells; a sphere goes to all three, as its bounding square. Burger, Hertel, Kruger, Westermann. GPU Rendering of
// Secondary Effects. 2007, figure 5.
// Defines:
//   PRIMITIVE_KIND  0 triangles, 1 spheres
//   HAS_CUTOUT      triangles may have holes
//   ALL_IMAGES      a triangle is in all three images, wherever it has an area, with FACE_* bits; it faces the front
//                   (gl_FrontFacing) where its outside does, towards greater depths
//   WITHOUT_STEEP   with ALL_IMAGES: a triangle is only in the images that show it well (raster/face.glsl)

#include "shared/bindings.h"
#include "shared/geometry.h"
#include "raster/cube.glsl"
#include "raster/face.glsl"
#include "raster/image.glsl"
#include "common/affine.glsl"
#include "common/math.glsl"

uniform float resolution; // cells along a side of the cube

// Declared here and not by common/geometry.glsl, whose storage blocks a geometry shader need not support.
layout(binding = UNIT_INSTANCES) uniform usamplerBuffer instances;
#if PRIMITIVE_KIND == 0
layout(binding = UNIT_TRIANGLES) uniform usamplerBuffer triangles;
layout(binding = UNIT_POSITIONS) uniform samplerBuffer positions;
#else
layout(binding = UNIT_SPHERES) uniform samplerBuffer spheres;
#endif

layout(points) in;
#if PRIMITIVE_KIND == 0
layout(triangle_strip, max_vertices = 9) out;
#else
layout(triangle_strip, max_vertices = 12) out;
#endif

layout(location = 0) flat in uvec4 primitive_in[];

// Invariant, as a pass counts with one program the fragments that another draws: both must cover the same texels at the
// same depths.
invariant gl_Position;
#if PRIMITIVE_KIND == 0
layout(location = 0) flat invariant out vec4 plane;  // slopes of the depth along u and v; u, v of a point of it
layout(location = 1) flat invariant out vec3 depths; // depth of that point; minimum, maximum
#ifdef HAS_CUTOUT
layout(location = 3) invariant out vec2 barycentrics;
#endif
#endif
layout(location = 2) flat out uvec4 primitive;

void fetch_world_from_object(out vec4 rows[3])
{
    int first_row = int(primitive_in[0].y) * INSTANCE_TEXELS;
    for (int row = 0; row < 3; row++)
        rows[row] = uintBitsToFloat(texelFetch(instances, first_row + row));
}

vec3 place_in_cells(vec4 world_from_object[3], vec3 object)
{
    return (affine_point(world_from_object, object) - lower_world) / cell_world;
}

// Geometry on the sides of the cube stays in it despite rounding.
float clip_depth(float depth_cells)
{
    return 0.0005 + 0.999 * depth_cells / resolution;
}

void emit(vec2 uv_cells, float depth_cells, int axis)
{
    gl_Position = vec4(2.0 * uv_cells / resolution - 1.0, clip_depth(depth_cells), 1.0);
    gl_Layer = axis;
    EmitVertex();
}

#if PRIMITIVE_KIND == 0
// Margin in texels: more than a rasteriser's rounding of corners.
const float SNAP_CELLS = 1.0 / 32.0;

float cross_2d(vec2 a, vec2 b)
{
    return a.x * b.y - a.y * b.x;
}

// Whether a triangle may cover the centre of a texel. Most small ones cover none, and a rasteriser takes ten times as
// long to find out.
bool may_cover(vec2 a, vec2 b, vec2 c)
{
    vec2 lower = ceil(min(a, min(b, c)) - (0.5 + SNAP_CELLS)), upper = floor(max(a, max(b, c)) - (0.5 - SNAP_CELLS));
    if (lower.x > upper.x || lower.y > upper.y)
        return false;
    if (lower != upper)
        return true;
    vec2 middle = lower + 0.5, ab = b - a, bc = c - b, ca = a - c;
    float side = cross_2d(ab, bc) < 0.0 ? -1.0 : 1.0;
    return side * cross_2d(ab, middle - a) >= -SNAP_CELLS * (abs(ab.x) + abs(ab.y)) &&
           side * cross_2d(bc, middle - b) >= -SNAP_CELLS * (abs(bc.x) + abs(bc.y)) &&
           side * cross_2d(ca, middle - c) >= -SNAP_CELLS * (abs(ca.x) + abs(ca.y));
}

// Maximum slope: a plane beyond it passes more cells in a texel than the cube has.
const float SLOPE_MAX = 65536.0;

// Slopes of the depth along u and v.
vec2 slopes_of(vec3 normal, int axis, int u, int v)
{
#ifdef ALL_IMAGES
    vec2 slopes = -vec2(normal[u], normal[v]) / normal[axis];
    return normal[axis] != 0.0 ? clamp(slopes, vec2(-SLOPE_MAX), vec2(SLOPE_MAX)) : vec2(0.0);
#else
    return vec2(-normal[u] / normal[axis], -normal[v] / normal[axis]);
#endif
}

#ifdef ALL_IMAGES
// FACE_* bits of a triangle. The normal may have any length; a needle's may be zero: it counts as steep everywhere.
uint face_of_triangle(vec3 normal)
{
    float maximum = max_component(abs(normal));
    uint closed = (primitive_in[0].w & DRAWN_CLOSED) != 0u ? FACE_CLOSED : 0u;
    return maximum > 0.0 ? face_of(normalize(normal / maximum)) | closed : FACE_NEEDLE | closed;
}
#endif

void main()
{
    vec4 rows[3];
    fetch_world_from_object(rows);
    uvec4 triangle = texelFetch(triangles, int(primitive_in[0].z));
    int second = 1;
#ifdef ALL_IMAGES
    if ((primitive_in[0].w & DRAWN_MIRRORED) != 0u) { // the outside is to the left of its edges
        triangle.yz = triangle.zy;
        second = 2;
    }
#endif
    vec3 corners[3];
    for (int i = 0; i < 3; i++)
        corners[i] = place_in_cells(rows, texelFetch(positions, int(triangle[i])).xyz);
    vec3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
    vec3 lean = abs(normal), lower = min(corners[0], min(corners[1], corners[2])),
         upper = max(corners[0], max(corners[1], corners[2]));
#ifdef ALL_IMAGES
    // A triangle whose area rounds to zero may have one in the rasteriser, and a body needs its whole surface.
    uint face = face_of_triangle(normal);
    int dominant = axis_of(lean);
#else
    if (!(max_component(lean) > 0.0)) // no area
        return;
#endif
    for (int axis = 0; axis < 3; axis++) {
        int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
#ifndef ALL_IMAGES
        if (!is_in_image(lean, axis))
            continue;
#elif defined WITHOUT_STEEP
        if (!is_shown(face, axis))
            continue;
#endif
        if (!may_cover(vec2(corners[0][u], corners[0][v]), vec2(corners[1][u], corners[1][v]),
                       vec2(corners[2][u], corners[2][v])))
            continue;
        vec4 plane_ = vec4(slopes_of(normal, axis, u, v), corners[0][u], corners[0][v]);
        vec3 depths_ = vec3(corners[0][axis], lower[axis], upper[axis]);
        for (int i = 0; i < 3; i++) {
            plane = plane_;
            depths = depths_;
            primitive = primitive_in[0];
#ifdef ALL_IMAGES
            primitive.w = face | (axis == dominant ? FACE_DOMINANT : 0u);
#endif
#ifdef HAS_CUTOUT
            barycentrics = vec2(i == second ? 1.0 : 0.0, i == 3 - second ? 1.0 : 0.0);
#endif
            emit(vec2(corners[i][u], corners[i][v]), corners[i][axis], axis);
        }
        EndPrimitive();
    }
}
#else
// Margin of a sphere's square, so that rounding does not cut the rim. Its depth may be anywhere in the cube.
const float SQUARE_MARGIN = 1.0001;

void main()
{
    vec4 rows[3];
    fetch_world_from_object(rows);
    vec4 sphere = texelFetch(spheres, int(primitive_in[0].z));
    vec3 centre = place_in_cells(rows, sphere.xyz);
    vec3 reaches = sphere.w / cell_world * vec3(length(rows[0].xyz), length(rows[1].xyz), length(rows[2].xyz));
    for (int axis = 0; axis < 3; axis++) {
        int u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
        vec2 middle = vec2(centre[u], centre[v]), reach = vec2(reaches[u], reaches[v]) * SQUARE_MARGIN;
        for (int corner = 0; corner < 4; corner++) {
            primitive = primitive_in[0];
            emit(middle + reach * vec2(float(corner & 1) * 2.0 - 1.0, float(corner >> 1) * 2.0 - 1.0),
                 0.5 * resolution, axis);
        }
        EndPrimitive();
    }
}
#endif
