// SPDX-License-Identifier: MIT
// The parts of a picture to one file, some rows of all of them at a time. Parts are hostile: each is checked
// completely when it is opened, except for its compressed rows, which OpenEXR checks when they are read.
#include "merge.h"
#include "exr_stream.hpp"
#include "helper/file.h"
#include "protocol/common/squares.h"
#include "protocol/version.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <charconv>
#include <cstdio>
#include <cstring>
#include <exception>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

namespace
{

constexpr int edge_max = 8192;      // the frames' limit
constexpr int channels_max = 256;   // more than all layers have
constexpr uint32_t band_rows = 64u; // a multiple of the rows that are compressed together
constexpr char part_name[] = "farlight/part";
constexpr uint64_t rays_max = UINT64_MAX / SQUARES_PARTS_MAX; // the sum over all parts still fits
// Attributes that count the rays of a part; the whole picture gets their sum.
constexpr const char *counts[] = {"farlight/primary_rays", "farlight/shadow_rays", "farlight/secondary_rays"};

struct part {
    const char *path;
    std::unique_ptr<descriptor_stream> stream;
    std::unique_ptr<Imf::InputFile> file;
    uint32_t number, parts;
    uint64_t digest;
    std::string device;
    uint64_t rays[std::size(counts)];
};

// The reason why files cannot be merged; `path` is the file at fault, empty: no single one.
struct refusal : std::runtime_error {
    refusal(std::string of, const std::string &why, const char *what_to_do = nullptr)
        : std::runtime_error(why), path(std::move(of)), remedy(what_to_do)
    {
    }
    std::string path;
    const char *remedy;
};

const std::string *text_of(const Imf::Header &header, const char *name)
{
    const auto *found = header.findTypedAttribute<Imf::StringAttribute>(name);
    return found ? &found->value() : nullptr;
}

bool is_size(const Imath::Box2i &box)
{
    return box.min == Imath::V2i(0, 0) && box.max.x >= 0 && box.max.y >= 0 && box.max.x < edge_max &&
           box.max.y < edge_max;
}

// Rejects EXR files that are no parts of a picture.
void check_form(const part &one)
{
    const Imf::Header &header = one.file->header();
    int channels = 0;
    bool are_whole = true;
    for (auto channel = header.channels().begin(); channel != header.channels().end(); ++channel, channels++)
        are_whole = are_whole && channel.channel().xSampling == 1 && channel.channel().ySampling == 1;
    if (header.hasTileDescription() || header.compression() != Imf::ZIP_COMPRESSION || channels == 0 ||
        channels > channels_max || !are_whole || !is_size(header.dataWindow()) ||
        header.dataWindow() != header.displayWindow())
        throw refusal(one.path, "has another form than parts have");
    if (!one.file->isComplete())
        throw refusal(one.path, "is cut off", "render this part again");
}

// Reads an unsigned number at the beginning of `text`, up to the character `end`, and removes both.
template <typename number> bool take_number(std::string &text, number &value, char end, int base = 10)
{
    const char *last = text.data() + text.size();
    const auto [at, failure] = std::from_chars(text.data(), last, value, base);
    if (failure != std::errc() || at == last || *at != end)
        return false;
    text.erase(0, static_cast<size_t>(at - text.data()) + 1);
    return true;
}

void read_name(part &one)
{
    const std::string *name = text_of(one.file->header(), part_name);
    if (!name)
        throw refusal(one.path, "is no part of a picture", "'farlight render --part' makes parts");
    one.device = *name;
    if (!take_number(one.device, one.number, '/') || !take_number(one.device, one.parts, ' ') ||
        !take_number(one.device, one.digest, ' ', 16) || one.number < 1 || one.number > one.parts ||
        one.parts > SQUARES_PARTS_MAX)
        throw refusal(one.path, "does not say which picture it belongs to");
}

void read_rays(part &one)
{
    for (size_t i = 0; i < std::size(counts); i++) {
        const std::string *text = text_of(one.file->header(), counts[i]);
        std::string left = text ? *text + '\n' : "0\n";
        if (!take_number(left, one.rays[i], '\n') || !left.empty() || one.rays[i] > rays_max)
            throw refusal(one.path, std::string(counts[i]) + " is no number of rays");
    }
}

part open_part(const compare_file &file)
{
    part one = {};
    one.path = file.path;
    if (file.fd < 0)
        throw refusal(file.path, file.reason);
    try {
        one.stream = std::make_unique<descriptor_stream>(file.fd);
        one.file = std::make_unique<Imf::InputFile>(*one.stream, 0);
    } catch (const std::exception &exception) {
        throw refusal(file.path, std::string("is no EXR file that can be read: ") + exception.what(),
                      "render this part again");
    }
    check_form(one);
    read_name(one);
    read_rays(one);
    return one;
}

bool is_own(const char *name)
{
    return std::strcmp(name, part_name) == 0 ||
           std::any_of(std::begin(counts), std::end(counts),
                       [=](const char *each) { return !std::strcmp(name, each); });
}

std::vector<uint8_t> bytes_of(const Imf::Attribute &attribute)
{
    memory_stream stream;
    attribute.writeValueTo(stream, 2);
    return stream.file;
}

// The first attribute of `a` that `b` lacks or has with another value; NULL: none.
const char *difference(const Imf::Header &a, const Imf::Header &b)
{
    for (auto each = a.begin(); each != a.end(); ++each) {
        const auto other = b.find(each.name());
        if (other == b.end() || (!is_own(each.name()) &&
                                 (std::strcmp(each.attribute().typeName(), other.attribute().typeName()) != 0 ||
                                  bytes_of(each.attribute()) != bytes_of(other.attribute()))))
            return each.name();
    }
    return nullptr;
}

// Checks that a part belongs to the same picture as the first one.
void check_same(const part &one, const part &first, bool any_device)
{
    const std::string *version = text_of(one.file->header(), "Software");
    const char *other = difference(one.file->header(), first.file->header());
    if (!other)
        other = difference(first.file->header(), one.file->header());
    if (!version || *version != "farlight " FARLIGHT_VERSION)
        throw refusal(one.path,
                      "is of '" + (version ? *version : "another program") +
                          "', and this is farlight " FARLIGHT_VERSION,
                      "render all parts, and merge them, with one version");
    if (one.parts != first.parts)
        throw refusal(one.path, "is one of " + std::to_string(one.parts) + " parts, and " + first.path +
                                    " one of " + std::to_string(first.parts));
    if (other)
        throw refusal(one.path, std::string("differs from ") + first.path + " in " + other);
    if (one.digest != first.digest)
        throw refusal(one.path, std::string("is a part of another picture than ") + first.path +
                                    ": the model, the camera or an option differs");
    if (one.device != first.device && !any_device)
        throw refusal(one.path,
                      "was rendered by '" + one.device + "', and " + first.path + " by '" + first.device + "'",
                      "render it again by the same device, or give --any-device: pixels then differ by rounding");
}

// Lists parts as "part 3" or "parts 3, 5 and 6".
std::string listed(const std::vector<uint32_t> &numbers)
{
    constexpr size_t most = 12;
    std::string text = numbers.size() == 1 ? "part " : "parts ";
    for (size_t i = 0; i < numbers.size() && i < most; i++)
        text += (i == 0 ? "" : i + 1 == numbers.size() ? " and " : ", ") + std::to_string(numbers[i]);
    return numbers.size() > most ? text + " and " + std::to_string(numbers.size() - most) + " more" : text;
}

// Sorts the parts by number; each must occur once.
std::vector<part> sorted(std::vector<part> parts)
{
    const uint32_t count = parts[0].parts;
    std::vector<part> all(count);
    std::vector<uint32_t> missing;
    for (part &one : parts) {
        part &place = all[one.number - 1];
        if (place.file)
            throw refusal(one.path, "is part " + std::to_string(one.number) + ", and so is " + place.path);
        place = std::move(one);
    }
    for (uint32_t i = 0; i < count; i++)
        if (!all[i].file)
            missing.push_back(i + 1);
    if (!missing.empty())
        throw refusal("",
                      listed(missing) + " of " + std::to_string(count) + (missing.size() == 1 ? " is" : " are") +
                          " missing",
                      "render the missing parts, and name the files of all parts");
    return all;
}

Imf::Header header_of_whole(const std::vector<part> &parts)
{
    Imf::Header header = parts[0].file->header();
    header.erase(part_name);
    for (size_t i = 0; i < std::size(counts); i++) {
        uint64_t sum = 0;
        for (const part &one : parts)
            sum += one.rays[i];
        if (text_of(header, counts[i]))
            header.insert(counts[i], Imf::StringAttribute(std::to_string(sum)));
    }
    return header;
}

// A band of rows with all channels.
struct band {
    explicit band(const Imf::Header &header) : width(static_cast<uint32_t>(header.dataWindow().max.x) + 1u)
    {
        for (auto each = header.channels().begin(); each != header.channels().end(); ++each) {
            const size_t bytes = each.channel().type == Imf::HALF ? 2 : 4;
            channels.push_back(
                {each.name(), each.channel().type, bytes, std::vector<char>(bytes * width * band_rows)});
        }
    }
    Imf::FrameBuffer buffer(uint32_t top, uint32_t rows)
    {
        Imf::FrameBuffer made;
        for (channel &each : channels)
            made.insert(each.name,
                        Imf::Slice::Make(each.type, each.pixels.data(), Imath::V2i(0, static_cast<int>(top)),
                                         static_cast<int64_t>(width), rows, each.bytes, each.bytes * width));
        return made;
    }
    struct channel {
        std::string name;
        Imf::PixelType type;
        size_t bytes;
        std::vector<char> pixels;
    };
    uint32_t width;
    std::vector<channel> channels;
};

// Copies those rows of a square that lie in the band from `top` on.
void copy_square(const square &from, uint32_t top, uint32_t rows, const band &source, band &target)
{
    const uint32_t first = std::max(from.y, top), end = std::min(from.y + from.height, top + rows);
    for (size_t c = 0; c < target.channels.size(); c++) {
        const size_t bytes = target.channels[c].bytes;
        for (uint32_t y = first; y < end; y++) {
            const size_t at = (size_t(y - top) * target.width + from.x) * bytes;
            std::copy_n(source.channels[c].pixels.data() + at, from.width * bytes,
                        target.channels[c].pixels.data() + at);
        }
    }
}

// The squares of a part that overlap the rows from `top` on.
std::vector<square> squares_in(const squares &all, const part &one, uint32_t top, uint32_t rows)
{
    std::vector<square> found;
    for (uint32_t i = squares_first(&all, one.number - 1, one.parts);
         i < squares_first(&all, one.number, one.parts); i++) {
        const square each = squares_at(&all, i);
        if (each.y < top + rows && each.y + each.height > top)
            found.push_back(each);
    }
    return found;
}

void read_rows(const part &one, band &into, uint32_t top, uint32_t rows)
{
    try {
        one.file->setFrameBuffer(into.buffer(top, rows));
        one.file->readPixels(static_cast<int>(top), static_cast<int>(top + rows - 1));
    } catch (const std::exception &exception) {
        throw refusal(one.path, std::string("is damaged: ") + exception.what(), "render this part again");
    }
}

std::vector<uint8_t> merged(const std::vector<part> &parts)
{
    const Imf::Header header = header_of_whole(parts);
    const Imath::Box2i window = header.dataWindow();
    const uint32_t width = static_cast<uint32_t>(window.max.x) + 1u,
                   height = static_cast<uint32_t>(window.max.y) + 1u;
    const squares all = squares_of(width, height, parts[0].parts);
    memory_stream stream;
    {
        Imf::OutputFile output(stream, header, 0); // complete when it is destroyed
        band source(header), target(header);
        for (uint32_t top = 0; top < height; top += band_rows) {
            const uint32_t rows = std::min(band_rows, height - top);
            for (const part &one : parts) {
                const std::vector<square> wanted = squares_in(all, one, top, rows);
                if (wanted.empty())
                    continue;
                read_rows(one, source, top, rows);
                for (const square &each : wanted)
                    copy_square(each, top, rows, source, target);
            }
            output.setFrameBuffer(target.buffer(top, rows));
            output.writePixels(static_cast<int>(rows));
        }
    }
    return std::move(stream.file);
}

void merge(const message_merge_images &wanted, const compare_file *files, size_t count)
{
    std::vector<part> parts;
    for (size_t i = 0; i < count; i++) {
        parts.push_back(open_part(files[i]));
        check_same(parts[i], parts[0], wanted.any_device != 0);
    }
    if (parts.empty())
        throw refusal("", "there are no parts");
    const std::vector<uint8_t> file = merged(sorted(std::move(parts)));
    char reason[256] = "";
    if (!file_write(wanted.path, file.data(), file.size(), reason, sizeof(reason)))
        throw refusal(wanted.path, reason);
}

bool fail(merge_result *result, const std::string &path, const char *reason, const char *remedy)
{
    const bool is_long = path.size() >= sizeof(result->field);
    std::snprintf(result->field, sizeof(result->field), "%s%s", is_long ? "..." : "",
                  path.c_str() + (is_long ? path.size() - sizeof(result->field) + 4 : 0));
    std::snprintf(result->reason, sizeof(result->reason), "%s", reason);
    result->remedy = remedy;
    return false;
}

} // namespace

bool merge_images(const struct message_merge_images *wanted, const struct compare_file *files, size_t count,
                  struct merge_result *result)
{
    try {
        merge(*wanted, files, count);
        return true;
    } catch (const refusal &why) {
        return fail(result, why.path, why.what(), why.remedy);
    } catch (const std::exception &exception) {
        return fail(result, "", exception.what(), nullptr);
    }
}
