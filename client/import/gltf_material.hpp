// SPDX-License-Identifier: MIT
// What the parts of a material are made from.
#ifndef FARLIGHT_IMPORT_GLTF_MATERIAL_HPP
#define FARLIGHT_IMPORT_GLTF_MATERIAL_HPP

#include "gltf_texture.hpp"

namespace gltf
{
// By position in the message set_material.
enum slot {
    BASE_COLOUR,
    NORMAL,
    METALLIC_ROUGHNESS,
    OCCLUSION,
    EMISSION,
    TRANSMISSION,
    SPECULAR = 7,
    SPECULAR_COLOUR,
    CLEARCOAT,
    CLEARCOAT_ROUGHNESS,
    CLEARCOAT_NORMAL,
    SHEEN,
    SHEEN_ROUGHNESS,
    IRIDESCENCE,
    IRIDESCENCE_THICKNESS,
    DIFFUSE_TRANSMISSION,
    DIFFUSE_TRANSMISSION_COLOUR,
    ANISOTROPY,
    slot_count
};

struct building {
    reader &r;
    images &all;
    const tinygltf::Material &source;
    std::string where;
    message_set_material &set;
    record_texture_use *uses; // slot_count of them
};

// What the extensions say that add layers to a material, or change its mirror or its body.
void extensions(const building &b);
} // namespace gltf

#endif
