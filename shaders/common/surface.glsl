// SPDX-License-Identifier: MIT
// Hit at a place on a primitive. All exact tracers and the rasterised primary use it, so that they agree on the surface.
//
// Defines: those of common/attributes.glsl; NO_TANGENTS: no mesh has tangents, and no material needs those that follow
// from texture coordinates; NO_DISCS: there are none.
#include "common/attributes.glsl"
#include "common/hit_colour.glsl"
#include "common/normals.glsl"
#include "common/unit.glsl"

layout(binding = UNIT_TANGENTS) uniform usamplerBuffer tangents; // octahedral

// Normal of a vertex at a time, interpolated and normalised.
vec3 normal_at_time(uint vertex, uint close_offset, float time)
{
    vec3 normal = texelFetch(normals, int(vertex)).xyz;
#ifdef HAS_MOTION
    if (close_offset != 0u) {
        normal = mix(normal, texelFetch(normals, int(vertex + close_offset)).xyz, time);
        float squared = dot(normal, normal);
        normal *= squared > 0.0 ? inversesqrt(squared) : 0.0;
    }
#endif
    return normal;
}

vec3 tangent_at_time(uint vertex, uint close_offset, float time)
{
    vec3 tangent = unpack_unit(texelFetch(tangents, int(vertex)).x);
#ifdef HAS_MOTION
    if (close_offset != 0u)
        tangent = mix(tangent, unpack_unit(texelFetch(tangents, int(vertex + close_offset)).x), time);
#endif
    return tangent;
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
    uint flags = material_at(triangle.w & HIT_MATERIAL_MASK).flags;
    if ((flags & MATERIAL_TANGENT) == 0u || (g.flags & (GEOMETRY_HAS_TEXCOORDS_0 | GEOMETRY_HAS_TEXCOORDS_1)) == 0u)
        return false;
    return texture_tangent(triangle, corners, (flags & MATERIAL_TANGENT_SECOND) != 0u, normal_object, tangent_object);
#endif
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
    h.colour = pack_hit_colour(colour);
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
    disc d = disc_at(disc_index);
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

// Hit of a candidate, at the time of the ray that found it.
hit surface_of(candidate found, vec3 origin_world, vec3 direction_world, float time)
{
    if (found.primitive == HIT_NO_PRIMITIVE)
        return surface_miss();
#ifndef NO_DISCS
    if (found.instance_index == HIT_NO_PRIMITIVE)
        return surface_disc(found.primitive, found.distance, origin_world, direction_world);
#endif
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(found.instance_index).geometry).kind == GEOMETRY_SPHERES)
        return surface_sphere(found.instance_index, found.primitive, found.distance, origin_world,
                              direction_world, time);
#endif
    return surface_triangle(found.instance_index, found.primitive, found.barycentrics, found.distance,
                            direction_world, time);
}
