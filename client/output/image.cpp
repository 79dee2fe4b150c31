// SPDX-License-Identifier: MIT
#include "image.h"
#include "layers.hpp"
#include "metadata.hpp"
#include "protocol/version.h"

#include <OpenImageIO/filesystem.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <strings.h>

namespace
{

struct known_format {
    enum image_format format;
    const char *plugin; // named, never guessed
    const char *endings[2];
};

const known_format known[] = {{IMAGE_PNG, "png", {"png", nullptr}},
                              {IMAGE_JPEG, "jpeg", {"jpg", "jpeg"}},
                              {IMAGE_EXR, "openexr", {"exr", nullptr}},
                              {IMAGE_HDR, "hdr", {"hdr", nullptr}}};

enum image_format format_by_ending(const char *ending)
{
    for (const known_format &each : known)
        for (const char *name : each.endings)
            if (name && strcasecmp(name, ending) == 0)
                return each.format;
    return IMAGE_UNKNOWN;
}

const char *plugin_of(enum image_format format)
{
    for (const known_format &each : known)
        if (each.format == format)
            return each.plugin;
    return "";
}

OIIO::TypeDesc stored_type(enum protocol_pixel_format format)
{
    switch (format) {
    case PROTOCOL_PIXEL_FORMAT_RGBA16F:
        return OIIO::TypeDesc::HALF;
    case PROTOCOL_PIXEL_FORMAT_RGBA32F:
        return OIIO::TypeDesc::FLOAT;
    default:
        return OIIO::TypeDesc::UINT8;
    }
}

// What the file's pixels are. JPEG and HDR have no alpha.
OIIO::ImageSpec make_spec(const struct image &image)
{
    const bool has_alpha = image.format == IMAGE_PNG || image.format == IMAGE_EXR;
    OIIO::TypeDesc type = OIIO::TypeDesc::UINT8;
    if (image.format == IMAGE_EXR)
        type = image.half ? OIIO::TypeDesc::HALF : OIIO::TypeDesc::FLOAT;
    else if (image.format == IMAGE_HDR)
        type = OIIO::TypeDesc::FLOAT;
    OIIO::ImageSpec spec(static_cast<int>(image.begin->width), static_cast<int>(image.begin->height),
                         has_alpha ? 4 : 3, type);
    if (image.format == IMAGE_PNG) {
        spec.attribute("oiio:UnassociatedAlpha", 1);
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("png:compressionLevel", 4); // half the time of 6 for 2 % more bytes
    } else if (image.format == IMAGE_JPEG) {
        spec.attribute("oiio:ColorSpace", "sRGB");
        spec.attribute("Compression", "jpeg:" + std::to_string(image.quality));
    } else {
        spec.attribute("oiio:ColorSpace", "Linear");
    }
    if (image.format == IMAGE_EXR)
        spec.attribute("compression", "zip");
    if (has_layers(*image.begin))
        set_layer_channels(spec, image.begin->layers, image.half);
    add_metadata(spec, image);
    return spec;
}

bool fail(char *reason, size_t reason_bytes, const std::string &text)
{
    std::snprintf(reason, reason_bytes, "%s", text.c_str());
    return false;
}

// Radiance files keep comments in their header, which OpenImageIO does not write.
void insert_comments(std::vector<unsigned char> &file, const struct image &image)
{
    std::string lines;
    for (const char c : describe(image)) {
        if (lines.empty() || lines.back() == '\n')
            lines += "# ";
        lines += c;
    }
    for (size_t i = 0; i < file.size() && i < 64; i++) {
        if (file[i] != '\n')
            continue;
        file.insert(file.begin() + static_cast<std::ptrdiff_t>(i) + 1, lines.begin(), lines.end());
        return;
    }
}

struct pixel_source {
    OIIO::TypeDesc type;
    const void *pixels;
    size_t pixel_bytes;
    const struct image *layers; // NULL: there are none, and the three above count
};

bool write_source(OIIO::ImageOutput &output, const struct pixel_source &source)
{
    if (source.layers)
        return write_layers(output, *source.layers);
    return output.write_image(source.type, source.pixels, static_cast<OIIO::stride_t>(source.pixel_bytes));
}

bool write_pixels(enum image_format format, const OIIO::ImageSpec &spec, const struct pixel_source &source,
                  std::vector<unsigned char> &file, std::string &why)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(plugin_of(format));
    OIIO::Filesystem::IOVecOutput memory(file);
    if (!output)
        why = OIIO::geterror();
    else if (!output->set_ioproxy(&memory))
        why = "this build of OpenImageIO cannot write it to memory";
    else if (!output->open(std::string("image.") + plugin_of(format), spec) || !write_source(*output, source) ||
             !output->close())
        why = output->geterror();
    else
        return true;
    return false;
}

bool encode(const struct image &image, std::vector<unsigned char> &file, char *reason, size_t reason_bytes)
{
    const OIIO::TypeDesc type = stored_type(image.begin->format);
    const struct image *layers = has_layers(*image.begin) ? &image : nullptr;
    std::string why;
    if (layers && (image.format != IMAGE_EXR || image.begin->format != PROTOCOL_PIXEL_FORMAT_RGBA32F))
        return fail(reason, reason_bytes, "only an EXR file of 32-bit floats can store layers");
    if (!write_pixels(image.format, make_spec(image), {type, image.pixels, 4 * type.size(), layers}, file, why))
        return fail(reason, reason_bytes, why);
    if (image.format == IMAGE_HDR)
        insert_comments(file, image);
    return true;
}

bool encode(const struct plain_image &image, std::vector<unsigned char> &file, char *reason, size_t reason_bytes)
{
    OIIO::ImageSpec spec(static_cast<int>(image.width), static_cast<int>(image.height), 3, OIIO::TypeDesc::UINT8);
    if (image.format != IMAGE_PNG && image.format != IMAGE_JPEG)
        return fail(reason, reason_bytes, "a picture of errors must be PNG or JPEG");
    spec.attribute("oiio:ColorSpace", "sRGB");
    spec.attribute("Compression", "jpeg:95");
    spec.attribute("png:compressionLevel", 4);
    spec.attribute("Software", "farlight " FARLIGHT_VERSION);
    spec.attribute("ImageDescription", image.description);
    std::string why;
    return write_pixels(image.format, spec, {OIIO::TypeDesc::FLOAT, image.pixels, 3 * sizeof(float), nullptr},
                        file, why) ||
           fail(reason, reason_bytes, why);
}

template <typename kind_of_image>
bool encode_to_memory(const kind_of_image &image, uint8_t **file, size_t *file_bytes, char *reason,
                      size_t reason_bytes)
{
    try {
        std::vector<unsigned char> made;
        if (!encode(image, made, reason, reason_bytes))
            return false;
        *file = static_cast<uint8_t *>(std::malloc(made.size()));
        if (!*file)
            return fail(reason, reason_bytes, "out of memory");
        std::memcpy(*file, made.data(), made.size());
        *file_bytes = made.size();
    } catch (const std::exception &exception) {
        return fail(reason, reason_bytes, exception.what());
    }
    return true;
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

bool image_prepare(char *reason, size_t reason_bytes)
{
    try {
        // One thread: the renderer has use for the others, and the sandbox need not allow more.
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);
        const std::vector<unsigned char> pixels(4 * 4 * 4, 0);
        struct message_frame_begin begin = {};
        struct message_frame_end end = {};
        begin.width = begin.height = begin.samples = 4;
        begin.layers = 1u << PROTOCOL_LAYER_BEAUTY;
        begin.fov_y = 1;
        for (const known_format &each : known) {
            struct image image = {};
            image.format = each.format;
            image.quality = 90;
            image.model = "";
            image.begin = &begin;
            image.end = &end;
            image.pixels = pixels.data();
            std::vector<unsigned char> file;
            if (!encode(image, file, reason, reason_bytes))
                return false;
        }
    } catch (const std::exception &exception) {
        return fail(reason, reason_bytes, exception.what());
    }
    return true;
}

bool image_encode(const struct image *image, uint8_t **file, size_t *file_bytes, char *reason, size_t reason_bytes)
{
    return encode_to_memory(*image, file, file_bytes, reason, reason_bytes);
}

bool image_encode_plain(const struct plain_image *image, uint8_t **file, size_t *file_bytes, char *reason,
                        size_t reason_bytes)
{
    return encode_to_memory(*image, file, file_bytes, reason, reason_bytes);
}
