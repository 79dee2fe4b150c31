// SPDX-License-Identifier: MIT
// Images of MTL, read once each, and their combinations.
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
    std::unique_ptr<unsigned char, free_bytes> texels; // the marker for an unreadable image
    uint32_t width = 2, height = 2;
    bool has_alpha = false, marked = false;
};

struct building {
    import_scene *scene;
    const image_source &read_image;
    std::map<std::string, image> images;      // by file name
    std::map<std::string, uint32_t> textures; // by file name and use
};

// Reads all images that the materials use.
void read_images(building &b, const std::vector<const tinyobj::material_t *> &materials);

// Return identifiers of textures, each of which is added once.
uint32_t plain_texture(building &b, const std::string &name, bool colour, bool clamp);
// Adds the base colour with map_d as its alpha; without map_Kd it is white. *cutout: alpha is nearly always 0 or
// 1.
uint32_t alpha_texture(building &b, const tinyobj::material_t &m, bool &cutout);
// Combines map_Pr in green and map_Pm in blue, as in glTF.
uint32_t roughness_texture(building &b, const tinyobj::material_t &m);

// Detects normal maps, which many files call bump maps: normals are bluish throughout, heights are grey.
bool looks_like_normals(const image &i);

// Applies -o and -s; our v points downwards, hence the odd last term.
record_texture_use use_of(uint32_t texture, const tinyobj::texture_option_t &option, uint32_t texcoord_set);
} // namespace obj

#endif
