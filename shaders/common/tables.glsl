// SPDX-License-Identifier: MIT
// What is small of a scene: its tables in one texel buffer, of which gpu_scene_bind() binds the unit. Layout:
// shared/tables.h. Structs in texels: software GL reads a storage buffer a word and a lane at a time. Texels of which
// no member is used are not fetched.
#include "shared/bindings.h"
#include "shared/geometry.h"
#include "shared/material.h"
#include "shared/tables.h"

layout(binding = UNIT_TABLES) uniform usamplerBuffer tables;

table_starts find_tables()
{
    uvec4 starts = texelFetch(tables, 0);
    return table_starts(starts.x, starts.y, starts.z, starts.w);
}

geometry geometry_at(uint index)
{
    int texel = int(TABLES_HEAD_TEXELS + index * GEOMETRY_TEXELS);
    uvec4 first = texelFetch(tables, texel), second = texelFetch(tables, texel + 1);
    return geometry(first.x, first.y, first.z, first.w, second.x, second.y, second.z, second.w);
}

material material_at(uint index)
{
    int texel = int(find_tables().materials + index * MATERIAL_TEXELS);
    vec4 factors = uintBitsToFloat(texelFetch(tables, texel + 2));
    uvec4 inputs = texelFetch(tables, texel + 3), more = texelFetch(tables, texel + 4);
    uvec4 last = texelFetch(tables, texel + 5);
    material m;
    m.base_colour = uintBitsToFloat(texelFetch(tables, texel));
    m.emission_ior = uintBitsToFloat(texelFetch(tables, texel + 1));
    m.metallic = factors.x;
    m.roughness = factors.y;
    m.transmission = factors.z;
    m.alpha_cutoff = factors.w;
    m.flags = inputs.x;
    m.texture_base_colour = inputs.y;
    m.texture_normal = inputs.z;
    m.texture_metallic_roughness = inputs.w;
    m.texture_occlusion = more.x;
    m.texture_emission = more.y;
    m.texture_transmission = more.z;
    m.texture_bump = more.w;
    m.anisotropy = uintBitsToFloat(last.x);
    m.anisotropy_rotation = uintBitsToFloat(last.y);
    m.id = last.z;
#ifdef HAS_SPECULAR
    m.texture_specular = last.w;
    uvec4 specular = texelFetch(tables, texel + 6);
    m.specular_red = uintBitsToFloat(specular.x);
    m.specular_green = uintBitsToFloat(specular.y);
    m.specular_blue = uintBitsToFloat(specular.z);
    m.specular = uintBitsToFloat(specular.w);
    m.texture_specular_colour = texelFetch(tables, texel + 7).x;
#endif
#ifdef HAS_TRANSMISSION
    vec4 body = uintBitsToFloat(texelFetch(tables, texel + 7));
    m.body_red = body.y;
    m.body_green = body.z;
    m.body_blue = body.w;
#endif
#ifdef HAS_VOLUME
    vec4 absorbs = uintBitsToFloat(texelFetch(tables, texel + 8));
    m.absorbs_red = absorbs.x;
    m.absorbs_green = absorbs.y;
    m.absorbs_blue = absorbs.z;
#endif
    return m;
}

texture_slot texture_slot_at(uint index)
{
    int texel = int(find_tables().texture_slots + index * TEXTURE_SLOT_TEXELS);
    uvec4 last = texelFetch(tables, texel + 1);
    return texture_slot(uintBitsToFloat(texelFetch(tables, texel)), uintBitsToFloat(last.x), uintBitsToFloat(last.y),
                        uintBitsToFloat(last.z), last.w);
}

texture_info texture_at(uint index)
{
    uvec4 words = texelFetch(tables, int(find_tables().textures + index));
    return texture_info(words.x, words.y, words.z, words.w);
}

disc disc_at(uint index)
{
    int texel = int(find_tables().discs + index * DISC_TEXELS);
    disc d;
    d.centre_radius = uintBitsToFloat(texelFetch(tables, texel));
    d.normal = uintBitsToFloat(texelFetch(tables, texel + 1));
    d.material = texelFetch(tables, texel + 2).x;
    return d;
}
