// SPDX-License-Identifier: MIT
// Cutouts and translucent surfaces: a tracer evaluates a candidate's alpha before it counts. EVEN_ALPHA: no such
// material has a texture or vertex colours, so the point on the surface does not matter. Compiled to constants where
// the scene has no such material (HAS_CUTOUT, HAS_TRANSLUCENT not defined).
#include "common/attributes.glsl"

uint material_index_of(candidate found)
{
    if (found.instance_index == HIT_NO_PRIMITIVE)
        return disc_at(found.primitive).material;
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(found.instance_index).geometry).kind == GEOMETRY_SPHERES)
        return texelFetch(sphere_materials, int(found.primitive)).x;
#endif
    return texelFetch(triangles, int(found.primitive)).w & HIT_MATERIAL_MASK;
}

// Inputs of alpha and tint, for any kind of primitive.
struct surface_point {
    vec4 uv01;
    vec4 colour;
};

surface_point point_of(candidate found, vec3 origin_world, vec3 direction_world, float time)
{
#ifdef EVEN_ALPHA
    return surface_point(vec4(0.0), vec4(1.0));
#else
    if (found.instance_index == HIT_NO_PRIMITIVE)
        return surface_point(disc_texcoords(disc_at(found.primitive),
                                            origin_world + found.distance * direction_world),
                             vec4(1.0));
    instance i = instance_at_time(found.instance_index, time);
#ifdef HAS_SPHERES
    if (geometry_at(i.geometry).kind == GEOMETRY_SPHERES) {
        vec4 sphere = texelFetch(spheres, int(found.primitive));
        vec3 position_object = affine_point(i.object_from_world, origin_world) +
                               found.distance * affine_vector(i.object_from_world, direction_world);
        return surface_point(sphere_texcoords(normalize(position_object - sphere.xyz)), vec4(1.0));
    }
#endif
    uint flags = geometry_at(i.geometry).flags;
    uvec4 triangle = texelFetch(triangles, int(found.primitive));
    vec3 weights = triangle_weights(found.barycentrics);
    return surface_point(triangle_texcoords(triangle, flags, weights), triangle_colour(triangle, flags, weights));
#endif
}

vec4 base_colour_at(material m, surface_point point)
{
    vec4 colour = m.base_colour * point.colour;
#ifndef EVEN_ALPHA
    if (m.texture_base_colour != 0u)
        colour *= sample_slot(m.texture_base_colour, point.uv01);
#endif
    return colour;
}

// Whether the surface is cut away here (alpha mode mask).
bool is_cut_out(candidate found, vec3 origin_world, vec3 direction_world, float time)
{
#ifdef HAS_CUTOUT
    material m = material_at(material_index_of(found));
    if ((m.flags & MATERIAL_ALPHA_MASK) == 0u)
        return false;
    return base_colour_at(m, point_of(found, origin_world, direction_world, time)).a < m.alpha_cutoff;
#else
    return false;
#endif
}

// Transmittance of the surface for a shadow ray: 0 if it is opaque, 1 if it is cut away; the base colour tints
// transmitted light, and the share that alpha blending leaves open passes untinted. `stops`: only a surface that is cut
// away lets the ray pass.
vec3 transmittance_of(candidate found, vec3 origin_world, vec3 direction_world, float time, bool stops)
{
#if defined HAS_CUTOUT || defined HAS_TRANSLUCENT
    material m = material_at(material_index_of(found));
    bool is_mask = (m.flags & MATERIAL_ALPHA_MASK) != 0u;
    bool is_blend = (m.flags & MATERIAL_ALPHA_BLEND) != 0u;
    if (!is_mask && !is_blend && m.transmission == 0.0)
        return vec3(0.0);
    surface_point point = point_of(found, origin_world, direction_world, time);
    vec4 colour = base_colour_at(m, point);
    if (is_mask && colour.a < m.alpha_cutoff)
        return vec3(1.0);
    if (stops)
        return vec3(0.0);
    vec3 through = vec3(0.0);
#ifdef HAS_TRANSMISSION // otherwise only alpha is needed, and no colour is decoded
    float metallic = m.metallic;
#ifndef EVEN_ALPHA
    if (metallic > 0.0 && m.texture_metallic_roughness != 0u)
        metallic *= sample_slot(m.texture_metallic_roughness, point.uv01).b;
#endif
    float transmission = m.transmission * (1.0 - metallic);
#ifndef EVEN_ALPHA
    if (transmission > 0.0 && m.texture_transmission != 0u)
        transmission *= sample_slot(m.texture_transmission, point.uv01).r;
#endif
    through = transmission * clamp(colour.rgb, 0.0, 1.0) * vec3(m.body_red, m.body_green, m.body_blue);
#endif
    return is_blend ? mix(vec3(1.0), through, clamp(colour.a, 0.0, 1.0)) : through;
#else
    return vec3(0.0);
#endif
}
