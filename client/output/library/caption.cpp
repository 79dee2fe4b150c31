// SPDX-License-Identifier: MIT
// Drawing of lines of text with OpenImageIO.
#include "caption.hpp"
#include "output/library.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cstdio>
#include <exception>

namespace
{
namespace algo = OIIO::ImageBufAlgo;

constexpr int font_pixels = 14; // height of the font
constexpr int margin = 4;       // distance from the region's edge
const char *const fonts[] = {"DejaVuSans", "LiberationSans-Regular", "NotoSans-Regular", "FreeSans"};

std::string fit(const std::string &text, int width, const std::string &font)
{
    std::string fitting = text;
    size_t cut = 0;
    while (cut < text.size() && algo::text_size(fitting, font_pixels, font).width() > width) {
        cut++;
        while (cut < text.size() && (static_cast<unsigned char>(text[cut]) & 0xc0) == 0x80) // a continuation byte
            cut++;
        fitting = ".." + text.substr(cut);
    }
    return fitting;
}

} // namespace

std::string caption_font()
{
    for (const char *name : fonts)
        if (algo::text_size("x", font_pixels, name).defined())
            return name;
    OIIO::geterror();
    return "";
}

void caption_draw(OIIO::ImageBuf &picture, int x, int baseline, const std::string &text, const std::string &font,
                  const float *ink, const OIIO::ROI &region)
{
    const bool is_centred = x < 0;
    using count = OIIO::cspan<float>::size_type;
    algo::render_text(picture, is_centred ? region.xbegin + region.width() / 2 : x, baseline,
                      fit(text, region.width() - 2 * margin, font), font_pixels, font,
                      {ink, static_cast<count>(picture.nchannels())},
                      is_centred ? algo::TextAlignX::Center : algo::TextAlignX::Left, algo::TextAlignY::Baseline,
                      0, region);
}

bool caption_draw_into(const struct raster *raster, const struct message_export_text *wanted, char *reason,
                       size_t reason_bytes)
{
    try {
        const std::string font = caption_font();
        const int width = static_cast<int>(raster->width), height = static_cast<int>(raster->height),
                  left = static_cast<int>(wanted->x), box = static_cast<int>(wanted->width);
        const float ink[4] = {static_cast<float>(wanted->colour >> 16) / 255,
                              static_cast<float>(wanted->colour >> 8 & 255) / 255,
                              static_cast<float>(wanted->colour & 255) / 255, 1};
        OIIO::ImageBuf picture(OIIO::ImageSpec(width, height, 4, OIIO::TypeDesc::UINT8),
                               const_cast<void *>(raster->pixels)); // the caller allows writing
        if (!font.empty())
            caption_draw(picture, -1, static_cast<int>(wanted->y), wanted->text, font, ink,
                         OIIO::ROI(left, std::min(left + box, width), 0, height));
    } catch (const std::exception &exception) {
        std::snprintf(reason, reason_bytes, "%s", exception.what());
        return false;
    }
    return true;
}
