// SPDX-License-Identifier: MIT
// Decoding of images with OpenImageIO: the first bytes choose the reader, so that the library does not guess it;
// it reads from memory, and the header's claims are checked before pixels are decoded. A module of its own, since
// OpenImageIO takes longer to load than most models to import.
#include "texture.h"
#include "half.h"
#include "protocol/common/srgb.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <thread>
#include <vector>

namespace
{
constexpr size_t texel_bytes = 4;
// Limit of all images of a model, since many small files can hold large images.
constexpr uint64_t all_images_bytes_max = 4ull << 30;
std::atomic<uint64_t> all_images_bytes{0};

struct signature {
    const char *reader;
    size_t offset, length;
    const char *bytes;
};
// Targa has no signature: it is the last choice, and its header is checked for plausibility.
const signature signatures[] = {
    {"png", 0, 8, "\x89PNG\r\n\x1a\n"},
    {"jpeg", 0, 3, "\xff\xd8\xff"},
    {"openexr", 0, 4, "\x76\x2f\x31\x01"},
    {"hdr", 0, 10, "#?RADIANCE"},
    {"hdr", 0, 6, "#?RGBE"},
    {"tiff", 0, 4, "II*\0"},
    {"tiff", 0, 4, "MM\0*"},
    {"webp", 8, 4, "WEBP"},
    {"bmp", 0, 2, "BM"},
    {"gif", 0, 6, "GIF87a"},
    {"gif", 0, 6, "GIF89a"},
    {"pnm", 0, 2, "P6"},
};

// Formats that are recognised but not read.
struct unread_format {
    size_t offset, length;
    const char *bytes, *reason;
};
const unread_format unread_formats[] = {
    {0, 7, "\xabKTX 20", "is a KTX2 image, which is not read; " TEXTURE_KTX2_REMEDY},
    {0, 4, "DDS ", "is a DDS image, which is not read; convert it to PNG, WebP or JPEG"},
    {4, 8, "ftypavif", "is an AVIF image, which is not read; convert it to PNG, WebP or JPEG"},
};

std::string reason_of_unread(const unsigned char *bytes, size_t size_bytes)
{
    for (const unread_format &format : unread_formats)
        if (size_bytes >= format.offset + format.length &&
            memcmp(bytes + format.offset, format.bytes, format.length) == 0)
            return format.reason;
    return "is not an image of a known format";
}

bool looks_like_targa(const unsigned char *bytes, size_t size_bytes)
{
    if (size_bytes < 18 || bytes[1] > 1)
        return false;
    const int type = bytes[2], depth = bytes[16];
    return (type == 1 || type == 2 || type == 3 || type == 9 || type == 10 || type == 11) &&
           (depth == 8 || depth == 15 || depth == 16 || depth == 24 || depth == 32);
}

const char *reader_of(const unsigned char *bytes, size_t size_bytes)
{
    for (const signature &candidate : signatures)
        if (size_bytes >= candidate.offset + candidate.length &&
            memcmp(bytes + candidate.offset, candidate.bytes, candidate.length) == 0)
            return candidate.reader;
    return looks_like_targa(bytes, size_bytes) ? "targa" : nullptr;
}

// An opened image with a plausible header.
struct opened_image {
    OIIO::Filesystem::IOMemReader memory;
    std::unique_ptr<OIIO::ImageInput> input;
    OIIO::ImageSpec spec;

    opened_image(const unsigned char *bytes, size_t size_bytes)
        : memory(const_cast<unsigned char *>(bytes), size_bytes)
    {
    }
    bool open(const char *reader, std::string &reason);
};

bool spec_reasonable(const OIIO::ImageSpec &spec, std::string &reason)
{
    if (spec.width < 1 || spec.height < 1 || spec.depth > 1 || spec.deep) {
        reason = "is not a flat image";
        return false;
    }
    if (spec.nchannels < 1 || spec.nchannels > 64) {
        reason = "has " + std::to_string(spec.nchannels) + " channels";
        return false;
    }
    return true;
}

bool opened_image::open(const char *reader, std::string &reason)
{
    input = OIIO::ImageInput::create(reader);
    if (!input) {
        reason = std::string("this build of OpenImageIO has no reader for ") + reader;
        OIIO::geterror();
        return false;
    }
    if (!input->supports("ioproxy") || !input->set_ioproxy(&memory)) {
        reason = std::string("this build of OpenImageIO cannot read ") + reader + " from memory";
        return false;
    }
    OIIO::ImageSpec hints;
    hints.attribute("oiio:UnassociatedAlpha", 1); // otherwise colours are multiplied by alpha
    hints.attribute("oiio:reorient", 0);
    if (!input->open(std::string("image.") + reader, spec, hints)) {
        reason = input->geterror();
        if (reason.empty())
            reason = std::string("is not a valid ") + reader + " image";
        return false;
    }
    return spec_reasonable(spec, reason);
}

uint8_t byte_of(float value)
{
    // NaN becomes 0: max(NaN, 0) is 0
    return uint8_t(std::lround(std::min(std::max(value, 0.0f), 1.0f) * 255.0f));
}

// Expands one to four channels to four. Working in place at the end of the same buffer would save memory; clarity
// was worth more.
void expand(const uint8_t *from, unsigned char *to, size_t texels, int channels)
{
    for (size_t i = 0; i < texels; i++, from += channels, to += texel_bytes) {
        to[0] = from[0];
        to[1] = from[channels >= 3 ? 1 : 0];
        to[2] = from[channels >= 3 ? 2 : 0];
        to[3] = channels == 2 ? from[1] : channels >= 4 ? from[3] : 255;
    }
}

// Sets the job's size, and reserves a part of the limit of all images. False: the job or `reason` has the fault.
bool settle_size(const opened_image &image, texture_job &job, std::string &reason)
{
    job.reduced = texture_reduction(&job, uint64_t(image.spec.width), uint64_t(image.spec.height));
    if (job.reduced == 0) {
        reason = job.reason;
        return false;
    }
    if (job.reduced > 1 && image.spec.tile_width > 0) {
        reason = "is stored in tiles and larger than can be shown: save it in rows, or smaller";
        return false;
    }
    job.width = (uint32_t(image.spec.width) + job.reduced - 1) / job.reduced;
    job.height = (uint32_t(image.spec.height) + job.reduced - 1) / job.reduced;
    const uint64_t bytes = uint64_t(job.width) * job.height * texel_bytes;
    if (all_images_bytes.fetch_add(bytes) > all_images_bytes_max - bytes) {
        reason = "would need, with the images before it, more than 4 GiB";
        return false;
    }
    return true;
}

// Reads the first channels; each texel is the mean of those that it replaces.
bool read_floats(opened_image &image, const texture_job &job, int channels, std::vector<float> &pixels,
                 std::string &reason)
{
    const int by = int(job.reduced), width = image.spec.width, height = image.spec.height;
    bool good = true;

    pixels.assign(size_t(job.width) * job.height * size_t(channels), 0);
    if (by == 1) {
        good = image.input->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, pixels.data());
    } else {
        std::vector<float> rows(size_t(by) * size_t(width) * size_t(channels));
        for (int y = 0; good && y < height; y += by) {
            const int count = std::min(by, height - y);
            good = image.input->read_scanlines(0, 0, image.spec.y + y, image.spec.y + y + count, 0, 0, channels,
                                               OIIO::TypeDesc::FLOAT, rows.data());
            float *out = &pixels[size_t(y / by) * job.width * size_t(channels)];
            for (int x = 0; x < width; x++)
                for (int k = 0; k < count; k++)
                    for (int c = 0; c < channels; c++)
                        out[x / by * channels + c] += rows[size_t((k * width + x) * channels + c)] /
                                                      float(count * std::min(by, width - x / by * by));
        }
    }
    if (!good)
        reason = image.input->geterror();
    return good;
}

bool decode_bytes(opened_image &image, texture_job &job, size_t texels, std::string &reason)
{
    const int channels = image.spec.nchannels;
    std::vector<uint8_t> pixels;
    uint8_t *target = job.texels;

    if (channels != 4) {
        pixels.resize(texels * size_t(channels));
        target = pixels.data();
    }
    if (!image.input->read_image(0, 0, 0, channels, OIIO::TypeDesc::UINT8, target)) {
        reason = image.input->geterror();
        return false;
    }
    if (channels != 4)
        expand(pixels.data(), job.texels, texels, channels);
    return true;
}

// Decodes floats; `linear`: the values stay linear light instead of being sRGB-encoded.
bool decode_floats(opened_image &image, texture_job &job, size_t texels, bool linear, std::string &reason)
{
    const int channels = std::min(image.spec.nchannels, 4);
    std::vector<float> pixels;

    if (!read_floats(image, job, channels, pixels, reason))
        return false;
    for (size_t i = 0; i < texels; i++) {
        const float *from = &pixels[i * size_t(channels)];
        unsigned char *to = job.texels + i * texel_bytes;
        for (int c = 0; c < 3; c++) {
            const float value = from[channels >= 3 ? c : 0];
            to[c] = byte_of(job.srgb && linear ? srgb_from_linear_f(std::max(0.0f, value)) : value);
        }
        to[3] = channels == 4 ? byte_of(from[3]) : channels == 2 ? byte_of(from[1]) : 255;
    }
    return true;
}

bool decode(texture_job &job, std::string &reason)
{
    const char *reader = reader_of(job.bytes, job.size_bytes);
    if (!reader) {
        reason = reason_of_unread(job.bytes, job.size_bytes);
        return false;
    }
    opened_image image(job.bytes, job.size_bytes);
    if (!image.open(reader, reason) || !settle_size(image, job, reason))
        return false;
    const size_t texels = size_t(job.width) * job.height;
    job.texels = static_cast<unsigned char *>(calloc(texels, texel_bytes));
    if (!job.texels) {
        reason = "out of memory";
        return false;
    }
    job.has_alpha = image.spec.nchannels == 2 || image.spec.nchannels == 4;
    const bool linear = image.spec.format.is_floating_point();
    return linear || job.reduced > 1 ? decode_floats(image, job, texels, linear, reason)
                                     : decode_bytes(image, job, texels, reason);
}

void run(texture_job &job, bool (*decoder)(texture_job &, std::string &)) noexcept
{
    bool decoded = false;
    std::string reason;

    try {
        decoded = decoder(job, reason);
        // A library's message may have several lines and end in one.
        std::replace(reason.begin(), reason.end(), '\n', ' ');
        while (!reason.empty() && reason.back() == ' ')
            reason.pop_back();
        if (!decoded && reason.empty())
            reason = "cannot be decoded";
        snprintf(job.reason, sizeof(job.reason), "%s", reason.c_str());
    } catch (const std::exception &exception) {
        snprintf(job.reason, sizeof(job.reason), "cannot be decoded: %s", exception.what());
    } catch (...) {
        snprintf(job.reason, sizeof(job.reason), "cannot be decoded");
    }
    if (!decoded) {
        free(job.texels);
        job.texels = nullptr;
        job.width = job.height = 0;
    }
}

void decode_next(texture_job *jobs, size_t count, std::atomic<size_t> &next) noexcept
{
    for (size_t i; (i = next.fetch_add(1)) < count;)
        if (jobs[i].bytes && !jobs[i].texels && !jobs[i].reason[0])
            run(jobs[i], decode);
}

bool decode_halves(texture_job &job, std::string &reason)
{
    const char *reader = reader_of(job.bytes, job.size_bytes);

    if (!reader) {
        reason = "is not an image of a known format";
        return false;
    }
    opened_image image(job.bytes, job.size_bytes);
    if (!image.open(reader, reason))
        return false;
    const int channels = std::min(image.spec.nchannels, 3);
    std::vector<float> pixels;
    if (!settle_size(image, job, reason) || !read_floats(image, job, channels, pixels, reason))
        return false;
    const size_t texels = size_t(job.width) * job.height;
    uint16_t *halves = static_cast<uint16_t *>(calloc(texels, 4 * sizeof(uint16_t)));
    if (!halves) {
        reason = "out of memory";
        return false;
    }
    for (size_t i = 0; i < texels; i++)
        for (size_t c = 0; c < 3; c++)
            halves[i * 4 + c] = half_of_radiance(pixels[i * size_t(channels) + (channels == 3 ? c : 0)]);
    job.texels = reinterpret_cast<unsigned char *>(halves);
    return true;
}
} // namespace

static void decode_all(struct texture_job *jobs, size_t count)
{
    std::atomic<size_t> next{0};
    std::thread helper;

    OIIO::attribute("threads", 1); // our own threads suffice
    if (count > 1) {
        try {
            helper = std::thread(decode_next, jobs, count, std::ref(next));
        } catch (...) {
            // Without a second thread, this one decodes everything.
        }
    }
    decode_next(jobs, count, next);
    if (helper.joinable())
        helper.join();
}

static void decode_environment(struct texture_job *job)
{
    OIIO::attribute("threads", 1);
    run(*job, decode_halves);
}

const struct texture_reader texture_reader = {decode_all, decode_environment};
