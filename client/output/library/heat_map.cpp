// SPDX-License-Identifier: MIT
// Pictures of errors as heat maps.
#include "heat_map.hpp"
#include "caption.hpp"
#include "picture.hpp"
#include "protocol/common/srgb.h"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <new>

namespace
{
using OIIO::ImageBuf;
using OIIO::ROI;
namespace algo = OIIO::ImageBufAlgo;

constexpr int gap = 4; // pixels between pictures
constexpr int title_pixels = 22;
constexpr int title_width_min = 96;
const float background[3] = {0.5f, 0.5f, 0.5f};
const float ink[3] = {1, 1, 1};

} // namespace

ImageBuf heat_map(const ImageBuf &errors, float top, const std::vector<bool> &marked)
{
    const float scale = top > 0 ? 1 / top : 0;
    const ImageBuf colours =
        algo::color_map(algo::pow(algo::clamp(algo::mul(errors, scale), 0.0f, 1.0f), 0.5f), 0, "inferno");
    if (!colours.localpixels())
        throw std::bad_alloc();
    ImageBuf made = make_plane(errors.spec().width, errors.spec().height, 3);
    const float *from = static_cast<const float *>(colours.localpixels());
    float *to = static_cast<float *>(made.localpixels());
    for (size_t i = 0; i < marked.size(); i++, from += 3, to += 3) {
        for (size_t c = 0; c < 3; c++) // the map's colours are linear
            to[c] = marked[i] ? (c == 1 ? 0.0f : 1.0f) : srgb_from_linear_f(from[c]);
    }
    return made;
}

ImageBuf side_by_side(const std::vector<const ImageBuf *> &pictures, const std::vector<std::string> &titles)
{
    const int width = pictures[0]->spec().width, height = pictures[0]->spec().height;
    const std::string font = width >= title_width_min ? caption_font() : "";
    const int top = font.empty() ? 0 : title_pixels;
    const int count = static_cast<int>(pictures.size());
    ImageBuf made = make_plane(count * width + (count - 1) * gap, height + top, 3);
    algo::fill(made, background);
    for (int i = 0; i < count; i++) {
        const int left = i * (width + gap);
        algo::paste(made, left, top, 0, 0, *pictures[static_cast<size_t>(i)]);
        if (top == 0)
            continue;
        algo::fill(made, {0.1f, 0.1f, 0.1f}, ROI(left, left + width, 0, top));
        caption_draw(made, left + 4, title_pixels - 7, titles[static_cast<size_t>(i)], font, ink,
                     ROI(left, left + width, 0, top));
    }
    return made;
}
