// SPDX-License-Identifier: MIT
// Structural similarity and Butteraugli distance of two pictures.
#include "similarity.hpp"
#include "picture.hpp"

#include <OpenImageIO/imagebufalgo.h>
#include <jxl/butteraugli.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace
{
using OIIO::ImageBuf;
using OIIO::ROI;
namespace algo = OIIO::ImageBufAlgo;

constexpr int window = 11, radius = window / 2;
constexpr float sigma = 1.5f;
// The constants (K L)^2 for the range L of 1.
constexpr float c1 = 0.01f * 0.01f, c2 = 0.03f * 0.03f;

// A row or a column of the window: a Gaussian in two dimensions is one in x after one in y. The library's
// make_kernel("gaussian") has no parameter for sigma.
ImageBuf window_kernel(bool is_row)
{
    OIIO::ImageSpec spec(is_row ? window : 1, is_row ? 1 : window, 1, OIIO::TypeDesc::FLOAT);
    spec.x = is_row ? -radius : 0;
    spec.y = is_row ? 0 : -radius;
    ImageBuf kernel(spec);
    for (int i = -radius; i <= radius; i++) {
        const float weight = std::exp(static_cast<float>(-i * i) / (2 * sigma * sigma));
        kernel.setpixel(is_row ? i : 0, is_row ? 0 : i, &weight);
    }
    return kernel;
}

ImageBuf luma_of(const ImageBuf &colours)
{
    const float weights[3] = {0.2126f, 0.7152f, 0.0722f};
    return algo::channel_sum(colours, weights);
}

struct smoothing {
    ImageBuf row = window_kernel(true), column = window_kernel(false);
    // Computes weighted means over the windows whose centres are within `inner`.
    ImageBuf mean(const ImageBuf &plane, const ROI &inner) const
    {
        ROI tall = inner;
        tall.ybegin -= radius;
        tall.yend += radius;
        return algo::convolve(algo::convolve(plane, row, true, tall), column, true, inner);
    }
};

} // namespace

bool similarity_ssim(const ImageBuf &a, const ImageBuf &b, float &ssim)
{
    if (a.spec().width < window || a.spec().height < window)
        return false;
    const ROI inner(radius, a.spec().width - radius, radius, a.spec().height - radius, 0, 1, 0, 1);
    const smoothing smooth;
    const ImageBuf x = luma_of(a), y = luma_of(b);
    const ImageBuf mean_x = smooth.mean(x, inner), mean_y = smooth.mean(y, inner);
    const ImageBuf mean_xx = algo::mul(mean_x, mean_x), mean_yy = algo::mul(mean_y, mean_y);
    const ImageBuf mean_xy = algo::mul(mean_x, mean_y);
    const ImageBuf variance_x = algo::sub(smooth.mean(algo::mul(x, x), inner), mean_xx);
    const ImageBuf variance_y = algo::sub(smooth.mean(algo::mul(y, y), inner), mean_yy);
    const ImageBuf covariance = algo::sub(smooth.mean(algo::mul(x, y), inner), mean_xy);
    const ImageBuf above = algo::mul(algo::mad(mean_xy, 2.0f, c1), algo::mad(covariance, 2.0f, c2));
    const ImageBuf below =
        algo::mul(algo::add(algo::add(mean_xx, mean_yy), c1), algo::add(algo::add(variance_x, variance_y), c2));
    const algo::PixelStats stats = algo::computePixelStats(algo::div(above, below));
    if (stats.avg.size() != 1 || !std::isfinite(stats.avg[0]))
        return false;
    ssim = std::clamp(stats.avg[0], -1.0f, 1.0f);
    return true;
}

bool similarity_butteraugli(const ImageBuf &a, const ImageBuf &b, struct butteraugli &found)
{
    constexpr int edge_min = 8; // the library returns 0 for smaller pictures
    // The library needs some 300 bytes a pixel and ends the program without them.
    constexpr size_t pixels_max = size_t(1) << 24;
    const size_t width = static_cast<size_t>(a.spec().width), height = static_cast<size_t>(a.spec().height);
    if (a.spec().width < edge_min || a.spec().height < edge_min || width * height > pixels_max)
        return false;
    const JxlPixelFormat format = {3, JXL_TYPE_FLOAT, JXL_NATIVE_ENDIAN, 0};
    const size_t bytes = width * height * 3 * sizeof(float);
    const std::unique_ptr<JxlButteraugliApi, decltype(&JxlButteraugliApiDestroy)> api(
        JxlButteraugliApiCreate(nullptr), JxlButteraugliApiDestroy);
    if (!api)
        return false;
    const std::unique_ptr<JxlButteraugliResult, decltype(&JxlButteraugliResultDestroy)> result(
        JxlButteraugliCompute(api.get(), static_cast<uint32_t>(width), static_cast<uint32_t>(height), &format,
                              a.localpixels(), bytes, &format, b.localpixels(), bytes),
        JxlButteraugliResultDestroy);
    if (!result)
        return false;
    const float *distances = nullptr;
    uint32_t stride = 0;
    JxlButteraugliResultGetDistmap(result.get(), &distances, &stride);
    found = {JxlButteraugliResultGetDistance(result.get(), 3), JxlButteraugliResultGetMaxDistance(result.get()),
             0};
    for (size_t y = 0; y < height; y++)
        found.visible += static_cast<uint64_t>(std::count_if(
            distances + y * stride, distances + y * stride + width, [](float distance) { return distance > 1; }));
    return std::isfinite(found.distance) && std::isfinite(found.max);
}
