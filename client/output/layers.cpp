// SPDX-License-Identifier: MIT
// Channels of EXR files for the layers of a frame.
#include "layers.hpp"
#include "mattes.hpp"

#include <Imath/half.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>

#include <algorithm>
#include <cstring>
#include <iterator>
#include <vector>

namespace
{

enum class content { colour, exact, number, object, material };

struct layer_channel {
    enum protocol_layer layer;
    int component; // index among the frame's four
    const char *name;
    enum content content;
};

// Names that other programs recognise: "Technical Introduction to OpenEXR", Channel Names and Layers.
const layer_channel known[] = {{PROTOCOL_LAYER_BEAUTY, 0, "R", content::colour},
                               {PROTOCOL_LAYER_BEAUTY, 1, "G", content::colour},
                               {PROTOCOL_LAYER_BEAUTY, 2, "B", content::colour},
                               {PROTOCOL_LAYER_BEAUTY, 3, "A", content::colour},
                               {PROTOCOL_LAYER_ALBEDO, 0, "albedo.R", content::colour},
                               {PROTOCOL_LAYER_ALBEDO, 1, "albedo.G", content::colour},
                               {PROTOCOL_LAYER_ALBEDO, 2, "albedo.B", content::colour},
                               {PROTOCOL_LAYER_NORMAL, 0, "normal.X", content::colour},
                               {PROTOCOL_LAYER_NORMAL, 1, "normal.Y", content::colour},
                               {PROTOCOL_LAYER_NORMAL, 2, "normal.Z", content::colour},
                               {PROTOCOL_LAYER_DEPTH, 0, "Z", content::exact},
                               {PROTOCOL_LAYER_POSITION, 0, "position.X", content::exact},
                               {PROTOCOL_LAYER_POSITION, 1, "position.Y", content::exact},
                               {PROTOCOL_LAYER_POSITION, 2, "position.Z", content::exact},
                               {PROTOCOL_LAYER_AO, 0, "ao.Y", content::colour},
                               {PROTOCOL_LAYER_ID, 0, "id.node", content::number},
                               {PROTOCOL_LAYER_ID, 1, "id.material", content::number},
                               {PROTOCOL_LAYER_UNKNOWN, 0, "unknown.Y", content::colour},
                               {PROTOCOL_LAYER_MOTION, 0, "forward.u", content::exact},
                               {PROTOCOL_LAYER_MOTION, 1, "forward.v", content::exact},
                               {PROTOCOL_LAYER_MOTION, 2, "backward.u", content::exact},
                               {PROTOCOL_LAYER_MOTION, 3, "backward.v", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT0, 0, "CryptoObject00.red", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT0, 1, "CryptoObject00.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT0, 2, "CryptoObject00.blue", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT0, 3, "CryptoObject00.alpha", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT1, 0, "CryptoObject01.red", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT1, 1, "CryptoObject01.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT1, 2, "CryptoObject01.blue", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT1, 3, "CryptoObject01.alpha", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT2, 0, "CryptoObject02.red", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT2, 1, "CryptoObject02.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT2, 2, "CryptoObject02.blue", content::object},
                               {PROTOCOL_LAYER_CRYPTO_OBJECT2, 3, "CryptoObject02.alpha", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL0, 0, "CryptoMaterial00.red", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL0, 1, "CryptoMaterial00.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL0, 2, "CryptoMaterial00.blue", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL0, 3, "CryptoMaterial00.alpha", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL1, 0, "CryptoMaterial01.red", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL1, 1, "CryptoMaterial01.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL1, 2, "CryptoMaterial01.blue", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL1, 3, "CryptoMaterial01.alpha", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL2, 0, "CryptoMaterial02.red", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL2, 1, "CryptoMaterial02.green", content::exact},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL2, 2, "CryptoMaterial02.blue", content::material},
                               {PROTOCOL_LAYER_CRYPTO_MATERIAL2, 3, "CryptoMaterial02.alpha", content::exact},
                               {PROTOCOL_LAYER_DIFFUSE_DIRECT, 0, "diffuse_direct.R", content::colour},
                               {PROTOCOL_LAYER_DIFFUSE_DIRECT, 1, "diffuse_direct.G", content::colour},
                               {PROTOCOL_LAYER_DIFFUSE_DIRECT, 2, "diffuse_direct.B", content::colour},
                               {PROTOCOL_LAYER_DIFFUSE_INDIRECT, 0, "diffuse_indirect.R", content::colour},
                               {PROTOCOL_LAYER_DIFFUSE_INDIRECT, 1, "diffuse_indirect.G", content::colour},
                               {PROTOCOL_LAYER_DIFFUSE_INDIRECT, 2, "diffuse_indirect.B", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_DIRECT, 0, "specular_direct.R", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_DIRECT, 1, "specular_direct.G", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_DIRECT, 2, "specular_direct.B", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_INDIRECT, 0, "specular_indirect.R", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_INDIRECT, 1, "specular_indirect.G", content::colour},
                               {PROTOCOL_LAYER_SPECULAR_INDIRECT, 2, "specular_indirect.B", content::colour},
                               {PROTOCOL_LAYER_TRANSMISSION, 0, "transmission.R", content::colour},
                               {PROTOCOL_LAYER_TRANSMISSION, 1, "transmission.G", content::colour},
                               {PROTOCOL_LAYER_TRANSMISSION, 2, "transmission.B", content::colour},
                               {PROTOCOL_LAYER_EMISSION, 0, "emission.R", content::colour},
                               {PROTOCOL_LAYER_EMISSION, 1, "emission.G", content::colour},
                               {PROTOCOL_LAYER_EMISSION, 2, "emission.B", content::colour},
                               {PROTOCOL_LAYER_BACKGROUND, 0, "background.R", content::colour},
                               {PROTOCOL_LAYER_BACKGROUND, 1, "background.G", content::colour},
                               {PROTOCOL_LAYER_BACKGROUND, 2, "background.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_REST, 0, "light_rest.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_REST, 1, "light_rest.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_REST, 2, "light_rest.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP1, 0, "light_group1.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP1, 1, "light_group1.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP1, 2, "light_group1.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP2, 0, "light_group2.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP2, 1, "light_group2.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP2, 2, "light_group2.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP3, 0, "light_group3.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP3, 1, "light_group3.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP3, 2, "light_group3.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP4, 0, "light_group4.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP4, 1, "light_group4.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP4, 2, "light_group4.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP5, 0, "light_group5.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP5, 1, "light_group5.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP5, 2, "light_group5.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP6, 0, "light_group6.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP6, 1, "light_group6.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP6, 2, "light_group6.B", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP7, 0, "light_group7.R", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP7, 1, "light_group7.G", content::colour},
                               {PROTOCOL_LAYER_LIGHT_GROUP7, 2, "light_group7.B", content::colour}};

constexpr float half_max = 65504.0f;
constexpr int band_rows = 64; // a multiple of the rows that are compressed together

Imf::PixelType type_of(enum content content, bool half_floats)
{
    if (content == content::number)
        return Imf::UINT;
    return half_floats && content == content::colour ? Imf::HALF : Imf::FLOAT;
}

size_t size_of(Imf::PixelType type)
{
    return type == Imf::HALF ? sizeof(half) : sizeof(float);
}

bool is_colour(const layer_channel &channel)
{
    return std::strchr("RGBA", channel.name[std::strlen(channel.name) - 1]) != nullptr;
}

std::vector<layer_channel> channels_of(unsigned layers, enum exr_part part)
{
    std::vector<layer_channel> channels;
    for (const layer_channel &each : known)
        if ((layers & 1u << each.layer) != 0 &&
            (part == exr_part::whole || is_colour(each) == (part == exr_part::colours)))
            channels.push_back(each);
    return channels;
}

// Name of the channel in the file; light groups may have names of their own.
std::string name_of(const struct image &image, const layer_channel &channel)
{
    std::string names = image.light_groups ? image.light_groups : "";
    for (int group = PROTOCOL_LAYER_LIGHT_GROUP1; group < channel.layer && !names.empty(); group++)
        names = names.find(',') != std::string::npos ? names.substr(names.find(',') + 1) : "";
    const std::string name = names.substr(0, names.find(','));
    if (channel.layer < PROTOCOL_LAYER_LIGHT_GROUP1 || name.empty())
        return channel.name;
    return "light_" + name + std::strrchr(channel.name, '.');
}

// Images come in the order of their layers' numbers.
size_t place_of(enum protocol_layer layer, unsigned layers)
{
    return static_cast<size_t>(__builtin_popcount(layers & ((1u << layer) - 1)));
}

// Converts a whole number that is stored as a float; others become 0, which no object has.
uint32_t number_of(float value)
{
    return value >= 0 && value < 4294967040.0f ? static_cast<uint32_t>(value) : 0;
}

// Reads a component of a pixel as a float; `pixels` have this format.
float component(enum protocol_pixel_format format, const void *pixels, size_t index)
{
    switch (format) {
    case PROTOCOL_PIXEL_FORMAT_RGBA16F:
        return static_cast<const half *>(pixels)[index];
    case PROTOCOL_PIXEL_FORMAT_RGBA32F:
        return static_cast<const float *>(pixels)[index];
    default:
        return static_cast<float>(static_cast<const uint8_t *>(pixels)[index]) * (1 / 255.0f);
    }
}

// Identifiers in the file are hashes of names, stored as floats with the same bits.
float matte_of(const struct image &image, enum content content, float value)
{
    const bool is_object = content == content::object, is_material = content == content::material;
    if (!is_object && !is_material)
        return value;
    return matte_identifier(image.mattes, is_object ? PROTOCOL_OBJECT_NODE : PROTOCOL_OBJECT_MATERIAL,
                            number_of(value));
}

// Writes a channel of a row whose first pixel is `first`.
void put_row(const struct image &image, size_t first, const layer_channel &channel, Imf::PixelType type, char *to)
{
    for (size_t x = 0; x < image.begin->width; x++, to += size_of(type)) {
        const float stored =
            component(image.begin->format, image.pixels, 4 * (first + x) + static_cast<size_t>(channel.component));
        const float value = matte_of(image, channel.content, stored);
        const uint32_t number = number_of(stored);
        const half rounded(std::clamp(value, -half_max, half_max)); // rounded as the renderer does
        if (type == Imf::UINT)
            std::memcpy(to, &number, sizeof(number));
        else if (type == Imf::HALF)
            std::memcpy(to, &rounded, sizeof(rounded));
        else
            std::memcpy(to, &value, sizeof(value));
    }
}

} // namespace

bool has_layers(const struct message_frame_begin &begin)
{
    return begin.layers != 1u << PROTOCOL_LAYER_BEAUTY;
}

struct image_window window_of(const struct image &image)
{
    const struct message_frame_begin &begin = *image.begin;
    const struct image_window &told = image.window;
    const bool holds = told.x + begin.width <= told.width && told.y + begin.height <= told.height;
    return holds ? told : image_window{0, 0, begin.width, begin.height};
}

std::string layer_names(unsigned layers)
{
    std::string names;
    for (unsigned layer = 0; layer < PROTOCOL_LAYER_COUNT; layer++)
        if ((layers & 1u << layer) != 0)
            names +=
                (names.empty() ? "" : ",") + std::string(protocol_layer_text(static_cast<protocol_layer>(layer)));
    return names;
}

bool is_colour_layer(enum protocol_layer layer)
{
    return std::any_of(std::begin(known), std::end(known),
                       [=](const layer_channel &each) { return each.layer == layer && is_colour(each); });
}

Imf::ChannelList channels_of_part(const struct image &image, enum exr_part part)
{
    Imf::ChannelList channels;
    for (const layer_channel &channel : channels_of(image.begin->layers, part))
        channels.insert(name_of(image, channel), Imf::Channel(type_of(channel.content, image.half)));
    return channels;
}

template <typename output> void write_rows(output &file, const struct image &image, enum exr_part part)
{
    const struct message_frame_begin &begin = *image.begin;
    const size_t width = begin.width;
    const struct image_window whole = window_of(image);
    for (uint32_t top = 0; top < begin.height; top += band_rows) {
        const uint32_t rows = std::min<uint32_t>(band_rows, begin.height - top);
        Imf::FrameBuffer buffer;
        std::vector<std::vector<char>> planes;
        for (const layer_channel &channel : channels_of(begin.layers, part)) {
            const Imf::PixelType type = type_of(channel.content, image.half);
            const size_t row_bytes = width * size_of(type);
            const size_t first_row = place_of(channel.layer, begin.layers) * begin.height + top;
            std::vector<char> plane(row_bytes * rows);
            for (size_t y = 0; y < rows; y++)
                put_row(image, (first_row + y) * width, channel, type, plane.data() + y * row_bytes);
            buffer.insert(name_of(image, channel),
                          Imf::Slice::Make(type, plane.data(),
                                           Imath::V2i(static_cast<int>(whole.x), static_cast<int>(whole.y + top)),
                                           static_cast<int64_t>(width), rows, size_of(type), row_bytes));
            planes.push_back(std::move(plane)); // keeps the memory that the slice points to
        }
        file.setFrameBuffer(buffer);
        file.writePixels(static_cast<int>(rows));
    }
}

template void write_rows(Imf::OutputFile &, const struct image &, enum exr_part);
template void write_rows(Imf::OutputPart &, const struct image &, enum exr_part);
