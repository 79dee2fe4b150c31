// SPDX-License-Identifier: MIT
// How alike two pictures look. Both as a screen shows them: sRGB, three channels of floats, 0 to 1, the same size.
#pragma once

#include <OpenImageIO/imagebuf.h>

#include <cstdint>

// Structural similarity, mean over all windows that lie within the picture.
// Wang, Bovik, Sheikh, Simoncelli. Image quality assessment: from error visibility to structural similarity. IEEE
// Transactions on Image Processing 13(4), 2004: 11x11 Gaussian window with sigma 1.5, K1 0.01, K2 0.03; of the
// Rec. 709 luma, range 1. False: the picture is smaller than the window.
bool similarity_ssim(const OIIO::ImageBuf &a, const OIIO::ImageBuf &b, float &ssim);

struct butteraugli {
    float distance; // 3-norm over the picture
    float max;
    uint64_t visible; // pixels with a distance above 1
};
// Butteraugli's distance, by libjxl. (compare_Yee of OpenImageIO 2.4 is no substitute: its luminance pyramids read
// a channel that does not exist, so that black and white are the same to it.) False: the picture is smaller than
// 8x8 or has more than 2^24 pixels, or memory was short.
bool similarity_butteraugli(const OIIO::ImageBuf &a, const OIIO::ImageBuf &b, struct butteraugli &found);
