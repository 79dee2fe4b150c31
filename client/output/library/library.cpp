// SPDX-License-Identifier: MIT
// The table of the module's functions, and its encoders.
#include "output/library.h"
#include "caption.hpp"
#include "colour.hpp"
#include "compare.hpp"
#include "tiff.hpp"
#include "protocol/version.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <string>
#include <vector>

namespace
{

bool fail(char *reason, size_t reason_bytes, const std::string &text)
{
    std::snprintf(reason, reason_bytes, "%s", text.c_str());
    return false;
}

// The reader is named explicitly, so that the library does not guess it.
const char *plugin_of(enum image_format format)
{
    switch (format) {
    case IMAGE_HDR:
        return "hdr";
    case IMAGE_WEBP:
        return "webp";
    default:
        return "gif";
    }
}

OIIO::TypeDesc type_of(const struct raster &raster)
{
    return raster.component_bytes == 1   ? OIIO::TypeDesc::UINT8
           : raster.component_bytes == 2 ? OIIO::TypeDesc::HALF
                                         : OIIO::TypeDesc::FLOAT;
}

// Describes the file's pixels. HDR has no alpha, and the library writes GIF without alpha.
OIIO::ImageSpec make_spec(const struct library_image &image)
{
    const bool is_linear = image.format == IMAGE_HDR;
    const bool has_alpha = image.format == IMAGE_WEBP && image.raster.channels == 4;
    OIIO::ImageSpec spec(static_cast<int>(image.raster.width), static_cast<int>(image.raster.height),
                         has_alpha ? 4 : 3, is_linear ? OIIO::TypeDesc::FLOAT : OIIO::TypeDesc::UINT8);
    spec.attribute("oiio:ColorSpace", is_linear ? "Linear" : "sRGB");
    spec.attribute("oiio:UnassociatedAlpha", 1);
    spec.attribute("Software", "farlight " FARLIGHT_VERSION);
    if (image.date[0] != '\0')
        spec.attribute("DateTime", image.date);
    if (is_linear)
        return spec;
    spec.attribute("Compression", std::string(plugin_of(image.format)) + ":" + std::to_string(image.quality));
    if (image.description[0] != '\0') // the library stops at an empty description
        spec.attribute("ImageDescription", image.description);
    return spec;
}

// Inserts comments into the header of a Radiance file, which OpenImageIO does not do.
void insert_comments(std::vector<unsigned char> &file, const char *description)
{
    std::string lines;
    for (const char *at = description; *at != '\0'; at++) {
        if (lines.empty() || lines.back() == '\n')
            lines += "# ";
        lines += *at;
    }
    for (size_t i = 0; i < file.size() && i < 64; i++) {
        if (file[i] != '\n')
            continue;
        file.insert(file.begin() + static_cast<std::ptrdiff_t>(i) + 1, lines.begin(), lines.end());
        return;
    }
}

bool write(const struct library_image &image, std::vector<unsigned char> &file, std::string &why)
{
    const char *plugin = plugin_of(image.format);
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(plugin);
    OIIO::Filesystem::IOVecOutput memory(file);
    const size_t pixel_bytes = size_t(image.raster.channels) * image.raster.component_bytes;
    if (!output)
        why = OIIO::geterror();
    else if (!output->set_ioproxy(&memory))
        why = "this build of OpenImageIO cannot write it to memory";
    else if (!output->open(std::string("image.") + plugin, make_spec(image)) ||
             !output->write_image(type_of(image.raster), image.raster.pixels,
                                  static_cast<OIIO::stride_t>(pixel_bytes)) ||
             !output->close())
        why = output->geterror();
    else
        return true;
    return false;
}

bool encode(const struct library_image *image, uint8_t **file, size_t *file_bytes, char *reason,
            size_t reason_bytes)
{
    try {
        std::vector<unsigned char> made;
        std::string why;
        if (!(image->format == IMAGE_TIFF ? tiff_encode(*image, made, why) : write(*image, made, why)))
            return fail(reason, reason_bytes, why);
        if (image->format == IMAGE_HDR)
            insert_comments(made, image->description);
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

bool prepare(bool draws, char *reason, size_t reason_bytes)
{
    const std::vector<unsigned char> pixels(4 * 4 * 4, 0);
    // A single thread: the renderer uses the other processors, and the sandbox need not allow more threads.
    OIIO::attribute("threads", 1);
    OIIO::attribute("exr_threads", -1);
    for (const enum image_format format : {IMAGE_HDR, IMAGE_WEBP, IMAGE_GIF}) {
        const struct library_image image = {format, {4, 4, 4, 1, pixels.data()}, 90, "", "2026:01:01 00:00:00"};
        uint8_t *file = nullptr;
        size_t file_bytes = 0;
        if (!encode(&image, &file, &file_bytes, reason, reason_bytes))
            return false;
        std::free(file);
    }
    if (draws)
        caption_font();
    return true;
}

} // namespace

const struct image_library image_library = {
    prepare, encode, compare_with_library, caption_draw_into, colour_open_configuration, colour_apply_to};
