// SPDX-License-Identifier: MIT
// Conversion of KHR_materials_pbrSpecularGlossiness to metallic and roughness. Materials that are mostly
// dielectric become dielectrics with a mirror of another strength and colour (KHR_materials_specular), which is
// exact. Metallic ones are converted as in Khronos' samples
// (glTF/extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness, examples/convert-between-workflows), which
// preserves reflection at normal incidence as far as possible: rough facets of metals lose no light.
#ifndef FARLIGHT_IMPORT_GLTF_GLOSS_HPP
#define FARLIGHT_IMPORT_GLTF_GLOSS_HPP

#include <cstddef>
#include <cstdint>

namespace gltf
{
// Linear values.
struct specular_gloss {
    double diffuse[3], alpha, specular[3], glossiness;
};
struct metal_rough {
    double base[3], alpha, metallic, roughness;
    double mirror[3]; // mirror of the dielectric share, at normal incidence
};
constexpr double plain_mirror = 0.04; // reflectance of a dielectric with glTF's default index
metal_rough metal_of(const specular_gloss &from);

// Texels of 4 bytes, colours sRGB-encoded; null: white.
struct gloss_image {
    const unsigned char *texels;
    uint32_t width, height;
};
// Destinations of converted images, width x height texels each: the base colour (sRGB-encoded, alpha), roughness
// (green) and metallic (blue), and the dielectric share's mirror (sRGB-encoded).
struct metal_images {
    uint32_t width, height;
    unsigned char *base, *rough, *mirror;
};
// Converts texels. An image of another size is read at the nearest texel. The factors multiply the images.
void metal_texels(const specular_gloss &factors, const gloss_image &diffuse, const gloss_image &specular,
                  const metal_images &to);
} // namespace gltf

#endif
