// SPDX-License-Identifier: MIT
// Textures, from the one texel buffer that holds them all. Layouts: shared/material.h.
#include "shared/bindings.h"
#include "common/colour.glsl"
#include "common/tables.glsl"

layout(binding = UNIT_TEXELS) uniform samplerBuffer texels; // RGBA8 unorm, as stored

// Modes: 0 repeat, 1 clamp, 2 mirror.
float wrap_coordinate(float u, uint mode)
{
    float repeated = u - floor(u);
    float turned = abs(u - 2.0 * floor(0.5 * u + 0.5)); // distance to the nearest even number
    return mode == 0u ? repeated : mode == 1u ? clamp(u, 0.0, 1.0) : turned;
}

// For a texel at most one beyond the edge. Beyond a mirrored edge lies the edge itself once more.
int wrap_neighbour(int i, int size, uint mode)
{
    int repeated = i < 0 ? i + size : i >= size ? i - size : i;
    return clamp(mode == 0u ? repeated : i, 0, size - 1);
}

// One level of a texture: its first texel and its size.
struct texture_level {
    int first_texel;
    ivec2 size;
};

texture_level find_level(texture_info info, int level)
{
    texture_level found = texture_level(int(info.first_texel), ivec2(info.width, info.height));
    for (int i = 0; i < level; i++) {
        found.first_texel += found.size.x * found.size.y;
        found.size = max(found.size >> 1, ivec2(1));
    }
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

// The loops here have counts that the compiler cannot know: unrolled and inlined wherever a texture is sampled, the
// fetches took software GL's compiler seconds.
vec4 sample_level(texture_info info, int level_number, vec2 uv)
{
    texture_level level = find_level(info, level_number);
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

// Texture coordinates that a slot sees. `uv01` holds both sets.
vec2 slot_texcoords(texture_slot slot, vec4 uv01)
{
    vec2 uv = (slot.texture & 0x80000000u) != 0u ? uv01.zw : uv01.xy;
    return vec2(dot(slot.uv_matrix.xy, uv) + slot.offset_u, dot(slot.uv_matrix.zw, uv) + slot.offset_v);
}

// Level at which a texel is as wide as the footprint, which is in texture coordinates of both sets before the slot's
// matrix.
float slot_level(texture_slot slot, vec2 footprint_uv)
{
    texture_info info = texture_at(slot.texture & 0x7fffffffu);
    float footprint = (slot.texture & 0x80000000u) != 0u ? footprint_uv.y : footprint_uv.x;
    float scale = sqrt(abs(determinant(mat2(slot.uv_matrix.xy, slot.uv_matrix.zw))));
    float texels_wide = footprint * scale * sqrt(float(info.width) * float(info.height));
    return texels_wide > 1.0 ? log2(texels_wide) : 0.0;
}

// A material's input in full detail: `slot_index` is one of its texture_* fields and not 0.
vec4 sample_slot(uint slot_index, vec4 uv01)
{
    texture_slot slot = texture_slot_at(slot_index);
    return sample_level(texture_at(slot.texture & 0x7fffffffu), 0, slot_texcoords(slot, uv01));
}
