// SPDX-License-Identifier: MIT
#include "tiff_encode.hpp"
#include "protocol/version.h"

#include <zlib.h>

#include <stdexcept>

namespace
{

enum type : uint16_t { ASCII = 2, SHORT = 3, LONG = 4 };

struct entry {
    uint16_t tag;
    enum type type;
    uint32_t count, value; // or where the values are
};

void put16(std::vector<uint8_t> &file, uint32_t value)
{
    file.push_back(uint8_t(value));
    file.push_back(uint8_t(value >> 8));
}

void put32(std::vector<uint8_t> &file, uint32_t value)
{
    put16(file, value & 0xffff);
    put16(file, value >> 16);
}

// Behind what is there already, at an even place; its offset.
uint32_t append(std::vector<uint8_t> &file, const void *bytes, size_t count)
{
    const uint8_t *from = static_cast<const uint8_t *>(bytes);
    if (file.size() % 2)
        file.push_back(0);
    const uint32_t offset = uint32_t(file.size());
    file.insert(file.end(), from, from + count);
    return offset;
}

// Each component as its difference from that of the pixel to the left, deflated.
std::vector<uint8_t> packed(const struct raster &raster)
{
    const size_t row_bytes = size_t(raster.width) * raster.channels;
    const uint8_t *from = static_cast<const uint8_t *>(raster.pixels);
    std::vector<uint8_t> plain(from, from + row_bytes * raster.height);
    for (size_t y = 0; y < raster.height; y++)
        for (size_t i = row_bytes; i-- > raster.channels;)
            plain[y * row_bytes + i] =
                uint8_t(plain[y * row_bytes + i] - plain[y * row_bytes + i - raster.channels]);
    std::vector<uint8_t> strip(compressBound(uLong(plain.size())));
    uLongf bytes = uLongf(strip.size());
    if (compress(strip.data(), &bytes, plain.data(), uLong(plain.size())) != Z_OK)
        throw std::runtime_error("the picture cannot be compressed");
    strip.resize(bytes);
    return strip;
}

} // namespace

std::vector<uint8_t> tiff_encode(const struct raster &raster, const std::string &description,
                                 const std::string &date)
{
    std::vector<uint8_t> file = {'I', 'I', 42, 0, 0, 0, 0, 0};
    const std::vector<uint8_t> strip = packed(raster), bits = {8, 0, 8, 0, 8, 0, 8, 0};
    std::vector<entry> entries;
    const auto add_text = [&](uint16_t tag, const std::string &text) {
        if (text.size() > 3) // shorter ones would have to stand in the entry
            entries.push_back(
                {tag, ASCII, uint32_t(text.size() + 1), append(file, text.c_str(), text.size() + 1)});
    };
    entries.push_back({256, LONG, 1, raster.width});
    entries.push_back({257, LONG, 1, raster.height});
    entries.push_back({258, SHORT, raster.channels, append(file, bits.data(), 2 * raster.channels)});
    entries.push_back({259, SHORT, 1, 8}); // deflate
    entries.push_back({262, SHORT, 1, 2}); // RGB
    add_text(270, description);
    entries.push_back({273, LONG, 1, append(file, strip.data(), strip.size())});
    entries.push_back({277, SHORT, 1, raster.channels});
    entries.push_back({278, LONG, 1, raster.height}); // rows of a strip
    entries.push_back({279, LONG, 1, uint32_t(strip.size())});
    add_text(305, "farlight " FARLIGHT_VERSION);
    add_text(306, date);
    entries.push_back({317, SHORT, 1, 2}); // differences
    if (raster.channels == 4)
        entries.push_back({338, SHORT, 1, 2}); // straight alpha
    const uint32_t directory = append(file, nullptr, 0);
    put16(file, uint32_t(entries.size()));
    for (const entry &each : entries) {
        put16(file, each.tag);
        put16(file, each.type);
        put32(file, each.count);
        put32(file, each.value); // a SHORT is in the lower half, first in the file
    }
    put32(file, 0); // no further directory
    for (unsigned i = 0; i < 4; i++)
        file[4 + i] = uint8_t(directory >> 8 * i);
    return file;
}
