// SPDX-License-Identifier: MIT
// A frame to the bytes of an EXR file, in memory: scanlines, zip or DWAA.
#ifndef FARLIGHT_CLIENT_OUTPUT_EXR_ENCODE_HPP
#define FARLIGHT_CLIENT_OUTPUT_EXR_ENCODE_HPP

#include "image.h"

#include <string>
#include <vector>

// `date` is "YYYY:MM:DD hh:mm:ss". Throws what OpenEXR throws.
std::vector<uint8_t> exr_encode(const struct image &image, const std::string &date);

#endif
