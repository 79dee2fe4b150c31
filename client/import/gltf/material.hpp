// SPDX-License-Identifier: MIT
// The parts of a material under construction.
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
    record_texture_use *uses; // PROTOCOL_MATERIAL_COUNT elements
};

// Reads the extensions that add layers to a material, or change its mirror or its interior.
void extensions(const building &b);
} // namespace gltf

#endif
