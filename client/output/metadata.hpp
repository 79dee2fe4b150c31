// SPDX-License-Identifier: MIT
// What an image file says about its picture.
#ifndef FARLIGHT_CLIENT_OUTPUT_METADATA_HPP
#define FARLIGHT_CLIENT_OUTPUT_METADATA_HPP

#include "image.h"

#include <string>
#include <vector>

constexpr float degrees_per_radian = 57.29577951f;

struct metadata_entry {
    std::string name; // after "farlight/"
    std::string text;
    bool is_number;
    float number;
};
// Without full_metadata only what is the same whenever the same request is carried out.
std::vector<metadata_entry> metadata_of(const struct image &image);
// All of them as lines "farlight/NAME=VALUE".
std::string metadata_lines(const struct image &image);

#endif
