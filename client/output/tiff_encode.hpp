// SPDX-License-Identifier: MIT
// Pixels to the bytes of a TIFF file, in memory: 8 bits, one strip, deflated. By hand, because OpenImageIO dates
// every such file, and the same picture must make the same bytes.
//
// TIFF Revision 6.0 (1992), sections 2, 14 (differences of neighbours), 18 (alpha); Technical Note 2 (deflate).
#ifndef FARLIGHT_CLIENT_OUTPUT_TIFF_ENCODE_HPP
#define FARLIGHT_CLIENT_OUTPUT_TIFF_ENCODE_HPP

#include "raster.h"

#include <cstdint>
#include <string>
#include <vector>

// `raster` has 1-byte components, with straight alpha where there are four. Empty texts are left out. Throws
// std::runtime_error or std::bad_alloc.
std::vector<uint8_t> tiff_encode(const struct raster &raster, const std::string &description,
                                 const std::string &date);

#endif
