// SPDX-License-Identifier: MIT
// Conversion of frames to the colours of their files.
#include "colour.h"
#include "layers.hpp"
#include "library.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <strings.h>

namespace
{

using matrix = std::array<std::array<double, 3>, 3>; // rows
using vector = std::array<double, 3>;

// Colour spaces that need no configuration.
struct named_space {
    const char *name;
    float chromaticities[8];
};

// Chromaticities by ITU-R BT.709, BT.2020; SMPTE EG 432-1; SMPTE ST 2065-1; Academy S-2014-004.
const named_space known_spaces[] = {
    {"Linear Rec.709", {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f}},
    {"ACEScg", {0.713f, 0.293f, 0.165f, 0.830f, 0.128f, 0.044f, 0.32168f, 0.33767f}},
    {"ACES2065-1", {0.7347f, 0.2653f, 0.0f, 1.0f, 0.0001f, -0.077f, 0.32168f, 0.33767f}},
    {"Linear Rec.2020", {0.708f, 0.292f, 0.170f, 0.797f, 0.131f, 0.046f, 0.3127f, 0.3290f}},
    {"Linear P3-D65", {0.680f, 0.320f, 0.265f, 0.690f, 0.150f, 0.060f, 0.3127f, 0.3290f}}};
const named_space &rec709 = known_spaces[0], &aces = known_spaces[2];

// Tolerance for two matrices of one space: configurations list four and more digits.
constexpr double SAME_SPACE = 2e-3;

matrix multiply(const matrix &a, const matrix &b)
{
    matrix product = {};
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++)
            for (size_t k = 0; k < 3; k++)
                product[i][j] += a[i][k] * b[k][j];
    return product;
}

vector rgb_of(const float *pixel)
{
    return {static_cast<double>(pixel[0]), static_cast<double>(pixel[1]), static_cast<double>(pixel[2])};
}

vector multiply(const matrix &a, const vector &v)
{
    vector product = {};
    for (size_t i = 0; i < 3; i++)
        for (size_t k = 0; k < 3; k++)
            product[i] += a[i][k] * v[k];
    return product;
}

matrix inverse(const matrix &m)
{
    matrix made = {};
    double determinant = 0;
    for (size_t i = 0; i < 3; i++)
        for (size_t j = 0; j < 3; j++) {
            const size_t i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
            made[j][i] = m[i1][j1] * m[i2][j2] - m[i1][j2] * m[i2][j1];
        }
    for (size_t i = 0; i < 3; i++)
        determinant += m[0][i] * made[i][0];
    for (vector &row : made)
        for (double &element : row)
            element /= determinant;
    return made;
}

vector xyz_of(const float chromaticity[2])
{
    const double x = static_cast<double>(chromaticity[0]), y = static_cast<double>(chromaticity[1]);
    return {x / y, 1, (1 - x - y) / y};
}

// The white has Y = 1. Green of ACES2065-1 has x = 0; no primary has y = 0.
matrix xyz_from(const named_space &space)
{
    matrix primaries = {};
    for (size_t k = 0; k < 3; k++) {
        const vector column = xyz_of(space.chromaticities + 2 * k);
        for (size_t i = 0; i < 3; i++)
            primaries[i][k] = column[i];
    }
    const vector shares = multiply(inverse(primaries), xyz_of(space.chromaticities + 6));
    for (vector &row : primaries)
        for (size_t k = 0; k < 3; k++)
            row[k] *= shares[k];
    return primaries;
}

// Bradford's adaptation (Lam. Metamerism and Colour Constancy. 1985), as ACES and OpenColorIO adapt whites.
matrix adaptation(const named_space &from, const named_space &to)
{
    const matrix cones = {{{0.8951, 0.2664, -0.1614}, {-0.7502, 1.7135, 0.0367}, {0.0389, -0.0685, 1.0296}}};
    const vector before = multiply(cones, xyz_of(from.chromaticities + 6)),
                 after = multiply(cones, xyz_of(to.chromaticities + 6));
    matrix scaled = cones;
    for (size_t i = 0; i < 3; i++)
        for (double &element : scaled[i])
            element *= after[i] / before[i];
    return multiply(inverse(cones), scaled);
}

matrix from_rec709(const named_space &to)
{
    return multiply(inverse(xyz_from(to)), multiply(adaptation(rec709, to), xyz_from(rec709)));
}

// The conversion of all frames of this run.
struct {
    bool converts, shows; // `shows`: pictures of 8 bits
    bool is_linear;       // the matrix converts, and equals the configuration's transform
    matrix by;
    const float *chromaticities = rec709.chromaticities;
} run;

bool fail(char *reason, size_t reason_bytes, const std::string &text)
{
    std::snprintf(reason, reason_bytes, "%s", text.c_str());
    return false;
}

const named_space *find_known(const char *name)
{
    for (const named_space &each : known_spaces)
        if (strcasecmp(each.name, name) == 0)
            return &each;
    return nullptr;
}

void use(const matrix &by)
{
    run.is_linear = true;
    run.by = by;
    run.chromaticities = nullptr;
    for (const named_space &each : known_spaces) {
        const matrix its = from_rec709(each);
        double difference = 0;
        for (size_t i = 0; i < 9; i++)
            difference = std::max(difference, std::fabs(its[i / 3][i % 3] - by[i / 3][i % 3]));
        if (difference < SAME_SPACE)
            run.chromaticities = each.chromaticities;
    }
}

// A configuration does not state whether a transform is linear, so probe colours decide.
void find_matrix(const struct image_library *library)
{
    static const float probes[][3] = {
        {0, 0, 0}, {0.18f, 0.18f, 0.18f}, {7, 0.5f, 2}, {0.01f, 3, 0}, {90, 80, 100}};
    matrix by = {};
    for (size_t k = 0; k < 3; k++) {
        float unit[4] = {0, 0, 0, 1};
        unit[k] = 1;
        library->colour_apply(unit, 1);
        for (size_t i = 0; i < 3; i++)
            by[i][k] = static_cast<double>(unit[i]);
    }
    for (const float *probe : probes) {
        float made[4] = {probe[0], probe[1], probe[2], 1};
        const vector straight = multiply(by, rgb_of(probe));
        library->colour_apply(made, 1);
        for (size_t i = 0; i < 3; i++)
            if (!(std::fabs(static_cast<double>(made[i]) - straight[i]) <=
                  1e-4 * std::max(1.0, std::fabs(straight[i]))))
                return;
    }
    use(by);
}

bool open_configuration(const struct colour_wanted *wanted, char *reason, size_t reason_bytes)
{
    const struct image_library *library = library_loaded(reason, reason_bytes);
    const matrix to_aces = from_rec709(aces);
    struct library_colour how = {wanted->config, wanted->space, wanted->view, {}};
    for (size_t i = 0; i < 9; i++)
        how.aces_from_rec709[i] = static_cast<float>(to_aces[i / 3][i % 3]);
    if (!library || !library->colour_open(&how, reason, reason_bytes))
        return false;
    run.chromaticities = nullptr;
    if (!run.shows)
        find_matrix(library);
    return true;
}

// Converts a row's pixels, with straight alpha as in image files.
void convert_row(float *row, size_t width)
{
    for (size_t i = 0; i < width; i++) {
        float *pixel = row + 4 * i;
        if (run.is_linear) {
            const vector made = multiply(run.by, rgb_of(pixel));
            std::transform(made.begin(), made.end(), pixel,
                           [](double value) { return static_cast<float>(value); });
        } else if (pixel[3] > 0) {
            std::for_each(pixel, pixel + 3, [=](float &value) { value /= pixel[3]; });
        }
    }
    if (run.is_linear)
        return;
    char unused[1];
    library_loaded(unused, sizeof(unused))->colour_apply(row, width);
    for (size_t i = 0; i < width && !run.shows; i++)
        for (size_t c = 0; c < 3; c++)
            row[4 * i + c] *= row[4 * i + 3] > 0 ? row[4 * i + 3] : 1;
}

uint8_t byte_of(float value)
{
    return value > 0 ? static_cast<uint8_t>(std::min(value, 1.0f) * 255.0f + 0.5f) : 0; // NaN becomes 0
}

} // namespace

bool colour_is_wanted(const struct colour_wanted *wanted)
{
    return wanted->space || wanted->view;
}

bool colour_needs_library(const struct colour_wanted *wanted)
{
    return wanted->view || (wanted->space && !find_known(wanted->space));
}

bool colour_prepare(const struct colour_wanted *wanted, char *reason, size_t reason_bytes)
{
    run.converts = colour_is_wanted(wanted);
    run.shows = wanted->view != nullptr;
    if (run.converts && !colour_needs_library(wanted))
        use(from_rec709(*find_known(wanted->space)));
    if (!colour_needs_library(wanted))
        return true;
    if (wanted->config)
        return open_configuration(wanted, reason, reason_bytes);
    std::string names;
    for (const named_space &each : known_spaces)
        names += std::string(names.empty() ? "" : ", ") + each.name;
    return fail(reason, reason_bytes, std::string("without a configuration of OpenColorIO there are: ") + names);
}

bool colour_convert(struct message_frame_begin *begin, uint8_t *pixels, char *reason, size_t reason_bytes)
{
    if (!run.converts)
        return true;
    if (begin->format != PROTOCOL_PIXEL_FORMAT_RGBA32F)
        return fail(reason, reason_bytes, "colours are converted from 32-bit floats");
    float *values = reinterpret_cast<float *>(pixels);
    size_t plane = 0;
    const size_t plane_values = size_t(begin->width) * begin->height * 4;
    for (unsigned layer = 0; layer < PROTOCOL_LAYER_COUNT; layer++) {
        if ((begin->layers & 1u << layer) == 0)
            continue;
        for (size_t y = 0; y < begin->height && is_colour_layer(static_cast<protocol_layer>(layer)); y++)
            convert_row(values + plane * plane_values + y * begin->width * 4, begin->width);
        plane++;
    }
    if (!run.shows)
        return true;
    // A byte is written only after the float at its place was read.
    std::transform(values, values + plane_values, pixels, byte_of);
    begin->format = PROTOCOL_PIXEL_FORMAT_RGBA8;
    return true;
}

const float *colour_chromaticities(void)
{
    return run.chromaticities;
}
