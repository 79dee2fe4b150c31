// SPDX-License-Identifier: MIT
// Images of MTL: read once each, and what becomes of several of them together.
#ifndef FARLIGHT_IMPORT_OBJ_TEXTURE_HPP
#define FARLIGHT_IMPORT_OBJ_TEXTURE_HPP

#include "reader.hpp"

#include <cstdlib>
#include <memory>

namespace obj
{
struct free_bytes {
    void operator()(unsigned char *bytes) const
    {
        free(bytes);
    }
};

struct image {
    std::unique_ptr<unsigned char, free_bytes> texels; // the marker if it could not be had
    uint32_t width = 2, height = 2;
    bool has_alpha = false, marked = false;
};

struct building {
    import_scene *scene;
    const image_source &read_image;
    std::map<std::string, image> images;      // by file name
    std::map<std::string, uint32_t> textures; // by file name and use
};

// All that the materials name.
void read_images(building &b, const std::vector<const tinyobj::material_t *> &materials);

// Identifiers of textures, each of which is added once.
uint32_t plain_texture(building &b, const std::string &name, bool colour, bool clamp);
// Base colour with map_d as its alpha; without map_Kd it is white. *cutout: alpha is nearly only 0 or 1.
uint32_t alpha_texture(building &b, const tinyobj::material_t &m, bool &cutout);
// map_Pr in green and map_Pm in blue, as glTF has them.
uint32_t roughness_texture(building &b, const tinyobj::material_t &m);

// Many files call a normal map a bump map: it is bluish throughout, heights are grey.
bool looks_like_normals(const image &i);

// -o and -s; ours have v running downwards, hence the odd last term.
record_texture_use use_of(uint32_t texture, const tinyobj::texture_option_t &option, uint32_t texcoord_set);
} // namespace obj

#endif
