// SPDX-License-Identifier: MIT
// Places on primitives, and the attributes interpolated there. common/surface.glsl is another file, as traversal and
// shading do not need it, and a stage has few samplers.
//
// Software GL runs both sides of every branch: defines leave out attributes that no surface of the scene has, without any
// change to a hit. NO_TEXCOORDS, NO_COLOURS: no mesh has texture coordinates, vertex colours.
#include "shared/hit.h"
#include "common/math.glsl"
#include "common/motion.glsl"
#include "common/texture.glsl"

// A possible hit of a ray.
struct candidate {
    float distance;     // in lengths of the direction
    uint primitive;     // scene-wide triangle or sphere, or disc; HIT_NO_PRIMITIVE: none yet
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

// Texture coordinates of a sphere. Seen from the front (+z) with y up, u grows to the right and v downwards, as an image
// is stored.
vec4 sphere_texcoords(vec3 normal_object)
{
    float u = 0.5 + azimuth(normal_object.x, normal_object.z) / TWO_PI;
    float v = acos(clamp(normal_object.y, -1.0, 1.0)) / PI;
    return vec4(u, v, u, v);
}

// Texture coordinates of a disc, 0..1 across it.
vec4 disc_texcoords(disc d, vec3 position_world)
{
    vec3 tangent, bitangent;
    tangent_frame(d.normal.xyz, tangent, bitangent);
    vec3 from_centre = (position_world - d.centre_radius.xyz) / d.centre_radius.w;
    vec2 uv = 0.5 + 0.5 * vec2(dot(from_centre, tangent), -dot(from_centre, bitangent));
    return vec4(uv, uv);
}

// Mirrors the interpolated normal at the surface where it points to the wrong side: a reversed normal becomes its
// opposite, one slightly below the horizon moves slightly.
vec3 same_hemisphere(vec3 shading, vec3 geometric)
{
    float cosine = dot(shading, geometric);
    return cosine < 0.0 ? shading - 2.0 * cosine * geometric : shading;
}
