// SPDX-License-Identifier: MIT
// Encoding of frames and pictures as image files, by format.
#include "image.h"
#include "exr_encode.hpp"
#include "jpeg_encode.h"
#include "layers.hpp"
#include "library.h"
#include "metadata.hpp"
#include "png_encode.h"
#include "protocol/version.h"

#include <Imath/half.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <exception>
#include <string>
#include <strings.h>
#include <utility>
#include <vector>

namespace
{

struct known_format {
    enum image_format format;
    const char *endings[2];
};

const known_format known[] = {{IMAGE_PNG, {"png", nullptr}},   {IMAGE_JPEG, {"jpg", "jpeg"}},
                              {IMAGE_EXR, {"exr", nullptr}},   {IMAGE_HDR, {"hdr", nullptr}},
                              {IMAGE_WEBP, {"webp", nullptr}}, {IMAGE_TIFF, {"tiff", "tif"}},
                              {IMAGE_GIF, {"gif", nullptr}}};

enum image_format format_by_ending(const char *ending)
{
    for (const known_format &each : known)
        for (const char *name : each.endings)
            if (name && strcasecmp(name, ending) == 0)
                return each.format;
    return IMAGE_UNKNOWN;
}

bool fail(char *reason, size_t reason_bytes, const char *text)
{
    std::snprintf(reason, reason_bytes, "%s", text);
    return false;
}

uint8_t byte_of(float value)
{
    return value > 0 ? static_cast<uint8_t>(std::min(value, 1.0f) * 255.0f + 0.5f) : 0; // NaN becomes 0
}

std::vector<uint8_t> bytes_of(const struct raster &raster)
{
    const size_t count = size_t(raster.width) * raster.height * raster.channels;
    std::vector<uint8_t> bytes(count);
    if (raster.component_bytes == sizeof(float))
        std::transform(static_cast<const float *>(raster.pixels),
                       static_cast<const float *>(raster.pixels) + count, bytes.begin(), byte_of);
    else
        std::transform(static_cast<const half *>(raster.pixels), static_cast<const half *>(raster.pixels) + count,
                       bytes.begin(), byte_of);
    return bytes;
}

// Converts components to bytes; `bytes` stores them if a conversion is needed.
struct raster as_bytes(const struct raster &raster, std::vector<uint8_t> &bytes)
{
    if (raster.component_bytes == 1)
        return raster;
    bytes = bytes_of(raster);
    return {raster.width, raster.height, raster.channels, 1, bytes.data()};
}

// Writes a PNG with the entries that all our files have, then `texts`.
bool write_png(const struct raster &raster, const std::vector<std::pair<std::string, std::string>> &texts,
               const std::tm *date, bool other_display, uint8_t **file, size_t *file_bytes, char *reason,
               size_t reason_bytes)
{
    std::vector<png_text> all = {{"Software", "farlight " FARLIGHT_VERSION}};
    if (!other_display)
        all.insert(all.begin(), {"oiio:ColorSpace", "sRGB"});
    std::vector<uint8_t> bytes;
    for (const auto &each : texts)
        all.push_back({each.first.c_str(), each.second.c_str()});
    const struct png png = {raster.width,
                            raster.height,
                            raster.channels,
                            other_display,
                            static_cast<const uint8_t *>(as_bytes(raster, bytes).pixels),
                            all.data(),
                            all.size(),
                            date};
    return png_encode(&png, file, file_bytes, reason, reason_bytes);
}

bool write_jpeg(const struct raster &raster, unsigned quality, const char *description, const char *date,
                uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    std::vector<uint8_t> bytes;
    const struct jpeg jpeg = {as_bytes(raster, bytes), quality, description, date};
    return jpeg_encode(&jpeg, file, file_bytes, reason, reason_bytes);
}

bool copy_out(const std::vector<uint8_t> &made, uint8_t **file, size_t *file_bytes, char *reason,
              size_t reason_bytes)
{
    *file = static_cast<uint8_t *>(std::malloc(made.size()));
    if (!*file)
        return fail(reason, reason_bytes, "out of memory");
    std::memcpy(*file, made.data(), made.size());
    *file_bytes = made.size();
    return true;
}

bool write_with_library(const struct library_image &image, uint8_t **file, size_t *file_bytes, char *reason,
                        size_t reason_bytes)
{
    const struct image_library *library = library_loaded(reason, reason_bytes);
    return library && library->encode(&image, file, file_bytes, reason, reason_bytes);
}

std::tm now()
{
    const std::time_t seconds = std::time(nullptr);
    std::tm parts = {};
    localtime_r(&seconds, &parts);
    return parts;
}

std::string date_text(const std::tm &date)
{
    char text[32] = "";
    std::strftime(text, sizeof(text), "%Y:%m:%d %H:%M:%S", &date);
    return text;
}

bool write_frame(const struct image &image, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    const struct message_frame_begin &begin = *image.begin;
    std::vector<uint8_t> bytes;
    struct raster raster = {begin.width, begin.height, 4, protocol_pixel_format_bytes(begin.format) / 4,
                            image.pixels};
    const std::tm date = now();
    const std::string date_words = image.full_metadata ? date_text(date) : "";
    if (has_layers(begin) && (image.format != IMAGE_EXR || begin.format != PROTOCOL_PIXEL_FORMAT_RGBA32F))
        return fail(reason, reason_bytes, "only an EXR file of 32-bit floats can store layers");
    if (image.format == IMAGE_EXR)
        return copy_out(exr_encode(image, date_words), file, file_bytes, reason, reason_bytes);
    if (image.format == IMAGE_JPEG)
        return write_jpeg(raster, image.quality, metadata_lines(image).c_str(), date_words.c_str(), file,
                          file_bytes, reason, reason_bytes);
    if (image.format == IMAGE_TIFF)
        raster = as_bytes(raster, bytes);
    if (image.format != IMAGE_PNG)
        return write_with_library(
            {image.format, raster, image.quality, metadata_lines(image).c_str(), date_words.c_str()}, file,
            file_bytes, reason, reason_bytes);
    const std::vector<metadata_entry> entries = metadata_of(image);
    std::vector<std::pair<std::string, std::string>> texts;
    for (const metadata_entry &each : entries)
        if (!each.text.empty())
            texts.emplace_back("farlight/" + each.name, each.text);
    return write_png(raster, texts, image.full_metadata ? &date : nullptr, image.display_view, file, file_bytes,
                     reason, reason_bytes);
}

// Runs an encoder and turns exceptions into errors.
template <typename function> bool guard(function encode, char *reason, size_t reason_bytes)
{
    try {
        return encode();
    } catch (const std::exception &exception) {
        return fail(reason, reason_bytes, exception.what());
    }
}

} // namespace

enum image_format image_format_of(const char *path, const char *fallback)
{
    const char *slash = std::strrchr(path, '/');
    const char *dot = std::strrchr(path, '.');
    const bool has_ending = dot && (!slash || dot > slash);
    const enum image_format format = has_ending ? format_by_ending(dot + 1) : IMAGE_UNKNOWN;
    return format != IMAGE_UNKNOWN ? format : format_by_ending(fallback);
}

bool image_needs_library(enum image_format format)
{
    return format != IMAGE_PNG && format != IMAGE_JPEG && format != IMAGE_EXR;
}

bool image_encode(const struct image *image, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    return guard([=] { return write_frame(*image, file, file_bytes, reason, reason_bytes); }, reason,
                 reason_bytes);
}

bool image_encode_plain(enum image_format format, const struct raster *raster, const char *description,
                        uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    if (format != IMAGE_PNG && format != IMAGE_JPEG)
        return fail(reason, reason_bytes, "a picture of errors must be PNG or JPEG");
    return guard(
        [=] {
            if (format == IMAGE_JPEG)
                return write_jpeg(*raster, 95, description, "", file, file_bytes, reason, reason_bytes);
            return write_png(*raster, {{"Description", description}}, nullptr, false, file, file_bytes, reason,
                             reason_bytes);
        },
        reason, reason_bytes);
}
