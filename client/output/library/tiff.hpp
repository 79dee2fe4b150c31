// SPDX-License-Identifier: MIT
// A picture to the bytes of a TIFF file: one strip, deflated, without a date of its own. By libtiff, for
// OpenImageIO dates every file, and writes a broken second directory where files are in memory.
#ifndef FARLIGHT_CLIENT_OUTPUT_LIBRARY_TIFF_HPP
#define FARLIGHT_CLIENT_OUTPUT_LIBRARY_TIFF_HPP

#include "output/library.h"

#include <string>
#include <vector>

// `image` has 1-byte components, with straight alpha where there are four; empty texts are left out. False: `why`
// says why. May throw std::bad_alloc.
bool tiff_encode(const struct library_image &image, std::vector<unsigned char> &file, std::string &why);

#endif
