// SPDX-License-Identifier: MIT
// Of what the surface is made at each sample: geometry and surface of shared/ldc.h. Textures are applied over the size
// of a cell, as common/material.glsl applies them; what the material itself says is not.
// Defines: those of common/material.glsl.

#include "shared/ldc.h"
#include "shared/ldc_build.h"
#include "common/dispatch.glsl"
#include "common/material.glsl"
#include "common/sampled.glsl"

uniform uint sample_count, first_sample; // of the cube
uniform uint drawn_count;
uniform uint texels_along; // a side of the images
uniform vec3 lower_world;
uniform float cell_world;

layout(binding = UNIT_LDC_VISIBLE) uniform usamplerBuffer visible;
layout(binding = UNIT_LDC_DRAWN) uniform usamplerBuffer drawn;
layout(binding = IMAGE_LDC_GEOMETRY, rg32ui) writeonly uniform uimageBuffer geometry_out;
layout(binding = IMAGE_LDC_SURFACE, rgba32ui) writeonly uniform uimageBuffer surface_out;

// Which instance an id belongs to, and the primitive's scene-wide number.
uvec2 primitive_of(uint id)
{
    uint first = 0u, count = drawn_count;
    while (count > 1u) {
        uint half_ = count >> 1;
        bool beyond = texelFetch(drawn, int(first + half_)).x <= id;
        first = beyond ? first + half_ : first;
        count = beyond ? count - half_ : half_;
    }
    uvec4 found = texelFetch(drawn, int(first));
    return uvec2(found.z, id - found.y);
}

vec3 place_in_cells(instance i, uint vertex)
{
    return (affine_point(i.world_from_object, texelFetch(positions, int(vertex)).xyz) - lower_world) / cell_world;
}

float cross_2d(vec2 a, vec2 b)
{
    return a.x * b.y - a.y * b.x;
}

// Of the point under the texel's middle; drawn edges are a little elsewhere than exact ones.
vec2 barycentrics_at(uvec2 primitive, int u, int v, vec2 middle)
{
    instance i = instance_at(primitive.x);
    uvec4 triangle = texelFetch(triangles, int(primitive.y));
    vec3 p0 = place_in_cells(i, triangle.x);
    vec3 e1 = place_in_cells(i, triangle.y) - p0, e2 = place_in_cells(i, triangle.z) - p0;
    vec2 a = vec2(e1[u], e1[v]), b = vec2(e2[u], e2[v]), c = middle - vec2(p0[u], p0[v]);
    float area = cross_2d(a, b);
    vec2 weights = area != 0.0 ? vec2(cross_2d(c, b), cross_2d(a, c)) / area : vec2(0.0);
    weights = clamp(weights, vec2(0.0), vec2(1.0));
    float sum = weights.x + weights.y;
    return sum > 1.0 ? weights / sum : weights;
}

uvec4 words_of(surface s, vec4 colour, uint material_index)
{
    surface_sample stored;
    stored.base_colour = colour;
    stored.normal = s.normal;
    stored.material = material_index;
    stored.metallic = s.metallic;
    stored.transmission = s.transmission;
    stored.roughness = s.roughness;
    stored.occlusion = s.occlusion;
    stored.emission = s.emission;
    return pack_sample(stored);
}

void main()
{
    uint k = item_index();
    if (k >= sample_count)
        return;
    uvec4 found = texelFetch(visible, int(k));
    uint texel = found.x, row = texel / texels_along;
    int axis = int(row / texels_along), u = axis == 2 ? 0 : axis + 1, v = axis == 0 ? 2 : axis - 1;
    vec2 middle = vec2(texel - row * texels_along, row - uint(axis) * texels_along) + 0.5;
    float depth_cells = uintBitsToFloat(found.y);
    uvec2 primitive = primitive_of(found.z);

    vec3 origin = vec3(0.0), direction = vec3(0.0);
    origin[u] = middle.x * cell_world;
    origin[v] = middle.y * cell_world;
    origin += lower_world;
    direction[axis] = 1.0;
    candidate at = candidate(depth_cells * cell_world, primitive.y, primitive.x, vec2(0.0));
#ifdef HAS_SPHERES
    if (geometry_at(instance_at(primitive.x).geometry).kind != GEOMETRY_SPHERES)
#endif
        at.barycentrics = barycentrics_at(primitive, u, v, middle);
    hit h = surface_of(at, origin, direction, 0.0);

    surface s;
    s.geometric = unpack_unit(h.normal_geometric);
    s.normal = unpack_unit(h.normal_shading);
    s.emission = vec3(1.0);
    s.metallic = s.roughness = s.transmission = s.occlusion = 1.0;
    vec4 colour = unpackUnorm4x8(h.colour);
    material m = materials[h.material & HIT_MATERIAL_MASK];
    vec4 uv01 = vec4(h.u0, h.v0, h.u1, h.v1);
#ifdef HAS_TEXTURES
    apply_textures(s, colour, h, m, uv01, footprint_of(h, m, s.geometric, direction, cell_world));
#endif
#ifdef HAS_BUMP
    if (m.texture_bump != 0u)
        s.normal = bump_normal(h, m.texture_bump, s.normal, uv01);
#endif
    imageStore(geometry_out, int(first_sample + k), uvec4(found.y, h.normal_geometric, 0u, 0u));
    imageStore(surface_out, int(first_sample + k), words_of(s, colour, h.material));
}
