// SPDX-License-Identifier: MIT
// The surface about a hit, for ray cones (common/cone.glsl).
//
// Defines: HAS_SPHERES.
#include "common/attributes.glsl"
#include "common/normals.glsl"

struct surface_detail {
    vec2 texcoords_per_metre; // of sets 0 and 1
    float curvature;          // mean of the shading normal's, 1 / metre; above 0: it bulges to the outside
};

surface_detail detail_sphere(instance i, float radius, float v)
{
    float scale = pow(abs(determinant(mat3(i.world_from_object[0].xyz, i.world_from_object[1].xyz,
                                           i.world_from_object[2].xyz))), 1.0 / 3.0);
    float curvature = 1.0 / (radius * scale), sine = max(sin(PI * v), 0.01);
    // A turn along u and half of one along v.
    return surface_detail(vec2(curvature * inversesqrt(2.0 * PI * PI * sine)), curvature);
}

// The instance's scale is taken to be the same in all directions of the triangle's plane.
surface_detail detail_triangle(instance i, uint primitive, uint flags)
{
    uvec4 triangle = texelFetch(triangles, int(primitive));
    vec3 p0 = texelFetch(positions, int(triangle.x)).xyz;
    vec3 e1 = texelFetch(positions, int(triangle.y)).xyz - p0, e2 = texelFetch(positions, int(triangle.z)).xyz - p0;
    vec3 across = cross(e1, e2);
    float area = length(across);
    float area_world = length(cross(affine_vector(i.world_from_object, e1), affine_vector(i.world_from_object, e2)));
    surface_detail detail = surface_detail(vec2(0.0), 0.0);
    if (!(area > 0.0) || !(area_world > 0.0))
        return detail;
    if ((flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) != 0u) {
        vec4 t0 = texelFetch(texcoords, int(triangle.x));
        vec4 d1 = texelFetch(texcoords, int(triangle.y)) - t0, d2 = texelFetch(texcoords, int(triangle.z)) - t0;
        detail.texcoords_per_metre = sqrt(abs(d1.xz * d2.yw - d1.yw * d2.xz) / area_world);
    }
    if ((flags & GEOMETRY_HAS_NORMALS) != 0u) {
        vec3 n0 = texelFetch(normals, int(triangle.x)).xyz, n1 = texelFetch(normals, int(triangle.y)).xyz,
             n2 = texelFetch(normals, int(triangle.z)).xyz, sum = n0 + n1 + n2;
        // Half the divergence along the plane of the normals between the corners.
        float divergence = dot(n1 - n0, cross(e2, across)) + dot(n2 - n0, cross(across, e1));
        float size = length(sum) / 3.0 * sign(dot(sum, across)); // those of other winding are turned round
        if (size != 0.0)
            detail.curvature = 0.5 * divergence / (area * sqrt(area * area_world) * size);
    }
    return detail;
}

surface_detail detail_at(hit h)
{
    surface_detail detail = surface_detail(vec2(0.0), 0.0);
    if (h.primitive == HIT_NO_PRIMITIVE)
        return detail;
    if (h.instance == HIT_NO_PRIMITIVE) { // texture coordinates run 0..1 across the disc
        detail.texcoords_per_metre = vec2(0.5 / disc_at(h.primitive).centre_radius.w);
        return detail;
    }
    instance i = instance_at(h.instance);
    geometry g = geometry_at(i.geometry);
#ifdef HAS_SPHERES
    if (g.kind == GEOMETRY_SPHERES)
        return detail_sphere(i, texelFetch(spheres, int(h.primitive)).w, uintBitsToFloat(h.uv01_or_sample.y));
#endif
    return detail_triangle(i, h.primitive, g.flags);
}
