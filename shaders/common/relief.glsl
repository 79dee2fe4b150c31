// SPDX-License-Identifier: MIT
// Shading normals from normal and bump maps.
//
// Defines: HAS_TEXTURES some material has a texture; HAS_BUMP one of them is a bump map.

#include "shared/hit.h"
#include "common/attributes.glsl"
#include "common/math.glsl"
#include "common/texture.glsl"
#include "common/unit.glsl"

#ifdef HAS_BUMP
// Derivatives of the position by a slot's texture coordinates, world space, at a hit.
bool surface_derivatives(hit h, texture_slot slot, out vec3 along_u, out vec3 along_v)
{
    along_u = along_v = vec3(0.0);
    if (h.primitive == HIT_NO_PRIMITIVE)
        return false;
    if (h.instance == HIT_NO_PRIMITIVE) {
        disc d = disc_at(h.primitive);
        vec3 tangent, bitangent;
        tangent_frame(d.normal.xyz, tangent, bitangent);
        along_u = 2.0 * d.centre_radius.w * tangent; // texture coordinates run 0..1 across the disc
        along_v = -2.0 * d.centre_radius.w * bitangent;
        return true;
    }
    instance i = instance_at(h.instance);
    if (geometry_at(i.geometry).kind == GEOMETRY_SPHERES) {
        float radius = texelFetch(spheres, int(h.primitive)).w;
        vec2 uv = uintBitsToFloat(h.uv01_or_sample.xy);
        float phi = (uv.x - 0.5) * TWO_PI, theta = uv.y * PI;
        vec3 east = vec3(cos(phi), 0.0, -sin(phi));
        vec3 south = vec3(cos(theta) * sin(phi), -sin(theta), cos(theta) * cos(phi));
        along_u = affine_vector(i.world_from_object, east * (TWO_PI * radius * sin(theta)));
        along_v = affine_vector(i.world_from_object, south * (PI * radius));
        return true;
    }
    uvec4 triangle = texelFetch(triangles, int(h.primitive));
    vec3 p0 = texelFetch(positions, int(triangle.x)).xyz;
    vec3 e1 = affine_vector(i.world_from_object, texelFetch(positions, int(triangle.y)).xyz - p0);
    vec3 e2 = affine_vector(i.world_from_object, texelFetch(positions, int(triangle.z)).xyz - p0);
    vec2 t0 = slot_texcoords(slot, texelFetch(texcoords, int(triangle.x)));
    vec2 d1 = slot_texcoords(slot, texelFetch(texcoords, int(triangle.y))) - t0;
    vec2 d2 = slot_texcoords(slot, texelFetch(texcoords, int(triangle.z))) - t0;
    float area = d1.x * d2.y - d1.y * d2.x;
    if (area == 0.0)
        return false;
    along_u = (e1 * d2.y - e2 * d1.y) / area;
    along_v = (e2 * d1.x - e1 * d2.x) / area;
    return true;
}

// Blinn. Simulation of Wrinkled Surfaces. 1978, in the form of Mikkelsen. Bump Mapping Unparametrized Surfaces on
// the GPU. 2010: the slope of the height along the surface tilts the normal. The height's derivatives are differences
// over one texel of the footprint's level.
vec3 bump_normal(hit h, uint slot_index, vec3 normal, vec4 uv01, texture_footprint footprint)
{
    texture_slot slot = texture_slot_at(slot_index);
    vec3 along_u, along_v;
    if (!surface_derivatives(h, slot, along_u, along_v))
        return normal;
    texture_info info = texture_at(slot.texture & 0x7fffffffu);
    texture_level level = find_level(info, slot_level(slot, footprint));
    vec2 uv = slot_texcoords(slot, uv01), texel = 1.0 / vec2(level.size);
    float height_u = 0.0, height_v = 0.0;
    for (int i = 0; i < 4; i++) { // -u, +u, -v, +v
        float side = (i & 1) != 0 ? 0.5 : -0.5;
        vec2 step = i < 2 ? vec2(side * texel.x, 0.0) : vec2(0.0, side * texel.y);
        float height = sample_level(info, level, uv + step).r * 2.0 * side;
        height_u += i < 2 ? height : 0.0;
        height_v += i < 2 ? 0.0 : height;
    }
    vec3 across_u = cross(along_v, normal), across_v = cross(normal, along_u);
    float determinant_ = dot(along_u, across_u);
    vec3 slope = sign(determinant_) * slot.strength *
                 (height_u / texel.x * across_u + height_v / texel.y * across_v);
    vec3 tilted = abs(determinant_) * normal - slope;
    float squared = dot(tilted, tilted);
    return squared > 0.0 ? tilted * inversesqrt(squared) : normal;
}

#endif

#ifdef HAS_TEXTURES
// Whether the tangent at a hit is the mesh's own, which is made for the image as it lies there.
bool has_own_tangent(hit h)
{
    return h.instance != HIT_NO_PRIMITIVE && (geometry_at(instance_at(h.instance).geometry).flags & GEOMETRY_HAS_TANGENTS) != 0u;
}

// Turns a direction of an image, x along its columns and y up, to one of the texture coordinates, along which the tangent
// runs: a slot may turn and mirror the image on the surface.
vec2 turned_by_slot(hit h, texture_slot slot, vec2 direction)
{
    vec2 along = slot.uv_matrix.wz; // first row of the inverse, up to its length; v runs down and y up
    float turns = slot.uv_matrix.x * slot.uv_matrix.w - slot.uv_matrix.y * slot.uv_matrix.z;
    bool keeps = along.y == 0.0 && along.x > 0.0 && turns > 0.0;
    if (keeps || turns == 0.0 || has_own_tangent(h))
        return direction;
    along *= sign(turns) * inversesqrt(dot(along, along));
    return direction.x * along + direction.y * sign(turns) * vec2(-along.y, along.x);
}

vec3 mapped_normal(hit h, vec3 normal, vec3 texel, texture_slot slot)
{
    texel = texel * 2.0 - 1.0;
    texel.xy = turned_by_slot(h, slot, texel.xy * slot.strength);
    vec4 tangent = unpack_tangent(h.tangent);
    vec3 along = tangent.xyz - dot(tangent.xyz, normal) * normal;
    float squared = dot(along, along);
    if (squared < 1e-8)
        return normal;
    along *= inversesqrt(squared);
    vec3 mapped = along * texel.x + cross(normal, along) * (tangent.w * texel.y) + normal * texel.z;
    squared = dot(mapped, mapped);
    return squared > 1e-8 ? mapped * inversesqrt(squared) : normal;
}
#endif
