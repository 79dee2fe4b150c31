// SPDX-License-Identifier: MIT
#include "layers.hpp"

#include <algorithm>
#include <cstring>

namespace
{

enum class content { colour, exact, number };

struct layer_channel {
    enum protocol_layer layer;
    int component; // of the frame's four
    const char *name;
    enum content content;
};

// Names as other programs know them: "Technical Introduction to OpenEXR", Channel Names and Layers.
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
                               {PROTOCOL_LAYER_ID, 1, "id.material", content::number}};

constexpr float half_max = 65504.0f;
constexpr int band_rows = 64; // a multiple of the rows that are compressed together

OIIO::TypeDesc type_of(enum content content, bool half)
{
    if (content == content::number)
        return OIIO::TypeDesc::UINT32;
    return half && content == content::colour ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
}

std::vector<layer_channel> channels_of(unsigned layers)
{
    std::vector<layer_channel> channels;
    for (const layer_channel &each : known)
        if ((layers & 1u << each.layer) != 0)
            channels.push_back(each);
    return channels;
}

// Images come in the order of their layers' numbers.
size_t place_of(enum protocol_layer layer, unsigned layers)
{
    return static_cast<size_t>(__builtin_popcount(layers & ((1u << layer) - 1)));
}

// A whole number that came as a float; what is none becomes 0, which no object has.
uint32_t number_of(float value)
{
    return value >= 0 && value < 4294967040.0f ? static_cast<uint32_t>(value) : 0;
}

// One channel of one row into pixels that are `pixel_bytes` from each other.
void put_row(const float *from, size_t width, const layer_channel &channel, bool half, unsigned char *to,
             size_t pixel_bytes)
{
    for (size_t x = 0; x < width; x++, to += pixel_bytes) {
        float value = from[4 * x + static_cast<size_t>(channel.component)];
        const uint32_t number = number_of(value);
        if (channel.content == content::number) {
            std::memcpy(to, &number, sizeof(number));
        } else if (half && channel.content == content::colour) {
            value = std::clamp(value, -half_max, half_max); // as the renderer does for half floats
            OIIO::convert_types(OIIO::TypeDesc::FLOAT, &value, OIIO::TypeDesc::HALF, to, 1);
        } else {
            std::memcpy(to, &value, sizeof(value));
        }
    }
}

} // namespace

bool has_layers(const struct message_frame_begin &begin)
{
    return begin.layers != 1u << PROTOCOL_LAYER_BEAUTY;
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

void set_layer_channels(OIIO::ImageSpec &spec, unsigned layers, bool half)
{
    spec.channelnames.clear();
    spec.channelformats.clear();
    spec.alpha_channel = spec.z_channel = -1;
    for (const layer_channel &channel : channels_of(layers)) {
        const int index = static_cast<int>(spec.channelnames.size());
        spec.channelnames.emplace_back(channel.name);
        spec.channelformats.push_back(type_of(channel.content, half));
        if (std::strcmp(channel.name, "A") == 0)
            spec.alpha_channel = index;
        if (channel.layer == PROTOCOL_LAYER_DEPTH)
            spec.z_channel = index;
    }
    spec.nchannels = static_cast<int>(spec.channelnames.size());
}

bool write_layers(OIIO::ImageOutput &output, const struct image &image)
{
    const struct message_frame_begin &begin = *image.begin;
    const std::vector<layer_channel> channels = channels_of(begin.layers);
    const size_t width = begin.width, pixel_bytes = output.spec().pixel_bytes(true);
    std::vector<unsigned char> band(width * pixel_bytes * band_rows);
    for (uint32_t top = 0; top < begin.height; top += band_rows) {
        const uint32_t bottom = std::min(top + band_rows, begin.height);
        size_t offset = 0;
        for (size_t i = 0; i < channels.size(); i++) {
            const size_t rows_above = place_of(channels[i].layer, begin.layers) * begin.height;
            for (uint32_t y = top; y < bottom; y++) {
                const uint8_t *from = image.pixels + (rows_above + y) * width * 4 * sizeof(float);
                put_row(reinterpret_cast<const float *>(from), width, channels[i], image.half,
                        band.data() + (y - top) * width * pixel_bytes + offset, pixel_bytes);
            }
            offset += output.spec().channelformat(static_cast<int>(i)).size();
        }
        if (!output.write_scanlines(static_cast<int>(top), static_cast<int>(bottom), 0, OIIO::TypeDesc::UNKNOWN,
                                    band.data()))
            return false;
    }
    return true;
}
