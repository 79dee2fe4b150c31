// SPDX-License-Identifier: MIT
// Curvature and texture footprint of the surface about a hit, for ray cones (common/cone.glsl).
//
// Defines: HAS_SPHERES.
#include "common/attributes.glsl"
#include "common/normals.glsl"
#include "common/texture.glsl"

struct surface_detail {
    texture_footprint footprint;
    float curvature; // mean curvature by the shading normal, 1 / metre; above 0: it bulges to the outside
};

// Footprint from gradients `u`, `v`, in texture coordinates per metre.
texture_footprint footprint_of_gradients(vec3 u, vec3 v, mat2x3 edges)
{
    return texture_footprint(vec2(dot(u, edges[0]), dot(v, edges[0])).xyxy, vec2(dot(u, edges[1]), dot(v, edges[1])).xyxy);
}

// Texture coordinates turn once along u, and by a half turn along v.
surface_detail detail_sphere(instance i, float radius, vec2 uv, mat2x3 edges)
{
    float scale = pow(abs(determinant(mat3(i.world_from_object[0].xyz, i.world_from_object[1].xyz,
                                           i.world_from_object[2].xyz))), 1.0 / 3.0);
    float curvature = 1.0 / (radius * scale), phi = (uv.x - 0.5) * TWO_PI, theta = uv.y * PI;
    vec3 east = affine_vector(i.world_from_object, vec3(cos(phi), 0.0, -sin(phi))) / scale;
    vec3 south = affine_vector(i.world_from_object, vec3(cos(theta) * sin(phi), -sin(theta), cos(theta) * cos(phi))) / scale;
    return surface_detail(footprint_of_gradients(east * (curvature / (TWO_PI * max(sin(theta), 0.01))),
                                                 south * (curvature / PI), edges), curvature);
}

// The instance's scale counts as uniform in the triangle's plane.
surface_detail detail_triangle(instance i, uint primitive, uint flags, mat2x3 edges)
{
    uvec4 triangle = texelFetch(triangles, int(primitive));
    vec3 p0 = texelFetch(positions, int(triangle.x)).xyz;
    vec3 e1 = texelFetch(positions, int(triangle.y)).xyz - p0, e2 = texelFetch(positions, int(triangle.z)).xyz - p0;
    vec3 across = cross(e1, e2);
    float area = length(across);
    vec3 e1_world = affine_vector(i.world_from_object, e1), e2_world = affine_vector(i.world_from_object, e2);
    vec3 across_world = cross(e1_world, e2_world);
    float area_world = length(across_world);
    surface_detail detail = surface_detail(texture_footprint(vec4(0.0), vec4(0.0)), 0.0);
    if (!(area > 0.0) || !(area_world > 0.0))
        return detail;
    if ((flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) != 0u) {
        vec4 t0 = texelFetch(texcoords, int(triangle.x));
        vec4 d1 = texelFetch(texcoords, int(triangle.y)) - t0, d2 = texelFetch(texcoords, int(triangle.z)) - t0;
        // Gradients of the barycentric coordinates.
        vec3 g1 = cross(e2_world, across_world) / square(area_world), g2 = cross(across_world, e1_world) / square(area_world);
        detail.footprint.along = dot(g1, edges[0]) * d1 + dot(g2, edges[0]) * d2;
        detail.footprint.across = dot(g1, edges[1]) * d1 + dot(g2, edges[1]) * d2;
    }
    if ((flags & GEOMETRY_HAS_NORMALS) != 0u) {
        vec3 n0 = texelFetch(normals, int(triangle.x)).xyz, n1 = texelFetch(normals, int(triangle.y)).xyz,
             n2 = texelFetch(normals, int(triangle.z)).xyz, sum = n0 + n1 + n2;
        // Half the divergence along the plane of the normals between the corners.
        float divergence = dot(n1 - n0, cross(e2, across)) + dot(n2 - n0, cross(across, e1));
        float size = length(sum) / 3.0 * sign(dot(sum, across)); // negative where the winding is reversed
        if (size != 0.0)
            detail.curvature = 0.5 * divergence / (area * sqrt(area * area_world) * size);
    }
    return detail;
}

// `edges`: of the footprint, vectors along the surface, metres.
surface_detail detail_at(hit h, mat2x3 edges)
{
    surface_detail detail = surface_detail(texture_footprint(vec4(0.0), vec4(0.0)), 0.0);
    if (h.primitive == HIT_NO_PRIMITIVE)
        return detail;
    if (h.instance == HIT_NO_PRIMITIVE) { // texture coordinates run 0..1 across the disc
        disc d = disc_at(h.primitive);
        vec3 tangent, bitangent;
        tangent_frame(d.normal.xyz, tangent, bitangent);
        float per_metre = 0.5 / d.centre_radius.w;
        detail.footprint = footprint_of_gradients(tangent * per_metre, bitangent * -per_metre, edges);
        return detail;
    }
    instance i = instance_at(h.instance);
    geometry g = geometry_at(i.geometry);
#ifdef HAS_SPHERES
    if (g.kind == GEOMETRY_SPHERES)
        return detail_sphere(i, texelFetch(spheres, int(h.primitive)).w, uintBitsToFloat(h.uv01_or_sample.xy), edges);
#endif
    return detail_triangle(i, h.primitive, g.flags, edges);
}
