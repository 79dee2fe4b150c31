// SPDX-License-Identifier: MIT
// Material of the surface at a point of a primitive: the words of shared/surface_sample.h. Textures are applied, filtered
// to the size of a cell, as in common/material.glsl; the material's own factors are not.
// Defines: those of common/material.glsl; HAS_COLOURS: some mesh has vertex colours.

#include "ldc/layout.h"
#include "raster/cube.glsl"
#include "common/material.glsl"
#include "common/sampled.glsl"
#include "common/surface.glsl"

float cross_2d(vec2 a, vec2 b)
{
    return a.x * b.y - a.y * b.x;
}

// A primitive's point at the centre of a texel.
struct point {
    uint instance_index, primitive;
    uint flags; // DRAWN_*
    int axis, u, v;
    vec2 middle; // u, v in cells
    float depth_cells;
};

point make_point(uint instance_index, uint primitive, uint flags, int axis, vec2 middle, float depth_cells)
{
    return point(instance_index, primitive, flags, axis, axis == 2 ? 0 : axis + 1, axis == 0 ? 2 : axis - 1, middle,
                 depth_cells);
}

// Words of the point for `primitives`.
uvec2 primitive_words(point p)
{
    return uvec2(p.instance_index | ((p.flags & DRAWN_SPHERES) != 0u ? LDC_OF_SPHERES : 0u), p.primitive);
}

// Corners of a triangle, in cells, and the barycentrics of the point.
struct placed_triangle {
    uvec4 vertices; // and the material
    vec4 world_from_object[3];
    vec3 e1, e2;
    vec2 barycentrics;
};

// Places the triangle and the point. Drawn edges differ a little from exact ones: the point is clamped to the triangle.
placed_triangle place_triangle(point p)
{
    placed_triangle t;
    int first_row = int(p.instance_index) * INSTANCE_TEXELS;
    for (int row = 0; row < 3; row++)
        t.world_from_object[row] = uintBitsToFloat(texelFetch(instances, first_row + row));
    t.vertices = texelFetch(triangles, int(p.primitive));
    vec3 p0 = texelFetch(positions, int(t.vertices.x)).xyz;
    t.e1 = affine_vector(t.world_from_object, texelFetch(positions, int(t.vertices.y)).xyz - p0) / cell_world;
    t.e2 = affine_vector(t.world_from_object, texelFetch(positions, int(t.vertices.z)).xyz - p0) / cell_world;
    p0 = (affine_point(t.world_from_object, p0) - lower_world) / cell_world;
    vec2 a = vec2(t.e1[p.u], t.e1[p.v]), b = vec2(t.e2[p.u], t.e2[p.v]), c = p.middle - vec2(p0[p.u], p0[p.v]);
    float area = cross_2d(a, b);
    vec2 weights = area != 0.0 ? vec2(cross_2d(c, b), cross_2d(a, c)) / area : vec2(0.0);
    weights = clamp(weights, vec2(0.0), vec2(1.0));
    float sum = weights.x + weights.y;
    t.barycentrics = sum > 1.0 ? weights / sum : weights;
    return t;
}

#if !defined HAS_TEXTURES && !defined HAS_BUMP
// Does the work of surface_triangle() in common/surface.glsl with half of its fetches: no texture coordinates, no
// tangent.
struct plain_surface {
    vec3 geometric, shading;
    uint material_index;
    vec4 colour;
};

plain_surface plain_triangle(point p)
{
    plain_surface found;
    placed_triangle t = place_triangle(p);
    float side = (p.flags & DRAWN_MIRRORED) != 0u ? -1.0 : 1.0;
    vec3 geometric = normalize(cross(t.e1, t.e2)) * side, shading = geometric;
    vec3 weights = triangle_weights(t.barycentrics);
    if ((p.flags & DRAWN_NORMALS) != 0u) {
        vec3 sum = texelFetch(normals, int(t.vertices.x)).xyz * weights.x +
                   texelFetch(normals, int(t.vertices.y)).xyz * weights.y +
                   texelFetch(normals, int(t.vertices.z)).xyz * weights.z;
        vec4 rows[3] = t.world_from_object;
        float maximum = max_component(max(abs(rows[0].xyz), max(abs(rows[1].xyz), abs(rows[2].xyz))));
        vec3 r0 = rows[0].xyz / maximum, r1 = rows[1].xyz / maximum, r2 = rows[2].xyz / maximum;
        // The cofactors are the transposed inverse up to the determinant, whose sign alone matters.
        vec3 interpolated = side * vec3(dot(cross(r1, r2), sum), dot(cross(r2, r0), sum), dot(cross(r0, r1), sum));
        float squared = dot(interpolated, interpolated);
        if (squared > 0.0)
            shading = interpolated * inversesqrt(squared);
    }
    found.geometric = geometric;
    found.shading = same_hemisphere(shading, geometric);
    found.material_index = t.vertices.w;
    found.colour = vec4(1.0);
#ifdef HAS_COLOURS
    if ((p.flags & DRAWN_COLOURS) != 0u)
        found.colour = unpack_hit_colour(pack_hit_colour(triangle_colour(t.vertices, GEOMETRY_HAS_COLOURS, weights)));
#endif
    return found;
}
#endif

#if defined HAS_TEXTURES || defined HAS_BUMP || defined HAS_SPHERES
hit hit_at(point p, vec3 origin, vec3 direction)
{
#ifdef HAS_SPHERES
    if ((p.flags & DRAWN_SPHERES) != 0u)
        return surface_sphere(p.instance_index, p.primitive, p.depth_cells * cell_world, origin, direction, 0.0);
#endif
#if defined HAS_TEXTURES || defined HAS_BUMP
    return surface_triangle(p.instance_index, p.primitive, place_triangle(p).barycentrics, 0.0, direction, 0.0);
#else
    plain_surface found = plain_triangle(p);
    return finish_hit(found.material_index, 0.0, vec3(0.0), found.geometric, found.shading, vec4(0.0), vec4(0.0),
                      found.colour);
#endif
}
#endif

uvec4 words_of(surface s, vec4 colour, uint material_index)
{
    surface_sample stored;
#if defined HAS_TEXTURES || defined HAS_COLOURS
    stored.base_colour = colour;
#else
    stored.base_colour = vec4(1.0); // a constant for the compiler
#endif
    stored.normal = s.normal;
    stored.material = material_index;
    stored.metallic = s.metallic;
    stored.transmission = s.transmission;
    stored.roughness = s.roughness;
    stored.occlusion = s.occlusion;
    stored.emission = s.emission;
    return pack_sample(stored);
}

void describe(point p, out uvec2 geometry_words, out uvec4 surface_words)
{
    surface s;
    s.emission = vec3(1.0);
    s.metallic = s.roughness = s.transmission = s.occlusion = 1.0;
#if defined HAS_TEXTURES || defined HAS_BUMP || defined HAS_SPHERES
    vec3 origin = vec3(0.0), direction = vec3(0.0);
    origin[p.u] = p.middle.x * cell_world;
    origin[p.v] = p.middle.y * cell_world;
    origin += lower_world;
    direction[p.axis] = 1.0;
    hit h = hit_at(p, origin, direction);
    s.geometric = unpack_unit(h.normal_geometric);
    s.normal = unpack_unit(h.normal_shading);
    vec4 colour = unpack_hit_colour(h.colour);
    material m = material_at(h.material & HIT_MATERIAL_MASK);
    vec4 uv01 = uintBitsToFloat(h.uv01_or_sample);
#ifdef HAS_TEXTURES
    surface_detail detail = detail_at(h, footprint_edges(s.geometric, direction, cell_world));
    apply_textures(s, colour, h, m, uv01, detail.footprint);
#endif
    geometry_words = uvec2(floatBitsToUint(p.depth_cells), h.normal_geometric);
    surface_words = words_of(s, colour, h.material);
#else // avoids packing and unpacking
    plain_surface found = plain_triangle(p);
    s.normal = found.shading;
    geometry_words = uvec2(floatBitsToUint(p.depth_cells), pack_unit(found.geometric));
    surface_words = words_of(s, found.colour, found.material_index);
#endif
}
