// SPDX-License-Identifier: MIT
// Samples of textures, which one texel buffer holds. Layouts: shared/material.h.
#include "shared/bindings.h"
#include "common/colour.glsl"
#include "common/tables.glsl"

layout(binding = UNIT_TEXELS) uniform samplerBuffer texels; // RGBA8 unorm, as stored

// Wraps a coordinate. Modes: 0 repeat, 1 clamp, 2 mirror.
float wrap_coordinate(float u, uint mode)
{
    float repeated = u - floor(u);
    float turned = abs(u - 2.0 * floor(0.5 * u + 0.5)); // distance to the nearest even number
    return mode == 0u ? repeated : mode == 1u ? clamp(u, 0.0, 1.0) : turned;
}

// Wraps the index of a texel at most one beyond the edge. Beyond a mirrored edge lies the edge itself once more.
int wrap_neighbour(int i, int size, uint mode)
{
    int repeated = i < 0 ? i + size : i >= size ? i - size : i;
    return clamp(mode == 0u ? repeated : i, 0, size - 1);
}

// Level of a texture: its first texel and its size.
struct texture_level {
    int first_texel;
    ivec2 size;
};

texture_level next_level(texture_level level)
{
    return texture_level(level.first_texel + level.size.x * level.size.y, max(level.size >> 1, ivec2(1)));
}

texture_level find_level(texture_info info, int level)
{
    texture_level found = texture_level(int(info.first_texel), ivec2(info.width, info.height));
    for (int i = 0; i < level; i++)
        found = next_level(found);
    return found;
}

vec4 fetch_texel(texture_info info, texture_level level, ivec2 at)
{
    int x = wrap_neighbour(at.x, level.size.x, (info.flags >> TEXTURE_WRAP_U_SHIFT) & 3u);
    int y = wrap_neighbour(at.y, level.size.y, (info.flags >> TEXTURE_WRAP_V_SHIFT) & 3u);
    vec4 texel = texelFetch(texels, level.first_texel + y * level.size.x + x);
    if ((info.flags & TEXTURE_SRGB) != 0u)
        texel.rgb = linear_from_srgb(texel.rgb);
    return texel;
}

// Bilinear sample of a level. The loops here have counts that the compiler cannot know: unrolled and inlined wherever a
// texture is sampled, the fetches took software GL's compiler seconds.
vec4 sample_level(texture_info info, texture_level level, vec2 uv)
{
    bool nearest = (info.flags & TEXTURE_NEAREST) != 0u;
    vec2 wrapped = vec2(wrap_coordinate(uv.x, (info.flags >> TEXTURE_WRAP_U_SHIFT) & 3u),
                        wrap_coordinate(uv.y, (info.flags >> TEXTURE_WRAP_V_SHIFT) & 3u));
    vec2 at = wrapped * vec2(level.size) - (nearest ? 0.0 : 0.5);
    ivec2 corner = min(ivec2(floor(at)), level.size - 1);
    vec2 weight = nearest ? vec2(0.0) : at - floor(at);
    vec4 sum = vec4(0.0);
    int tap_count = nearest ? 1 : 4;
    for (int tap = 0; tap < tap_count; tap++) {
        ivec2 beside = ivec2(tap & 1, tap >> 1);
        vec2 share = mix(1.0 - weight, weight, vec2(beside));
        sum += share.x * share.y * fetch_texel(info, level, corner + beside);
    }
    return sum;
}

// Texture coordinates of a slot. `uv01` holds both sets.
vec2 slot_texcoords(texture_slot slot, vec4 uv01)
{
    vec2 uv = (slot.texture & 0x80000000u) != 0u ? uv01.zw : uv01.xy;
    return vec2(dot(slot.uv_matrix.xy, uv) + slot.offset_u, dot(slot.uv_matrix.zw, uv) + slot.offset_v);
}

// Parallelogram in which a ray's cone meets a surface: two edges in texture coordinates, of both sets as in uv01 above,
// before a slot's matrix.
struct texture_footprint {
    vec4 along, across;
};

// Edges of the footprint in the slot's texture coordinates: columns.
mat2 slot_footprint(texture_slot slot, texture_footprint footprint)
{
    bool second = (slot.texture & 0x80000000u) != 0u;
    mat2 rows = mat2(slot.uv_matrix.xy, slot.uv_matrix.zw);
    return mat2((second ? footprint.along.zw : footprint.along.xy) * rows,
                (second ? footprint.across.zw : footprint.across.xy) * rows);
}

// Level whose texels are as large as the footprint.
int slot_level(texture_slot slot, texture_footprint footprint)
{
    texture_info info = texture_at(slot.texture & 0x7fffffffu);
    float texels = abs(determinant(slot_footprint(slot, footprint))) * float(info.width) * float(info.height);
    int last = int(info.flags >> TEXTURE_LEVELS_SHIFT) - 1;
    return clamp(int(0.5 * log2(max(texels, 1.0)) + 0.5), 0, last);
}

// Maximum of samples over a footprint that is longer than wide. They lie along it, each of a level by its width; a longer
// footprint is blurred across, so that no gap is left between two samples.
const float FOOTPRINT_SAMPLES_MAX = 8.0;

// Mean over a footprint: samples along its longer edge, each blended between the two levels by its width.
vec4 sample_slot_filtered(texture_slot slot, vec4 uv01, texture_footprint footprint)
{
    texture_info info = texture_at(slot.texture & 0x7fffffffu);
    mat2 edges = slot_footprint(slot, footprint);
    vec2 size = vec2(info.width, info.height), first = edges[0] * size, second = edges[1] * size;
    bool first_longer = dot(first, first) >= dot(second, second);
    vec2 longer = first_longer ? edges[0] : edges[1];
    float texels_long = length(first_longer ? first : second);
    float texels_wide = abs(first.x * second.y - first.y * second.x) / max(texels_long, 1e-20);
    texels_wide = max(max(texels_wide, 1.0), texels_long / FOOTPRINT_SAMPLES_MAX);
    float level = min(log2(texels_wide), float(info.flags >> TEXTURE_LEVELS_SHIFT) - 1.0), lower = floor(level);
    int samples = int(clamp(ceil(texels_long / texels_wide - 0.1), 1.0, FOOTPRINT_SAMPLES_MAX));
    int levels = level > lower ? 2 : 1;
    vec2 uv = slot_texcoords(slot, uv01);
    texture_level read = find_level(info, int(lower));
    vec4 sum = vec4(0.0);
    for (int i = 0; i < samples * levels; i++) {
        bool upper = i >= samples;
        if (i == samples)
            read = next_level(read);
        float place = (float(upper ? i - samples : i) + 0.5) / float(samples) - 0.5;
        float weight = upper ? level - lower : 1.0 - (level - lower);
        sum += weight * sample_level(info, read, uv + place * longer);
    }
    return sum / float(samples);
}

// Sample of a material's input in full detail: `slot_index` is one of its texture_* fields and not 0.
vec4 sample_slot(uint slot_index, vec4 uv01)
{
    texture_slot slot = texture_slot_at(slot_index);
    texture_info info = texture_at(slot.texture & 0x7fffffffu);
    return sample_level(info, find_level(info, 0), slot_texcoords(slot, uv01));
}
