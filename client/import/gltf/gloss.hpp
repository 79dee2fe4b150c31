// SPDX-License-Identifier: MIT
// KHR_materials_pbrSpecularGlossiness as metallic and roughness. What is rather a dielectric becomes one whose
// mirror has another strength and colour (KHR_materials_specular), which is exact. What is rather a metal goes by
// the conversion of Khronos' samples (glTF/extensions/2.0/Archived/KHR_materials_pbrSpecularGlossiness,
// examples/convert-between-workflows), by which both reflect the same at normal incidence, as far as they can:
// rough facets of metals lose no light.
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
    double mirror[3]; // of its dielectric share, at normal incidence
};
constexpr double plain_mirror = 0.04; // of a dielectric of glTF's usual index
metal_rough metal_of(const specular_gloss &from);

// Texels of 4 bytes, colours sRGB-encoded; null: white.
struct gloss_image {
    const unsigned char *texels;
    uint32_t width, height;
};
// Where the texels of converted images go, width x height of each: the base colour (sRGB-encoded, alpha),
// roughness (green) and metallic (blue), and what the dielectric share mirrors (sRGB-encoded).
struct metal_images {
    uint32_t width, height;
    unsigned char *base, *rough, *mirror;
};
// Images of another size are read at the nearest texel. The factors multiply what the images have.
void metal_texels(const specular_gloss &factors, const gloss_image &diffuse, const gloss_image &specular,
                  const metal_images &to);
} // namespace gltf

#endif
