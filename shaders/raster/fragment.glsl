// SPDX-License-Identifier: MIT
// Point of a primitive at the centre of a texel in the images along the axes, from the outputs of raster/draw.geom. It is
// `precise`, as one program counts the fragments that another draws.
// Defines: PRIMITIVE_KIND 0 triangles, 1 spheres; HAS_CUTOUT: they may have holes; HAS_SPHERES with PRIMITIVE_KIND 1.
#include "shared/bindings.h"
#include "common/alpha.glsl"
#include "raster/cube.glsl"

uniform uint texels_along; // a side of the images

#if PRIMITIVE_KIND == 0
layout(location = 0) flat in vec4 plane;  // slopes of the depth along u and v; u, v of a point of it
layout(location = 1) flat in vec3 depths; // depth of that point; minimum, maximum
#ifdef HAS_CUTOUT
layout(location = 3) in vec2 barycentrics;
#endif
#endif
layout(location = 2) flat in uvec4 primitive; // id, instance, scene-wide number, DRAWN_* or FACE_*

uint texel_number()
{
    return (uint(gl_Layer) * texels_along + uint(gl_FragCoord.y)) * texels_along + uint(gl_FragCoord.x);
}

// Clamps a depth: geometry on the sides of the cube may be rounded out of it.
float depth_in_cube(float depth_cells)
{
    return min(max(depth_cells, 0.0), float(texels_along));
}

#if PRIMITIVE_KIND == 0
bool is_triangle_cut_out()
{
#ifdef HAS_CUTOUT
    candidate found = candidate(0.0, primitive.z, primitive.y, barycentrics);
    return is_cut_out(found, vec3(0.0), vec3(0.0), 0.0);
#else
    return false;
#endif
}

float triangle_depth_cells()
{
    precise float along_u = (gl_FragCoord.x - plane.z) * plane.x;
    precise float along_v = (gl_FragCoord.y - plane.w) * plane.y;
    precise float depth_cells = depths.x + along_u + along_v;
    // The depth is clamped to the triangle's range, as the plane of a thin one is uncertain, and to the cube.
    depth_cells = min(max(depth_cells, depths.y), depths.z);
    return depth_in_cube(depth_cells);
}
#else
// Line along the axis through the texel's centre, and its intersections with the sphere.
struct sphere_chord {
    vec3 origin, direction; // world space; a cell long, as depths are in cells
    vec4 rows[3];           // object_from_world
    float nearest, half_chord; // cells; below 0: the line misses the sphere
    vec3 closest, step_object; // from the sphere's centre, object space
};

sphere_chord chord_of_sphere()
{
    sphere_chord c;
    int axis = gl_Layer, u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    vec3 place_cells = vec3(0.0), direction = vec3(0.0);
    place_cells[u] = gl_FragCoord.x;
    place_cells[v] = gl_FragCoord.y;
    precise vec3 origin = lower_world + place_cells * cell_world;
    direction[axis] = cell_world;
    c.rows = instance_at(primitive.y).object_from_world;
    vec4 sphere = texelFetch(spheres, int(primitive.z));
    precise vec3 from_centre = affine_point(c.rows, origin) - sphere.xyz;
    precise vec3 step_object = affine_vector(c.rows, direction);
    precise float squared = dot(step_object, step_object);
    precise float nearest = -dot(from_centre, step_object) / squared;
    precise vec3 closest = from_centre + nearest * step_object;
    // The comparison comes before the root: some compilers replace NaN by anything.
    precise float half_squared = (sphere.w * sphere.w - dot(closest, closest)) / squared;
    precise float half_chord = half_squared >= 0.0 && squared > 0.0 ? sqrt(half_squared) : -1.0;
    c.origin = origin;
    c.direction = direction;
    c.nearest = nearest;
    c.half_chord = half_chord;
    c.closest = closest;
    c.step_object = step_object;
    return c;
}

// Intersection where the line enters (side 0) or leaves (1). The normal may have any length.
float intersection_of(sphere_chord c, int side, out vec3 normal_world)
{
    precise float reach = side == 0 ? -c.half_chord : c.half_chord;
    precise float depth_cells = c.nearest + reach;
    precise vec3 from_centre = c.closest + reach * c.step_object;
    normal_world = affine_covector(c.rows, from_centre);
    return depth_cells;
}

bool is_sphere_cut_out(sphere_chord c, float depth_cells)
{
#ifdef HAS_CUTOUT
    candidate found = candidate(depth_cells, primitive.z, primitive.y, vec2(0.0));
    return is_cut_out(found, c.origin, c.direction, 0.0);
#else
    return false;
#endif
}
#endif
