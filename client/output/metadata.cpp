// SPDX-License-Identifier: MIT
#include "metadata.hpp"
#include "layers.hpp"
#include "protocol/version.h"

#include <cinttypes>
#include <cmath>
#include <cstdio>
#include <ctime>

namespace
{

constexpr float degrees_per_radian = 57.29577951f;

struct entry {
    std::string name;
    std::string text;
    bool is_number;
    float number;
};

// Matrices of EXR stand to the right of row vectors: element [row of the input][column of the output].
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

// The inverse of a rotation and translation. The camera looks along -z, y is up.
matrix world_to_camera(const float world_from_view[12])
{
    matrix made = {};
    for (int axis = 0; axis < 3; axis++) {
        for (int row = 0; row < 3; row++) {
            made.m[row][axis] = world_from_view[4 * row + axis];
            made.m[3][axis] -= world_from_view[4 * row + axis] * world_from_view[4 * row + 3];
        }
    }
    made.m[3][3] = 1;
    return made;
}

// Of OpenEXR's worldToNDC: (0,0) is the upper left corner of the picture, (1,1) the lower right one; z is of no
// meaning and made 1 / distance here.
matrix camera_to_ndc(const struct message_frame_begin &begin)
{
    const float aspect = static_cast<float>(begin.width) / static_cast<float>(begin.height);
    matrix made = {};
    if (begin.fov_y > 0) {
        const float scale = 1 / std::tan(begin.fov_y / 2);
        made.m[0][0] = scale / aspect / 2;
        made.m[1][1] = -scale / 2;
        made.m[2][0] = -0.5f;
        made.m[2][1] = -0.5f;
        made.m[2][3] = -1;
        made.m[3][2] = 1;
        return made;
    }
    const float height = begin.ortho_height > 0 ? begin.ortho_height : 1;
    made.m[0][0] = 1 / (height * aspect);
    made.m[1][1] = -1 / height;
    made.m[2][2] = -1;
    made.m[3][0] = 0.5f;
    made.m[3][1] = 0.5f;
    made.m[3][3] = 1;
    return made;
}

void add_number(std::vector<entry> &entries, const char *name, double value)
{
    char text[40];
    std::snprintf(text, sizeof(text), "%.9g", value);
    entries.push_back({name, text, true, static_cast<float>(value)});
}

void add_text(std::vector<entry> &entries, const char *name, const std::string &text)
{
    entries.push_back({name, text, false, 0});
}

// 64-bit numbers do not fit into any attribute but a string.
void add_count(std::vector<entry> &entries, const char *name, uint64_t value)
{
    add_text(entries, name, std::to_string(value));
}

void add_structure(std::vector<entry> &entries, const struct message_frame_end &end)
{
    for (uint32_t i = 0; i < end.structure_count; i++) {
        const struct record_structure_row &row = end.structure[i];
        const std::string name = std::string("structure/") + row.name;
        if (row.unit == PROTOCOL_UNIT_METRES)
            add_number(entries, (name + "_metres").c_str(), static_cast<double>(row.measure));
        else
            add_count(entries, name.c_str(), row.number);
        if (row.warning[0])
            add_text(entries, (name + "/warning").c_str(), row.warning);
    }
}

void add_stages(std::vector<entry> &entries, const struct message_frame_end &end)
{
    double sums[PROTOCOL_STAGE_COUNT][PROTOCOL_CLOCK_COUNT] = {};
    bool measured[PROTOCOL_STAGE_COUNT][PROTOCOL_CLOCK_COUNT] = {};
    for (uint32_t i = 0; i < end.stages_count; i++) {
        sums[end.stages[i].stage][end.stages[i].clock] += static_cast<double>(end.stages[i].duration_ns) * 1e-6;
        measured[end.stages[i].stage][end.stages[i].clock] = true;
    }
    for (unsigned stage = 0; stage < PROTOCOL_STAGE_COUNT; stage++) {
        for (unsigned clock = 0; clock < PROTOCOL_CLOCK_COUNT; clock++) {
            if (!measured[stage][clock])
                continue;
            const std::string name = std::string("stage/") +
                                     protocol_stage_text(static_cast<protocol_stage>(stage)) + "/" +
                                     protocol_clock_text(static_cast<protocol_clock>(clock)) + "_ms";
            add_number(entries, name.c_str(), sums[stage][clock]);
        }
    }
}

std::vector<entry> collect(const struct image &image)
{
    const struct message_frame_begin &begin = *image.begin;
    const struct message_frame_end &end = *image.end;
    char digest[20];
    std::snprintf(digest, sizeof(digest), "%016" PRIx64, begin.digest);
    std::vector<entry> entries;
    add_text(entries, "model", image.model);
    add_count(entries, "frame", begin.frame);
    add_count(entries, "revision", begin.revision);
    add_text(entries, "tracer", protocol_tracer_text(begin.tracer));
    add_text(entries, "integrator", protocol_integrator_text(begin.integrator));
    add_count(entries, "samples", begin.samples);
    add_text(entries, "digest", digest);
    if (has_layers(begin))
        add_text(entries, "layers", layer_names(begin.layers));
    add_number(entries, "exposure_stops", static_cast<double>(begin.exposure_stops));
    add_number(entries, "time_s", static_cast<double>(begin.time_s));
    add_number(entries, "fov_y_degrees", static_cast<double>(begin.fov_y * degrees_per_radian));
    add_count(entries, "primary_rays", end.primary_rays);
    add_count(entries, "shadow_rays", end.shadow_rays);
    add_count(entries, "secondary_rays", end.secondary_rays);
    add_structure(entries, end);
    add_stages(entries, end);
    return entries;
}

void add_camera(OIIO::ImageSpec &spec, const struct message_frame_begin &begin)
{
    const matrix to_camera = world_to_camera(begin.world_from_view);
    const matrix to_ndc = multiply(to_camera, camera_to_ndc(begin));
    const OIIO::TypeDesc type(OIIO::TypeDesc::FLOAT, OIIO::TypeDesc::MATRIX44);
    spec.attribute("worldToCamera", type, to_camera.m);
    spec.attribute("worldToNDC", type, to_ndc.m);
    spec.attribute("fieldOfView", begin.fov_y * degrees_per_radian);
}

// Rates as people mean them: whole numbers, and the television ones over 1001.
void add_rate(OIIO::ImageSpec &spec, float frames_per_second)
{
    int rational[2] = {static_cast<int>(std::lround(static_cast<double>(frames_per_second) * 1000)), 1000};
    const long television = std::lround(static_cast<double>(frames_per_second) * 1001);
    const float whole = std::round(frames_per_second);
    if (std::fabs(frames_per_second - whole) < 1e-4f) {
        rational[0] = static_cast<int>(whole);
        rational[1] = 1;
    } else if (television % 1000 == 0) {
        rational[0] = static_cast<int>(television);
        rational[1] = 1001;
    }
    spec.attribute("framesPerSecond", OIIO::TypeRational, rational);
}

std::string now_text()
{
    char text[32] = "";
    const std::time_t now = std::time(nullptr);
    struct tm parts = {};
    if (localtime_r(&now, &parts))
        std::strftime(text, sizeof(text), "%Y:%m:%d %H:%M:%S", &parts);
    return text;
}

} // namespace

std::string describe(const struct image &image)
{
    std::string lines;
    for (const entry &each : collect(image))
        lines += "farlight/" + each.name + "=" + each.text + "\n";
    return lines;
}

void add_metadata(OIIO::ImageSpec &spec, const struct image &image)
{
    spec.attribute("Software", "farlight " FARLIGHT_VERSION);
    spec.attribute("DateTime", now_text());
    if (image.format == IMAGE_JPEG)
        spec.attribute("ImageDescription", describe(image));
    if (image.format == IMAGE_JPEG || image.format == IMAGE_HDR)
        return;
    for (const entry &each : collect(image)) {
        if (each.is_number && image.format == IMAGE_EXR)
            spec.attribute("farlight/" + each.name, each.number);
        else if (!each.text.empty())
            spec.attribute("farlight/" + each.name, each.text);
    }
    if (image.format == IMAGE_EXR) {
        add_camera(spec, *image.begin);
        if (image.frames_per_second > 0 && image.frames_per_second < 1e6f)
            add_rate(spec, image.frames_per_second);
    }
}
