// SPDX-License-Identifier: MIT
// What the parts of a material are made from.
#ifndef FARLIGHT_IMPORT_GLTF_MATERIAL_HPP
#define FARLIGHT_IMPORT_GLTF_MATERIAL_HPP

#include "texture.hpp"

namespace gltf
{
struct building {
    reader &r;
    images &all;
    const tinygltf::Material &source;
    std::string where;
    message_set_material &set;
    record_texture_use *uses; // PROTOCOL_MATERIAL_COUNT of them
};

// What the extensions say that add layers to a material, or change its mirror or its body.
void extensions(const building &b);
} // namespace gltf

#endif
