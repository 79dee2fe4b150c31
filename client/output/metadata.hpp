// SPDX-License-Identifier: MIT
// What an image file says about its picture.
#ifndef FARLIGHT_CLIENT_OUTPUT_METADATA_HPP
#define FARLIGHT_CLIENT_OUTPUT_METADATA_HPP

#include "image.h"

#include <OpenImageIO/imageio.h>

// Adds the camera, the date and ours ("farlight/..") in the form that the format can carry: EXR keeps types, PNG
// keeps strings, JPEG and HDR keep one comment.
void add_metadata(OIIO::ImageSpec &spec, const struct image &image);
// All of ours as lines "farlight/NAME=VALUE".
std::string describe(const struct image &image);

#endif
