// SPDX-License-Identifier: MIT
// Textures of materials: images that are decoded side by side, and where they lie on a surface.
#ifndef FARLIGHT_IMPORT_GLTF_TEXTURE_HPP
#define FARLIGHT_IMPORT_GLTF_TEXTURE_HPP

#include "reader.hpp"
#include "gloss.hpp"
#include "import/image/texture.h"

namespace gltf
{
// By image and whether it holds colour.
using image_key = std::pair<int, bool>;

struct images {
    std::map<image_key, size_t> numbers; // position in jobs
    std::vector<texture_job> jobs;
    std::vector<uint32_t> blobs; // by job: 0 until its texels are used as they are
    bool collecting = true;

    ~images()
    {
        for (const texture_job &job : jobs)
            free(job.texels);
    }
};

struct texture_source {
    int index = -1, texcoord = 0;
    double strength = 1;
    const tinygltf::ExtensionMap *extensions = nullptr;
    const tinygltf::Value *value = nullptr; // for textures that stand in an extension
};

texture_source source_of(const tinygltf::TextureInfo &info);
// Of an extension.
texture_source source_of(const tinygltf::Value &object, const char *key);

// The image of a texture, -1 if it has none that could be shown.
int image_of(reader &r, int texture, const std::string &where);
void want_image(reader &r, images &all, int image, bool colour);
// An image that cannot be decoded is shown in a conspicuous colour.
void decode_images(reader &r, images &all);
gloss_image texels_of(const reader &r, const images &all, size_t number);

std::string texture_name(const reader &r, int texture, int image);
// A texture that is sampled as the file's; its size, whether it is sampled at the nearest texel and its texels are
// those given.
uint32_t add_texture(reader &r, int texture, const std::string &name, bool colour, message_set_texture set,
                     uint32_t blob);
// Where the texture lies on the surface, and how strong it is.
void place_texture(reader &r, const texture_source &source, uint32_t texture, record_texture_use &use,
                   const std::string &where);
// While images are collected: notes that this one is wanted. Then: the texture of it.
void use_texture(reader &r, images &all, const texture_source &source, bool colour, record_texture_use &use,
                 const std::string &where);
} // namespace gltf

#endif
