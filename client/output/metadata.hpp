// SPDX-License-Identifier: MIT
// Metadata that image files carry about their picture.
#ifndef FARLIGHT_CLIENT_OUTPUT_METADATA_HPP
#define FARLIGHT_CLIENT_OUTPUT_METADATA_HPP

#include "image.h"

#include <string>
#include <vector>

constexpr float degrees_per_radian = 57.29577951f;

struct metadata_entry {
    std::string name; // follows "farlight/"
    std::string text;
    bool is_number;
    float number;
};
// Collects the metadata. Without full_metadata they are the same each time that the same request is carried out.
std::vector<metadata_entry> metadata_of(const struct image &image);
// Formats all metadata as lines "farlight/NAME=VALUE".
std::string metadata_lines(const struct image &image);

#endif
