// SPDX-License-Identifier: MIT
// Textures of materials: images, decoded in parallel, and their placement on a surface.
#ifndef FARLIGHT_IMPORT_GLTF_TEXTURE_HPP
#define FARLIGHT_IMPORT_GLTF_TEXTURE_HPP

#include "reader.hpp"
#include "gloss.hpp"
#include "import/image/texture.h"

namespace gltf
{
// Image, and whether it holds colour.
using image_key = std::pair<int, bool>;

struct images {
    std::map<image_key, size_t> numbers; // index in jobs
    std::vector<texture_job> jobs;
    std::vector<uint32_t> blobs; // blobs by job; 0: its texels are not used unchanged yet
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
    const tinygltf::Value *value = nullptr; // for textures within an extension
};

texture_source source_of(const tinygltf::TextureInfo &info);
// Reads the texture of an extension.
texture_source source_of(const tinygltf::Value &object, const char *key);

// The image of a texture; -1: it has none that can be shown.
int image_of(reader &r, int texture, const std::string &where);
void want_image(reader &r, images &all, int image, bool colour);
// Decodes the collected images; a conspicuous colour replaces one that cannot be decoded.
void decode_images(reader &r, images &all);
gloss_image texels_of(const reader &r, const images &all, size_t number);

std::string texture_name(const reader &r, int texture, int image);
// Adds a texture with the file's sampler; size, filter and texels are the given ones.
uint32_t add_texture(reader &r, int texture, const std::string &name, bool colour, message_set_texture set,
                     uint32_t blob);
// Sets the texture's placement on the surface, and its strength.
void place_texture(reader &r, const texture_source &source, uint32_t texture, record_texture_use &use,
                   const std::string &where);
// Collects the image during the first visit; sets the texture during the second.
void use_texture(reader &r, images &all, const texture_source &source, bool colour, record_texture_use &use,
                 const std::string &where);
} // namespace gltf

#endif
