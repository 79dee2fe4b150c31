// SPDX-License-Identifier: MIT
// Small tables of a scene in one texel buffer, which gpu_scene_bind() binds. Layout: shared/tables.h. Structs are in
// texels, as software GL reads a storage buffer a word and a lane at a time; texels with unused members only are not
// fetched.
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
#ifdef HAS_ANISOTROPY_MAP
    m.texture_anisotropy = texelFetch(tables, texel + 8).w;
#endif
#ifdef HAS_CLEARCOAT
    uvec4 coat = texelFetch(tables, texel + 9);
    m.clearcoat = uintBitsToFloat(coat.x);
    m.clearcoat_roughness = uintBitsToFloat(coat.y);
    m.texture_clearcoat = coat.z;
    m.texture_clearcoat_roughness = coat.w;
#endif
#if defined(HAS_CLEARCOAT) || defined(HAS_IRIDESCENCE) || defined(HAS_DISPERSION)
    uvec4 several = texelFetch(tables, texel + 10);
    m.texture_clearcoat_normal = several.x;
    m.texture_iridescence = several.y;
    m.texture_iridescence_thickness = several.z;
    m.dispersion = uintBitsToFloat(several.w);
#endif
#ifdef HAS_IRIDESCENCE
    vec4 film = uintBitsToFloat(texelFetch(tables, texel + 11));
    m.iridescence = film.x;
    m.iridescence_ior = film.y;
    m.iridescence_minimum = film.z;
    m.iridescence_maximum = film.w;
#endif
#ifdef HAS_SHEEN
    vec4 sheen = uintBitsToFloat(texelFetch(tables, texel + 12));
    m.sheen_red = sheen.x;
    m.sheen_green = sheen.y;
    m.sheen_blue = sheen.z;
    m.sheen_roughness = sheen.w;
#endif
#if defined(HAS_SHEEN) || defined(HAS_DIFFUSE_TRANSMISSION)
    uvec4 cloth = texelFetch(tables, texel + 13);
    m.texture_sheen = cloth.x;
    m.texture_sheen_roughness = cloth.y;
    m.texture_diffuse_transmission = cloth.z;
    m.texture_diffuse_transmission_colour = cloth.w;
#endif
#ifdef HAS_DIFFUSE_TRANSMISSION
    vec4 diffuse = uintBitsToFloat(texelFetch(tables, texel + 14));
    m.diffuse_red = diffuse.x;
    m.diffuse_green = diffuse.y;
    m.diffuse_blue = diffuse.z;
    m.diffuse_transmission = diffuse.w;
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
