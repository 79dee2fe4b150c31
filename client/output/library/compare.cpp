// SPDX-License-Identifier: MIT
// Comparison of two pictures: errors, similarity, and a picture of the errors.
#include "compare.hpp"
#include "heat_map.hpp"
#include "picture.hpp"
#include "similarity.hpp"

#include <OpenImageIO/imagebufalgo.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <memory>
#include <vector>

namespace
{
using OIIO::ImageBuf;
namespace algo = OIIO::ImageBufAlgo;

// Limit of a file: two frames of 8192x8192 as raw floats have half of it.
constexpr size_t file_bytes_max = size_t(1) << 31;
constexpr float sent_max = 3e38f;

struct comparison {
    const struct library_host &host;
    const struct message_compare_images &wanted;
    struct compare_result &result;
    struct picture a, b;
    std::vector<bool> nonfinite; // a flag for each pixel
};

bool fail(struct compare_result &result, const char *path, const std::string &reason)
{
    const size_t length = std::strlen(path);
    const bool is_long = length >= sizeof(result.field);
    std::snprintf(result.field, sizeof(result.field), "%s%s", is_long ? "..." : "",
                  path + (is_long ? length - sizeof(result.field) + 4 : 0));
    std::string line = reason.empty() ? "cannot be read" : reason;
    std::replace(line.begin(), line.end(), '\n', ' '); // libraries' messages may have several lines
    while (!line.empty() && line.back() == ' ')
        line.pop_back();
    std::snprintf(result.reason, sizeof(result.reason), "%s", line.c_str());
    return false;
}

bool read_picture(const struct library_host &host, const struct compare_file &file, struct picture &made,
                  struct compare_result &result)
{
    char reason[160] = "";
    uint8_t *bytes = nullptr;
    size_t count = 0;
    if (file.fd < 0)
        return fail(result, file.path, file.reason);
    if (!host.read(file.fd, file_bytes_max, &bytes, &count, reason, sizeof(reason)))
        return fail(result, file.path, reason);
    const std::unique_ptr<uint8_t, decltype(&std::free)> owner(bytes, std::free);
    std::string why;
    return picture_decode(bytes, count, made, why) || fail(result, file.path, why);
}

std::string size_text(const struct picture &picture)
{
    return std::to_string(picture.width()) + "x" + std::to_string(picture.height());
}

bool check_alike(const struct comparison &each)
{
    const struct message_compare_images &wanted = each.wanted;
    if (each.a.width() != each.b.width() || each.a.height() != each.b.height())
        return fail(each.result, wanted.a,
                    "has " + size_text(each.a) + " pixels, but " + wanted.b + " has " + size_text(each.b));
    if (each.a.pixels.spec().channelnames == each.b.pixels.spec().channelnames)
        return true;
    if ((each.a.alpha >= 0) != (each.b.alpha >= 0))
        each.result.remedy = "without alpha they may be alike: --ignore-alpha";
    return fail(each.result, wanted.a,
                "has the channels " + each.a.channel_names() + ", but " + wanted.b + " has " +
                    each.b.channel_names());
}

// Counts pixels with NaN or infinity and sets them to 0 in both pictures, so that sums stay finite.
void set_aside_nonfinite(struct comparison &each)
{
    const size_t channels = static_cast<size_t>(each.a.channels());
    const auto is_number = [](float value) { return std::isfinite(value); };
    each.nonfinite.assign(each.a.count(), false);
    float *a = each.a.data(), *b = each.b.data();
    for (size_t i = 0; i < each.nonfinite.size(); i++, a += channels, b += channels) {
        const bool bad_a = !std::all_of(a, a + channels, is_number);
        const bool bad_b = !std::all_of(b, b + channels, is_number);
        if (!bad_a && !bad_b)
            continue;
        each.nonfinite[i] = true;
        each.result.answer.nonfinite++;
        each.result.answer.nonfinite_a += bad_a;
        each.result.answer.nonfinite_b += bad_b;
        std::fill_n(a, channels, 0.0f);
        std::fill_n(b, channels, 0.0f);
    }
}

// Clamps the difference of two floats to the range of a float.
float sendable(double value)
{
    return static_cast<float>(std::min<double>(value, static_cast<double>(sent_max)));
}

// Measures the errors. Nonfinite pixels were set to 0 in both, but are among the pixels that the library divides
// by.
void measure_errors(struct comparison &each)
{
    struct message_images_compared &answer = each.result.answer;
    const double pixels = static_cast<double>(each.a.count());
    const double finite = pixels - static_cast<double>(answer.nonfinite);
    const algo::CompareResults found =
        algo::compare(each.a.pixels, each.b.pixels, each.wanted.threshold, each.wanted.threshold);
    const double part = finite > 0 ? pixels / finite : 0;
    answer.beyond = found.nfail + answer.nonfinite;
    answer.mean_error = sendable(found.meanerror * part);
    answer.rms_error = sendable(found.rms_error * std::sqrt(part));
    answer.max_error = sendable(found.maxerror);
    answer.max_error_x = static_cast<uint32_t>(found.maxx);
    answer.max_error_y = static_cast<uint32_t>(found.maxy);
    answer.max_error_channel = static_cast<uint32_t>(found.maxc);
    const float maximum = answer.max_error;
    answer.heat_top = each.wanted.heat_top > 0 ? each.wanted.heat_top : std::min(maximum, 1.0f);
}

// Measures errors of displayed colours, where nonfinite pixels are black in both.
void measure_shown_errors(struct comparison &each, const ImageBuf &screen_a, const ImageBuf &screen_b)
{
    struct message_images_compared &answer = each.result.answer;
    const float *a = static_cast<const float *>(screen_a.localpixels());
    const float *b = static_cast<const float *>(screen_b.localpixels());
    const size_t values = 3 * each.a.count();
    const double finite = 3 * static_cast<double>(each.a.count() - answer.nonfinite);
    double squares = 0;
    for (size_t i = 0; i < values; i++) {
        const double error = static_cast<double>(a[i]) - static_cast<double>(b[i]);
        squares += error * error;
    }
    answer.shown_rms_error = finite > 0 ? static_cast<float>(std::sqrt(squares / finite)) : 0;
}

void measure_likeness(struct comparison &each, const ImageBuf &screen_a, const ImageBuf &screen_b)
{
    struct message_images_compared &answer = each.result.answer;
    struct butteraugli found = {};
    answer.has_ssim = similarity_ssim(screen_a, screen_b, answer.ssim);
    answer.has_butteraugli = similarity_butteraugli(screen_a, screen_b, found);
    if (!answer.has_butteraugli)
        return;
    answer.butteraugli = sendable(found.distance);
    answer.butteraugli_max = sendable(found.max);
    answer.visible = found.visible;
}

bool write_picture(struct comparison &each, const ImageBuf &screen_a, const ImageBuf &screen_b)
{
    const struct message_compare_images &wanted = each.wanted;
    struct message_images_compared &answer = each.result.answer;
    char reason[512] = "", scale[64];
    const ImageBuf errors = algo::maxchan(algo::absdiff(each.a.pixels, each.b.pixels));
    ImageBuf shown = heat_map(errors, answer.heat_top, each.nonfinite);
    if (answer.max_error > 0)
        std::snprintf(scale, sizeof(scale), "error, 0 to %.4g", static_cast<double>(answer.heat_top));
    else
        std::snprintf(scale, sizeof(scale), "no error");
    if (wanted.layout == PROTOCOL_COMPARISON_LAYOUT_SIDE) {
        const ImageBuf heat = shown;
        shown = side_by_side({&screen_a, &screen_b, &heat}, {wanted.label_a, wanted.label_b, scale});
    }
    const struct raster picture = {static_cast<uint32_t>(shown.spec().width),
                                   static_cast<uint32_t>(shown.spec().height), 3, sizeof(float),
                                   shown.localpixels()};
    answer.picture_width = picture.width;
    answer.picture_height = picture.height;
    return each.host.write(&wanted, &picture, scale, reason, sizeof(reason)) ||
           fail(each.result, wanted.picture, reason);
}

bool compare(struct comparison &each)
{
    struct message_images_compared &answer = each.result.answer;
    if (each.wanted.ignore_alpha != 0) {
        picture_drop_alpha(each.a);
        picture_drop_alpha(each.b);
    }
    if (!check_alike(each))
        return false;
    set_aside_nonfinite(each);
    const enum protocol_tone_map tone_map = each.wanted.tone_map;
    const ImageBuf screen_a = picture_screen_colours(each.a, tone_map);
    const ImageBuf screen_b = picture_screen_colours(each.b, tone_map);
    if (each.a.linear != each.b.linear) {
        picture_to_screen(each.a, tone_map);
        picture_to_screen(each.b, tone_map);
    }
    answer.width = static_cast<uint32_t>(each.a.width());
    answer.height = static_cast<uint32_t>(each.a.height());
    answer.channels = static_cast<uint32_t>(each.a.channels());
    answer.space = each.a.linear ? PROTOCOL_COMPARISON_SPACE_LINEAR : PROTOCOL_COMPARISON_SPACE_SRGB;
    std::snprintf(each.result.channel_names, sizeof(each.result.channel_names), "%s",
                  each.a.channel_names().c_str());
    answer.channel_names = each.result.channel_names;
    measure_errors(each);
    measure_shown_errors(each, screen_a, screen_b);
    measure_likeness(each, screen_a, screen_b);
    return each.wanted.picture[0] == '\0' || write_picture(each, screen_a, screen_b);
}

} // namespace

bool compare_with_library(const struct library_host *host, const struct message_compare_images *wanted,
                          const struct compare_file *a, const struct compare_file *b,
                          struct compare_result *result)
{
    try {
        struct comparison each = {*host, *wanted, *result, {}, {}, {}};
        OIIO::attribute("threads", 0); // uses all processors, since nothing else runs
        return read_picture(*host, *a, each.a, *result) && read_picture(*host, *b, each.b, *result) &&
               compare(each);
    } catch (const std::bad_alloc &) {
        return fail(*result, wanted->a, "and the other picture need more memory than is available");
    } catch (const std::exception &exception) {
        return fail(*result, wanted->a, exception.what());
    }
}
