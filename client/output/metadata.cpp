// SPDX-License-Identifier: MIT
// Metadata of image files.
#include "metadata.hpp"
#include "layers.hpp"

#include <algorithm>
#include <cinttypes>
#include <cstdio>
#include <cstring>

namespace
{

void add_number(std::vector<metadata_entry> &entries, const char *name, double value)
{
    char text[40];
    std::snprintf(text, sizeof(text), "%.9g", value);
    entries.push_back({name, text, true, static_cast<float>(value)});
}

void add_text(std::vector<metadata_entry> &entries, const char *name, const std::string &text)
{
    entries.push_back({name, text, false, 0});
}

// 64-bit numbers do not fit into any attribute but a string.
void add_count(std::vector<metadata_entry> &entries, const char *name, uint64_t value)
{
    add_text(entries, name, std::to_string(value));
}

// True for the row that only pictures from depth layers have: the share of samples that the layers do not show.
bool is_share_unknown(const struct record_structure_row &row)
{
    return std::strcmp(row.name, "views/unknown") == 0;
}

bool is_from_layers(const struct message_frame_end &end)
{
    return std::any_of(end.structure, end.structure + end.structure_count, is_share_unknown);
}

// Adds rows about the structure. Lengths, warnings and the unknown share belong to the picture; other counts and
// means describe the work done for it, which depends on earlier frames and on the machine.
void add_structure(std::vector<metadata_entry> &entries, const struct message_frame_end &end, bool full)
{
    for (uint32_t i = 0; i < end.structure_count; i++) {
        const struct record_structure_row &row = end.structure[i];
        const std::string name = std::string("structure/") + row.name;
        const bool is_length = row.unit == PROTOCOL_UNIT_METRES, is_mean = row.unit == PROTOCOL_UNIT_PER_RAY;
        if (!is_length && !is_mean && full)
            add_count(entries, name.c_str(), row.number);
        if (is_length || (is_mean && (full || is_share_unknown(row))))
            add_number(entries, (name + "_" + protocol_unit_text(row.unit)).c_str(),
                       static_cast<double>(row.measure));
        if (row.warning[0])
            add_text(entries, (name + "/warning").c_str(), row.warning);
    }
}

void add_stages(std::vector<metadata_entry> &entries, const struct message_frame_end &end)
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

} // namespace

std::vector<metadata_entry> metadata_of(const struct image &image)
{
    const struct message_frame_begin &begin = *image.begin;
    const struct message_frame_end &end = *image.end;
    char digest[20];
    std::snprintf(digest, sizeof(digest), "%016" PRIx64, begin.digest);
    std::vector<metadata_entry> entries;
    add_text(entries, "model", image.model);
    if (image.colour_space)
        add_text(entries, "colour_space", image.colour_space);
    if (image.display_view)
        add_text(entries, "display_view", image.display_view);
    if (image.origin && (image.origin[0] != 0 || image.origin[1] != 0 || image.origin[2] != 0)) {
        char origin[64];
        std::snprintf(origin, sizeof(origin), "%.9g,%.9g,%.9g", static_cast<double>(image.origin[0]),
                      static_cast<double>(image.origin[1]), static_cast<double>(image.origin[2]));
        add_text(entries, "origin", origin);
    }
    add_count(entries, "frame", begin.frame);
    if (image.full_metadata)
        add_count(entries, "revision", begin.revision);
    add_text(entries, "tracer", protocol_tracer_text(begin.tracer));
    add_text(entries, "integrator", protocol_integrator_text(begin.integrator));
    add_count(entries, "samples", begin.samples);
    if (image.part && image.part[0] != '\0') // most of the picture's pixels are in other files
        add_text(entries, "part", image.part);
    else
        add_text(entries, "digest", digest);
    if (has_layers(begin))
        add_text(entries, "layers", layer_names(begin.layers));
    add_number(entries, "exposure_stops", static_cast<double>(begin.exposure_stops));
    add_number(entries, "time_s", static_cast<double>(begin.time_s));
    add_number(entries, "fov_y_degrees", static_cast<double>(begin.fov_y * degrees_per_radian));
    if (image.full_metadata || !is_from_layers(end)) { // layers may come from an earlier frame
        add_count(entries, "primary_rays", end.primary_rays);
        add_count(entries, "shadow_rays", end.shadow_rays);
        add_count(entries, "secondary_rays", end.secondary_rays);
    }
    add_structure(entries, end, image.full_metadata);
    if (image.full_metadata)
        add_stages(entries, end);
    return entries;
}

std::string metadata_lines(const struct image &image)
{
    std::string lines;
    for (const metadata_entry &each : metadata_of(image))
        lines += "farlight/" + each.name + "=" + each.text + "\n";
    return lines;
}
