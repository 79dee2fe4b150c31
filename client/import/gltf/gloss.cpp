// SPDX-License-Identifier: MIT
// Conversion of specular and glossiness to metallic and roughness.
#include "gloss.hpp"

#include "protocol/common/srgb.h"

#include <algorithm>
#include <cmath>

namespace gltf
{
namespace
{
constexpr double dielectric = plain_mirror;

double clamped(double value)
{
    return std::min(std::max(value, 0.0), 1.0);
}

// Perceived brightness, with the conversion's weights of colours.
double brightness(const double colour[3])
{
    return std::sqrt(0.299 * colour[0] * colour[0] + 0.587 * colour[1] * colour[1] +
                     0.114 * colour[2] * colour[2]);
}

// Metallic as the root of the quadratic equation for equal reflection.
double metallic_of(double diffuse, double specular, double rest)
{
    if (specular < dielectric)
        return 0;
    const double b = diffuse * rest / (1 - dielectric) + specular - 2 * dielectric;
    const double discriminant = b * b - 4 * dielectric * (dielectric - specular);
    return clamped((-b + std::sqrt(std::max(discriminant, 0.0))) / (2 * dielectric));
}

unsigned char byte_of(double value)
{
    return static_cast<unsigned char>(std::lround(clamped(value) * 255));
}

const unsigned char *texel_at(const gloss_image &image, uint32_t x, uint32_t y, uint32_t width, uint32_t height)
{
    static const unsigned char white[4] = {255, 255, 255, 255};

    if (!image.texels)
        return white;
    const size_t column = size_t(uint64_t(x) * image.width / width),
                 row = size_t(uint64_t(y) * image.height / height);
    return image.texels + (row * image.width + column) * 4;
}
} // namespace

metal_rough metal_of(const specular_gloss &from)
{
    const double strongest = std::max({from.specular[0], from.specular[1], from.specular[2]});
    const double rest = 1 - strongest, tiny = 1e-6;
    const double metallic = metallic_of(brightness(from.diffuse), brightness(from.specular), rest);
    metal_rough to = {{0, 0, 0}, from.alpha, metallic, 1 - from.glossiness, {dielectric, dielectric, dielectric}};

    if (metallic < 0.5) {
        // In the file's model, the mirror's strongest channel attenuates all channels of the diffuse colour.
        to.metallic = 0;
        for (size_t c = 0; c < 3; c++) {
            to.base[c] = clamped(from.diffuse[c] * rest / std::max(1 - from.specular[c], tiny));
            to.mirror[c] = from.specular[c];
        }
        return to;
    }

    for (size_t c = 0; c < 3; c++) {
        const double of_diffuse = from.diffuse[c] * rest / (1 - dielectric) / std::max(1 - metallic, tiny);
        const double of_specular = (from.specular[c] - dielectric * (1 - metallic)) / std::max(metallic, tiny);
        to.base[c] = clamped(of_diffuse + (of_specular - of_diffuse) * metallic * metallic);
    }
    return to;
}

void metal_texels(const specular_gloss &factors, const gloss_image &diffuse, const gloss_image &specular,
                  const metal_images &to)
{
    unsigned char *base = to.base, *rough = to.rough, *mirror = to.mirror;
    double linear[256];

    for (size_t i = 0; i < 256; i++)
        linear[i] = double(linear_from_srgb_f(float(i) / 255));
    for (uint32_t y = 0; y < to.height; y++)
        for (uint32_t x = 0; x < to.width; x++, base += 4, rough += 4, mirror += 4) {
            const unsigned char *d = texel_at(diffuse, x, y, to.width, to.height),
                                *s = texel_at(specular, x, y, to.width, to.height);
            specular_gloss one = factors;
            for (size_t c = 0; c < 3; c++) {
                one.diffuse[c] *= linear[d[c]];
                one.specular[c] *= linear[s[c]];
            }
            one.alpha *= d[3] / 255.0;
            one.glossiness *= s[3] / 255.0;
            const metal_rough metal = metal_of(one);
            for (size_t c = 0; c < 3; c++) {
                base[c] = byte_of(double(srgb_from_linear_f(float(metal.base[c]))));
                mirror[c] = byte_of(double(srgb_from_linear_f(float(metal.mirror[c]))));
            }
            base[3] = byte_of(metal.alpha);
            mirror[3] = 255;
            rough[0] = rough[3] = 255;
            rough[1] = byte_of(metal.roughness);
            rough[2] = byte_of(metal.metallic);
        }
}
} // namespace gltf
