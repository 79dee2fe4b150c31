// SPDX-License-Identifier: MIT
// Encoding of EXR files.
#include "exr_encode.hpp"
#include "exr_stream.hpp"
#include "layers.hpp"
#include "mattes.hpp"
#include "metadata.hpp"
#include "protocol/version.h"

#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartOutputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfOutputPart.h>
#include <OpenEXR/ImfPartType.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>

#include <algorithm>
#include <cmath>

namespace
{

// Matrices of EXR multiply row vectors from the right: element [row of the input][column of the output].
struct matrix {
    float m[4][4];
};

matrix multiply(const matrix &a, const matrix &b)
{
    matrix product = {};
    for (int i = 0; i < 4; i++)
        for (int j = 0; j < 4; j++)
            for (int k = 0; k < 4; k++)
                product.m[i][j] += a.m[i][k] * b.m[k][j];
    return product;
}

// OpenEXR's camera space is left-handed: x to the right, y up, z along the view, where ours looks along -z.
matrix world_to_camera(const float world_from_view[12])
{
    matrix made = {};
    for (int axis = 0; axis < 3; axis++) {
        const float sign = axis == 2 ? -1.0f : 1.0f;
        for (int row = 0; row < 3; row++) {
            const float element = sign * world_from_view[4 * row + axis];
            made.m[row][axis] = element;
            made.m[3][axis] -= element * world_from_view[4 * row + 3];
        }
    }
    made.m[3][3] = 1;
    return made;
}

// OpenEXR's worldToNDC: (0,0) is the upper left corner of the picture, (1,1) the lower right one; z has no meaning
// and is 1 / distance here.
matrix camera_to_ndc(const struct message_frame_begin &begin, float aspect)
{
    matrix made = {};
    if (begin.fov_y > 0) {
        const float scale = 1 / std::tan(begin.fov_y / 2);
        made.m[0][0] = scale / aspect / 2;
        made.m[1][1] = -scale / 2;
        made.m[2][0] = 0.5f;
        made.m[2][1] = 0.5f;
        made.m[2][3] = 1;
        made.m[3][2] = 1;
        return made;
    }
    const float height = begin.ortho_height > 0 ? begin.ortho_height : 1;
    made.m[0][0] = 1 / (height * aspect);
    made.m[1][1] = -1 / height;
    made.m[2][2] = 1;
    made.m[3][0] = 0.5f;
    made.m[3][1] = 0.5f;
    made.m[3][3] = 1;
    return made;
}

void add_camera(Imf::Header &header, const struct message_frame_begin &begin)
{
    const Imath::Box2i whole = header.displayWindow();
    const float aspect =
        static_cast<float>(whole.max.x + 1 - whole.min.x) / static_cast<float>(whole.max.y + 1 - whole.min.y);
    const matrix to_camera = world_to_camera(begin.world_from_view);
    const matrix to_ndc = multiply(to_camera, camera_to_ndc(begin, aspect));
    header.insert("worldToCamera", Imf::M44fAttribute(Imath::M44f(to_camera.m)));
    header.insert("worldToNDC", Imf::M44fAttribute(Imath::M44f(to_ndc.m)));
    // Width of the plane at distance 1 for a pinhole, of the picture itself for parallel rays.
    header.screenWindowWidth() =
        aspect * (begin.fov_y > 0 ? 2 * std::tan(begin.fov_y / 2) : std::max(begin.ortho_height, 0.0f));
    header.insert("fieldOfView", Imf::FloatAttribute(begin.fov_y * degrees_per_radian));
}

// Adds the exact rate: whole numbers, and the television rates over 1001.
void add_rate(Imf::Header &header, float frames_per_second)
{
    Imf::Rational rate(static_cast<int>(std::lround(static_cast<double>(frames_per_second) * 1000)), 1000);
    const long television = std::lround(static_cast<double>(frames_per_second) * 1001);
    const float whole = std::round(frames_per_second);
    if (std::fabs(frames_per_second - whole) < 1e-4f) {
        rate = Imf::Rational(static_cast<int>(whole), 1);
    } else if (television % 1000 == 0) {
        rate = Imf::Rational(static_cast<int>(television), 1001);
    }
    header.insert("framesPerSecond", Imf::RationalAttribute(rate));
}

Imf::Header make_header(const struct image &image, const std::string &date, enum exr_part part)
{
    const image_window whole = window_of(image);
    const Imath::V2i corner(static_cast<int>(whole.x), static_cast<int>(whole.y));
    const Imath::V2i size(static_cast<int>(image.begin->width), static_cast<int>(image.begin->height));
    Imf::Header header(
        Imath::Box2i({0, 0}, {static_cast<int>(whole.width) - 1, static_cast<int>(whole.height) - 1}),
        Imath::Box2i(corner, corner + size - Imath::V2i(1, 1)));
    const bool loses = image.dwaa && part != exr_part::data;
    header.compression() = loses ? Imf::DWAA_COMPRESSION : Imf::ZIP_COMPRESSION;
    header.channels() = channels_of_part(image, part);
    if (const float *xy = image.chromaticities)
        Imf::addChromaticities(
            header, Imf::Chromaticities({xy[0], xy[1]}, {xy[2], xy[3]}, {xy[4], xy[5]}, {xy[6], xy[7]}));
    header.insert("Software", Imf::StringAttribute("farlight " FARLIGHT_VERSION));
    if (!date.empty())
        Imf::addCapDate(header, date);
    for (const metadata_entry &each : metadata_of(image)) {
        const std::string name = "farlight/" + each.name;
        if (each.is_number)
            header.insert(name, Imf::FloatAttribute(each.number));
        else if (!each.text.empty())
            header.insert(name, Imf::StringAttribute(each.text));
    }
    for (const metadata_entry &each : matte_metadata(image.mattes, image.begin->layers))
        header.insert(each.name, Imf::StringAttribute(each.text));
    add_camera(header, *image.begin);
    if (image.frames_per_second > 0 && image.frames_per_second < 1e6f)
        add_rate(header, image.frames_per_second);
    return header;
}

// DWAA compresses colours with loss, so other layers form a part of their own.
std::vector<enum exr_part> parts_of(const struct image &image)
{
    const Imf::ChannelList colours = channels_of_part(image, exr_part::colours),
                           data = channels_of_part(image, exr_part::data);
    if (!image.dwaa)
        return {exr_part::whole};
    if (data.begin() == data.end())
        return {exr_part::colours};
    if (colours.begin() == colours.end())
        return {exr_part::data};
    return {exr_part::colours, exr_part::data};
}

void write_parts(memory_stream &stream, const struct image &image, const std::string &date,
                 const std::vector<enum exr_part> &parts)
{
    std::vector<Imf::Header> headers;
    for (const enum exr_part part : parts) {
        headers.push_back(make_header(image, date, part));
        headers.back().setName(part == exr_part::colours ? "rgba" : "data");
        headers.back().setType(Imf::SCANLINEIMAGE);
    }
    Imf::MultiPartOutputFile output(stream, headers.data(), static_cast<int>(headers.size()));
    for (size_t i = 0; i < parts.size(); i++) {
        Imf::OutputPart file(output, static_cast<int>(i));
        write_rows(file, image, parts[i]);
    }
}

} // namespace

std::vector<uint8_t> exr_encode(const struct image &image, const std::string &date)
{
    memory_stream stream;
    const std::vector<enum exr_part> parts = parts_of(image);
    if (parts.size() == 1) {
        Imf::OutputFile output(stream, make_header(image, date, parts[0])); // complete when it is destroyed
        write_rows(output, image, parts[0]);
    } else {
        write_parts(stream, image, date, parts);
    }
    return std::move(stream.file);
}
