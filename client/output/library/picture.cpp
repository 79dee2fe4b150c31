// SPDX-License-Identifier: MIT
// Reading of image files, and their conversion to displayed colours.
#include "picture.hpp"
#include "protocol/common/srgb.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imagebufalgo.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <memory>
#include <new>
#include <vector>

namespace
{

constexpr int edge_max = 8192; // the frames' limit
constexpr int channels_max = 4;
constexpr size_t channel_name_max = 60; // four names and their commas fit into a message

struct signature {
    const char *reader;
    bool linear;
    size_t length;
    const char *bytes;
};

const signature signatures[] = {{"png", false, 8, "\x89PNG\r\n\x1a\n"},
                                {"jpeg", false, 3, "\xff\xd8\xff"},
                                {"openexr", true, 4, "\x76\x2f\x31\x01"},
                                {"hdr", true, 10, "#?RADIANCE"},
                                {"hdr", true, 6, "#?RGBE"}};

const signature *signature_of(const uint8_t *file, size_t file_bytes)
{
    for (const signature &each : signatures)
        if (file_bytes >= each.length && std::memcmp(file, each.bytes, each.length) == 0)
            return &each;
    return nullptr;
}

// Detects a truncated JPEG: libjpeg makes up the missing part and only warns.
bool is_cut_off(const signature &kind, const uint8_t *file, size_t file_bytes)
{
    while (file_bytes > 0 && file[file_bytes - 1] == 0) // padding
        file_bytes--;
    return std::strcmp(kind.reader, "jpeg") == 0 &&
           (file_bytes < 2 || file[file_bytes - 2] != 0xff || file[file_bytes - 1] != 0xd9);
}

// Sanitises the channel names of a file, so that they cannot control a terminal, break the protocol's UTF-8 or
// look like several names in a list.
std::vector<std::string> harmless(std::vector<std::string> names)
{
    for (std::string &name : names) {
        name.resize(std::min(name.size(), channel_name_max));
        std::replace_if(
            name.begin(), name.end(), [](char c) { return c <= ' ' || c == ',' || c > '~'; }, '?');
    }
    return names;
}

bool fail(std::string &reason, const std::string &text)
{
    reason = text;
    return false;
}

bool check_spec(const OIIO::ImageSpec &spec, std::string &reason)
{
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.deep)
        return fail(reason, "is not a flat image");
    if (spec.width > edge_max || spec.height > edge_max)
        return fail(reason, "is " + std::to_string(spec.width) + "x" + std::to_string(spec.height) +
                                " pixels, more than " + std::to_string(edge_max) + " in one direction");
    return true;
}

struct channel_range {
    int first, count;
    int alpha; // index from the first channel; -1: none
};

// Chooses the picture of a file with layers: the library sorts red, green, blue and alpha without a layer next to
// each other. Without these four, all channels are chosen.
bool choose_channels(const OIIO::ImageSpec &spec, struct channel_range &chosen, std::string &reason)
{
    const std::vector<std::string> &names = spec.channelnames;
    chosen = {0, spec.nchannels,
              spec.nchannels > 1 ? spec.alpha_channel : -1}; // alpha alone is compared like grey
    for (size_t i = 0; i + 2 < names.size(); i++) {
        if (names[i] != "R" || names[i + 1] != "G" || names[i + 2] != "B")
            continue;
        const bool has_alpha = i + 3 < names.size() && names[i + 3] == "A";
        chosen = {static_cast<int>(i), has_alpha ? 4 : 3, has_alpha ? 3 : -1};
    }
    if (chosen.count < 1 || chosen.count > channels_max)
        return fail(reason, "has " + std::to_string(spec.nchannels) + " channels, and not R, G and B: at most " +
                                std::to_string(channels_max) + " are compared");
    for (int i = 0; i < chosen.count; i++)
        if (spec.channelformat(chosen.first + i) == OIIO::TypeDesc::UINT32)
            return fail(reason, "contains numbers of objects instead of a picture");
    return true;
}

// Khronos PBR Neutral Tone Mapper, specification 1.0: F_90 = 0.04, K_s = 0.8 - F_90, K_d = 0.15.
void tone_map_neutral(float colour[3])
{
    const float start = 0.8f - 0.04f, desaturation = 0.15f;
    const float minimum = std::min({colour[0], colour[1], colour[2]});
    const float offset = minimum < 0.08f ? minimum - 6.25f * minimum * minimum : 0.04f;
    for (int c = 0; c < 3; c++)
        colour[c] -= offset;
    const float peak = std::max({colour[0], colour[1], colour[2]});
    if (peak < start)
        return;
    const float d = 1 - start;
    const float new_peak = 1 - d * d / (peak + d - start);
    const float g = 1 - 1 / (desaturation * (peak - new_peak) + 1);
    for (int c = 0; c < 3; c++)
        colour[c] = colour[c] * (new_peak / peak) * (1 - g) + new_peak * g;
}

// Hill. A fit of the ACES reference and output transforms, 2016; shaders/common/tonemap.glsl is the same.
void tone_map_aces(float colour[3])
{
    static const float from_linear[3][3] = {
        {0.59719f, 0.35458f, 0.04823f}, {0.07600f, 0.90834f, 0.01566f}, {0.02840f, 0.13383f, 0.83777f}};
    static const float to_linear[3][3] = {
        {1.60475f, -0.53108f, -0.07367f}, {-0.10208f, 1.10813f, -0.00605f}, {-0.00327f, -0.07276f, 1.07602f}};
    float curved[3];
    for (int r = 0; r < 3; r++) {
        float x = 0;
        for (int c = 0; c < 3; c++)
            x += from_linear[r][c] * (colour[c] / 0.6f);
        curved[r] = (x * (x + 0.0245786f) - 0.000090537f) / (x * (0.983729f * x + 0.4329510f) + 0.238081f);
    }
    for (int r = 0; r < 3; r++)
        colour[r] = to_linear[r][0] * curved[0] + to_linear[r][1] * curved[1] + to_linear[r][2] * curved[2];
}

// Converts as the renderer's resolve pass does for 8-bit pixels.
void screen_from_linear(float colour[3], float alpha, enum protocol_tone_map tone_map)
{
    for (int c = 0; c < 3; c++)
        colour[c] = std::clamp(alpha > 0 ? colour[c] / alpha : colour[c], 0.0f, 1e9f);
    if (tone_map == PROTOCOL_TONE_NEUTRAL)
        tone_map_neutral(colour);
    else if (tone_map == PROTOCOL_TONE_ACES)
        tone_map_aces(colour);
    for (int c = 0; c < 3; c++)
        colour[c] = srgb_from_linear_f(std::clamp(colour[c], 0.0f, 1.0f));
}

// Indices of red, green and blue; a grey picture has one channel for all three.
std::array<size_t, 3> colour_channels(const struct picture &picture)
{
    std::vector<size_t> colours;
    for (int c = 0; c < picture.channels(); c++)
        if (c != picture.alpha)
            colours.push_back(static_cast<size_t>(c));
    const size_t last = colours.size() - 1;
    return {colours[0], colours[std::min<size_t>(1, last)], colours[std::min<size_t>(2, last)]};
}

float alpha_of(const struct picture &picture, const float *pixel)
{
    return picture.alpha >= 0 ? pixel[picture.alpha] : 1;
}

} // namespace

std::string picture::channel_names() const
{
    std::string names;
    for (const std::string &name : pixels.spec().channelnames)
        names += (names.empty() ? "" : ",") + name;
    return names;
}

OIIO::ImageBuf make_plane(int width, int height, int channels)
{
    OIIO::ImageBuf made(OIIO::ImageSpec(width, height, channels, OIIO::TypeDesc::FLOAT),
                        OIIO::InitializePixels::Yes);
    if (!made.localpixels())
        throw std::bad_alloc();
    return made;
}

bool picture_decode(const uint8_t *file, size_t file_bytes, struct picture &made, std::string &reason)
{
    const signature *kind = signature_of(file, file_bytes);
    if (!kind)
        return fail(reason, "is not an EXR, HDR, PNG or JPEG image");
    if (is_cut_off(*kind, file, file_bytes))
        return fail(reason, "is cut off: the end of the JPEG image is missing");
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(kind->reader);
    if (!input)
        return fail(reason, OIIO::geterror());
    OIIO::Filesystem::IOMemReader memory(const_cast<uint8_t *>(file), file_bytes); // only read
    OIIO::ImageSpec spec, hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); // alpha as stored
    hints.attribute("oiio:reorient", 0);
    if (!input->set_ioproxy(&memory) || !input->open(std::string("image.") + kind->reader, spec, hints))
        return fail(reason, input->geterror());
    struct channel_range chosen = {};
    if (!check_spec(spec, reason) || !choose_channels(spec, chosen, reason))
        return false;
    const auto names = spec.channelnames.begin() + chosen.first;
    made.linear = kind->linear;
    made.alpha = chosen.alpha;
    made.pixels = make_plane(spec.width, spec.height, chosen.count);
    made.pixels.specmod().channelnames = harmless({names, names + chosen.count});
    if (!input->read_image(0, 0, chosen.first, chosen.first + chosen.count, OIIO::TypeDesc::FLOAT, made.data()))
        return fail(reason, input->geterror());
    return true;
}

void picture_drop_alpha(struct picture &picture)
{
    if (picture.alpha < 0 || picture.channels() < 2)
        return;
    std::vector<int> kept;
    std::vector<std::string> names;
    for (int c = 0; c < picture.channels(); c++) {
        if (c == picture.alpha)
            continue;
        kept.push_back(c);
        names.push_back(picture.pixels.spec().channelnames[static_cast<size_t>(c)]);
    }
    picture.pixels = OIIO::ImageBufAlgo::channels(picture.pixels, static_cast<int>(kept.size()), kept, {}, names);
    picture.alpha = -1;
}

void picture_to_screen(struct picture &picture, enum protocol_tone_map tone_map)
{
    if (!picture.linear)
        return;
    const std::array<size_t, 3> channel = colour_channels(picture);
    float *pixel = picture.data();
    for (size_t i = 0; i < picture.count(); i++, pixel += picture.channels()) {
        float colour[3] = {pixel[channel[0]], pixel[channel[1]], pixel[channel[2]]};
        screen_from_linear(colour, alpha_of(picture, pixel), tone_map);
        for (size_t c = 0; c < 3; c++)
            pixel[channel[c]] = colour[c];
    }
    picture.linear = false;
}

OIIO::ImageBuf picture_screen_colours(const struct picture &picture, enum protocol_tone_map tone_map)
{
    OIIO::ImageBuf made = make_plane(picture.width(), picture.height(), 3);
    const std::array<size_t, 3> channel = colour_channels(picture);
    const float *from = picture.data();
    float *to = static_cast<float *>(made.localpixels());
    for (size_t i = 0; i < picture.count(); i++, from += picture.channels(), to += 3) {
        for (size_t c = 0; c < 3; c++)
            to[c] = from[channel[c]];
        if (picture.linear)
            screen_from_linear(to, alpha_of(picture, from), tone_map);
        for (size_t c = 0; c < 3; c++)
            to[c] = std::clamp(to[c], 0.0f, 1.0f);
    }
    return made;
}
