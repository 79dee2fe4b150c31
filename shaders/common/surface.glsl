// SPDX-License-Identifier: MIT
// From a primitive and a place on it to struct hit. Every exact tracer and the rasterised primary use it, so
// that all see one surface.
//
// Software GL runs both sides of every branch: what no surface of the scene has may be left out by defines, without
// any change to a hit. NO_TEXCOORDS, NO_COLOURS: no mesh has texture coordinates, vertex colours; NO_TANGENTS: no mesh
// has tangents, and no material asks for those that follow from texture coordinates.
#include "shared/hit.h"
#include "common/math.glsl"
#include "common/motion.glsl"
#include "common/texture.glsl"

// A possible hit of a ray.
struct candidate {
    float distance;     // in lengths of the direction
    uint primitive;     // scene-wide triangle or sphere, or disc; HIT_NO_PRIMITIVE: nothing yet
    uint instance_index; // HIT_NO_PRIMITIVE: a disc
    vec2 barycentrics;  // triangles: of the second and third vertex
};

vec3 triangle_weights(vec2 barycentrics)
{
    return vec3(1.0 - barycentrics.x - barycentrics.y, barycentrics);
}

vec4 triangle_texcoords(uvec4 triangle, uint flags, vec3 weights)
{
#ifdef NO_TEXCOORDS
    return vec4(0.0);
#else
    if ((flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) == 0u)
        return vec4(0.0);
    return texelFetch(texcoords, int(triangle.x)) * weights.x +
           texelFetch(texcoords, int(triangle.y)) * weights.y +
           texelFetch(texcoords, int(triangle.z)) * weights.z;
#endif
}

vec4 triangle_colour(uvec4 triangle, uint flags, vec3 weights)
{
#ifdef NO_COLOURS
    return vec4(1.0);
#else
    if ((flags & GEOMETRY_HAS_COLOURS) == 0u)
        return vec4(1.0);
    return texelFetch(colours, int(triangle.x)) * weights.x +
           texelFetch(colours, int(triangle.y)) * weights.y +
           texelFetch(colours, int(triangle.z)) * weights.z;
#endif
}

// Seen from the front (+z) with y up, u grows to the right and v downwards, as an image is stored.
vec4 sphere_texcoords(vec3 normal_object)
{
    float u = 0.5 + azimuth(normal_object.x, normal_object.z) / TWO_PI;
    float v = acos(clamp(normal_object.y, -1.0, 1.0)) / PI;
    return vec4(u, v, u, v);
}

// 0..1 across the disc.
vec4 disc_texcoords(disc d, vec3 position_world)
{
    vec3 tangent, bitangent;
    tangent_frame(d.normal.xyz, tangent, bitangent);
    vec3 from_centre = (position_world - d.centre_radius.xyz) / d.centre_radius.w;
    vec2 uv = 0.5 + 0.5 * vec2(dot(from_centre, tangent), -dot(from_centre, bitangent));
    return vec4(uv, uv);
}

// A triangle's tangent along u and the handedness of the frame, for meshes without tangents. v grows downwards in an
// image while a normal map's green points up, hence the sign.
bool texture_tangent(uvec4 triangle, vec3 corners[3], bool second, vec3 normal_object, out vec4 tangent_object)
{
    vec3 e1 = corners[1] - corners[0], e2 = corners[2] - corners[0];
    vec4 t0 = texelFetch(texcoords, int(triangle.x));
    vec4 t1 = texelFetch(texcoords, int(triangle.y)) - t0;
    vec4 t2 = texelFetch(texcoords, int(triangle.z)) - t0;
    vec2 d1 = second ? t1.zw : t1.xy;
    vec2 d2 = second ? t2.zw : t2.xy;
    float area = d1.x * d2.y - d1.y * d2.x;
    tangent_object = vec4(0.0);
    if (area == 0.0)
        return false;
    vec3 along_u = (e1 * d2.y - e2 * d1.y) / area;
    vec3 along_v = (e2 * d1.x - e1 * d2.x) / area;
    along_u -= normal_object * dot(normal_object, along_u);
    if (dot(along_u, along_u) == 0.0)
        return false;
    tangent_object = vec4(along_u, dot(cross(normal_object, along_u), along_v) > 0.0 ? -1.0 : 1.0);
    return true;
}

bool triangle_tangent(uvec4 triangle, vec3 corners[3], geometry g, float time, vec3 weights, vec3 normal_object,
                      out vec4 tangent_object)
{
    tangent_object = vec4(0.0);
#ifdef NO_TANGENTS
    return false;
#else
    if ((g.flags & GEOMETRY_HAS_TANGENTS) != 0u) {
        vec3 sum = tangent_at_time(triangle.x, g.close_offset, time) * weights.x +
                   tangent_at_time(triangle.y, g.close_offset, time) * weights.y +
                   tangent_at_time(triangle.z, g.close_offset, time) * weights.z;
        float handedness = texelFetch(normals, int(triangle.x)).w;
        tangent_object = vec4(sum, handedness);
        return handedness != 0.0 && dot(sum, sum) > 0.0;
    }
    material m = materials[triangle.w & HIT_MATERIAL_MASK];
    uint slot_index = m.texture_normal != 0u ? m.texture_normal : m.texture_bump;
    if (slot_index == 0u && m.anisotropy == 0.0 || (g.flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) == 0u)
        return false;
    bool second = slot_index != 0u && (texture_slots[slot_index].texture & 0x80000000u) != 0u;
    return texture_tangent(triangle, corners, second, normal_object, tangent_object);
#endif
}

// The interpolated normal, mirrored at the surface where it points to the wrong side of it: a reversed normal becomes
// its opposite, one slightly below the horizon moves slightly.
vec3 same_hemisphere(vec3 shading, vec3 geometric)
{
    float cosine = dot(shading, geometric);
    return cosine < 0.0 ? shading - 2.0 * cosine * geometric : shading;
}

hit finish_hit(uint material_index, float distance, vec3 direction_world, vec3 geometric, vec3 shading, vec4 uv01,
               vec4 tangent_world, vec4 colour)
{
    hit h;
    h.distance = distance;
    h.material = material_index & HIT_MATERIAL_MASK;
    if (dot(direction_world, geometric) > 0.0)
        h.material |= HIT_BACK_FACE;
    h.primitive = HIT_NO_PRIMITIVE;
    h.instance = HIT_NO_PRIMITIVE;
    h.uv01_or_sample = floatBitsToUint(uv01);
    h.normal_geometric = pack_unit(geometric);
    h.normal_shading = pack_unit(same_hemisphere(shading, geometric));
    h.tangent = 0u;
    if (dot(tangent_world.xyz, tangent_world.xyz) > 0.0) {
        h.tangent = pack_tangent(normalize(tangent_world.xyz), tangent_world.w);
        h.material |= HIT_HAS_TANGENT;
    }
    h.colour = packUnorm4x8(colour);
    return h;
}

hit surface_triangle(uint instance_index, uint primitive, vec2 barycentrics, float distance, vec3 direction_world,
                     float time)
{
    instance i = instance_at_time(instance_index, time);
    geometry g = geometry_at(i.geometry);
    uint flags = g.flags;
    uvec4 triangle = texelFetch(triangles, int(primitive));
    vec3 weights = triangle_weights(barycentrics);
    vec3 corners[3] = vec3[3](position_at_time(triangle.x, g.close_offset, time),
                              position_at_time(triangle.y, g.close_offset, time),
                              position_at_time(triangle.z, g.close_offset, time));
    vec3 normal_object = normalize(cross(corners[1] - corners[0], corners[2] - corners[0]));
    vec3 geometric = normalize(affine_covector(i.object_from_world, normal_object));
    vec3 shading = geometric;
    if ((flags & GEOMETRY_HAS_NORMALS) != 0u) {
        vec3 sum = normal_at_time(triangle.x, g.close_offset, time) * weights.x +
                   normal_at_time(triangle.y, g.close_offset, time) * weights.y +
                   normal_at_time(triangle.z, g.close_offset, time) * weights.z;
        vec3 interpolated = affine_covector(i.object_from_world, sum);
        float squared = dot(interpolated, interpolated);
        if (squared > 0.0) // opposite normals cancel each other
            shading = interpolated * inversesqrt(squared);
    }
    vec4 tangent;
    if (triangle_tangent(triangle, corners, g, time, weights, normal_object, tangent)) {
        tangent.xyz = affine_vector(i.world_from_object, tangent.xyz);
        if ((i.flags & INSTANCE_MIRRORED) != 0u)
            tangent.w = -tangent.w;
    }
    hit h = finish_hit(triangle.w, distance, direction_world, geometric, shading,
                       triangle_texcoords(triangle, flags, weights), tangent,
                       triangle_colour(triangle, flags, weights));
    h.primitive = primitive;
    h.instance = instance_index;
    return h;
}

hit surface_sphere(uint instance_index, uint primitive, float distance, vec3 origin_world, vec3 direction_world,
                   float time)
{
    instance i = instance_at_time(instance_index, time);
    vec4 sphere = texelFetch(spheres, int(primitive));
    vec3 position_object = affine_point(i.object_from_world, origin_world) +
                           distance * affine_vector(i.object_from_world, direction_world);
    vec3 normal_object = normalize(position_object - sphere.xyz);
    vec3 geometric = normalize(affine_covector(i.object_from_world, normal_object));
    vec4 tangent = vec4(affine_vector(i.world_from_object, vec3(normal_object.z, 0.0, -normal_object.x)),
                        (i.flags & INSTANCE_MIRRORED) != 0u ? -1.0 : 1.0);
    hit h = finish_hit(texelFetch(sphere_materials, int(primitive)).x, distance, direction_world, geometric,
                       geometric, sphere_texcoords(normal_object), tangent, vec4(1.0));
    h.primitive = primitive;
    h.instance = instance_index;
    return h;
}

hit surface_disc(uint disc_index, float distance, vec3 origin_world, vec3 direction_world)
{
    disc d = discs[disc_index];
    vec3 tangent, bitangent;
    tangent_frame(d.normal.xyz, tangent, bitangent);
    hit h = finish_hit(d.material, distance, direction_world, d.normal.xyz, d.normal.xyz,
                       disc_texcoords(d, origin_world + distance * direction_world), vec4(tangent, 1.0),
                       vec4(1.0));
    h.primitive = disc_index;
    return h;
}

hit surface_miss()
{
    return hit(-1.0, 0u, HIT_NO_PRIMITIVE, HIT_NO_PRIMITIVE, uvec4(0u), 0u, 0u, 0u, 0u);
}

// At the time of the ray that found it.
hit surface_of(candidate found, vec3 origin_world, vec3 direction_world, float time)
{
    if (found.primitive == HIT_NO_PRIMITIVE)
        return surface_miss();
    if (found.instance_index == HIT_NO_PRIMITIVE)
        return surface_disc(found.primitive, found.distance, origin_world, direction_world);
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(found.instance_index).geometry).kind == GEOMETRY_SPHERES)
        return surface_sphere(found.instance_index, found.primitive, found.distance, origin_world,
                              direction_world, time);
#endif
    return surface_triangle(found.instance_index, found.primitive, found.barycentrics, found.distance,
                            direction_world, time);
}

// The surface about a hit, for ray cones (common/cone.glsl).
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
        detail.texcoords_per_metre = vec2(0.5 / discs[h.primitive].centre_radius.w);
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
