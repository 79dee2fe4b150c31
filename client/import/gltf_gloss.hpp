// SPDX-License-Identifier: MIT
// KHR_materials_pbrSpecularGlossiness as metallic and roughness: the conversion of Khronos' samples
// (glTF/extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness, examples/convert-between-workflows), by which
// both reflect the same at normal incidence, as far as they can.
#ifndef FARLIGHT_IMPORT_GLTF_GLOSS_HPP
#define FARLIGHT_IMPORT_GLTF_GLOSS_HPP

#include <cstddef>
#include <cstdint>

namespace gltf
{
// Linear.
struct specular_gloss {
    double diffuse[3], alpha, specular[3], glossiness;
};
struct metal_rough {
    double base[3], alpha, metallic, roughness;
};
metal_rough metal_of(const specular_gloss &from);

// Texels of 4 bytes, colours sRGB-encoded; null: white.
struct gloss_image {
    const unsigned char *texels;
    uint32_t width, height;
};
// Writes width x height texels of the base colour (sRGB-encoded, alpha) and of roughness (green) and metallic
// (blue). Images of another size are read at the nearest texel. The factors multiply what the images have.
void metal_texels(const specular_gloss &factors, const gloss_image &diffuse, const gloss_image &specular,
                  uint32_t width, uint32_t height, unsigned char *base, unsigned char *rough);
} // namespace gltf

#endif
