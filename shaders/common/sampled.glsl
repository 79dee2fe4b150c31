// SPDX-License-Identifier: MIT
// Surface samples of sampled tracers: the four words of shared/surface_sample.h. They are written when a surface is
// sampled, and read when a hit is shaded or a shadow ray needs alpha and tint. Shares are factors of the material's own
// values.
#include "shared/surface_sample.h"
#include "common/colour.glsl"
#include "common/unit.glsl"

struct surface_sample {
    vec4 base_colour; // share, linear; alpha last
    vec3 normal;      // shading normal with normal and bump maps; unit, world space, on the outer side
    uint material;    // index
    float metallic, transmission, roughness; // shares
    float occlusion;  // occlusion itself, with its strength applied
    vec3 emission;    // share
};

uint sample_bits(float share, uint shift, uint bits)
{
    float maximum = float((1u << bits) - 1u);
    return uint(clamp(share, 0.0, 1.0) * maximum + 0.5) << shift;
}

float sample_share(uint word, int shift, int bits)
{
    return float(bitfieldExtract(word, shift, bits)) * (1.0 / float((1 << bits) - 1));
}

uvec4 pack_sample(surface_sample s)
{
    vec3 colour = srgb_from_linear(clamp(s.base_colour.rgb, vec3(0.0), vec3(1.0)));
    vec3 emission = sqrt(clamp(s.emission, vec3(0.0), vec3(1.0)));
    return uvec4(packUnorm4x8(vec4(colour, s.base_colour.a)), pack_unit(s.normal),
                 (s.material & SAMPLE_MATERIAL_MASK) | sample_bits(s.metallic, SAMPLE_METALLIC_SHIFT, 4u) |
                     sample_bits(s.transmission, SAMPLE_TRANSMISSION_SHIFT, 4u),
                 sample_bits(s.roughness, 0u, 8u) | sample_bits(s.occlusion, 8u, 8u) |
                     sample_bits(emission.r, 16u, 5u) | sample_bits(emission.g, 21u, 6u) |
                     sample_bits(emission.b, 27u, 5u));
}

vec4 sample_base_colour(uvec4 words)
{
    vec4 colour = unpackUnorm4x8(words.x);
    return vec4(linear_from_srgb(colour.rgb), colour.a);
}

float sample_alpha(uvec4 words)
{
    return sample_share(words.x, 24, 8);
}

uint sample_material(uvec4 words)
{
    return words.z & SAMPLE_MATERIAL_MASK;
}

float sample_transmission(uvec4 words)
{
    return sample_share(words.z, int(SAMPLE_TRANSMISSION_SHIFT), 4);
}

float sample_metallic(uvec4 words)
{
    return sample_share(words.z, int(SAMPLE_METALLIC_SHIFT), 4);
}

surface_sample unpack_sample(uvec4 words)
{
    surface_sample s;
    s.base_colour = sample_base_colour(words);
    s.normal = unpack_unit(words.y);
    s.material = sample_material(words);
    s.metallic = sample_metallic(words);
    s.transmission = sample_transmission(words);
    s.roughness = sample_share(words.w, 0, 8);
    s.occlusion = sample_share(words.w, 8, 8);
    vec3 root = vec3(sample_share(words.w, 16, 5), sample_share(words.w, 21, 6), sample_share(words.w, 27, 5));
    s.emission = root * root;
    return s;
}
