// SPDX-License-Identifier: MIT
// The picture of a comparison.
#pragma once

#include <OpenImageIO/imagebuf.h>

#include <string>
#include <vector>

// Colours (sRGB, three channels) for errors: inferno, from black for 0 to light yellow for `top` and above, by the
// square root of the error, which shows small ones beside great ones. Marked pixels are magenta, which no error
// is.
OIIO::ImageBuf heat_map(const OIIO::ImageBuf &errors, float top, const std::vector<bool> &marked);

// Pictures of one size, from left to right, with their titles above them where a font is found and the pictures
// are wide enough to read them.
OIIO::ImageBuf side_by_side(const std::vector<const OIIO::ImageBuf *> &pictures,
                            const std::vector<std::string> &titles);
