// SPDX-License-Identifier: MIT
// Lines of text in pictures.
#pragma once

#include "output/raster.h"

#include <OpenImageIO/imagebuf.h>

#include <string>

// The font's name; "" where none is installed. Opens what drawing needs, while that is still allowed.
std::string caption_font();
// Draws the line from `x` on, or, with a negative one, in the middle of the region, cut to the region's width: the
// end of a text says most, as that of a file's name. `ink` has a number for each channel.
void caption_draw(OIIO::ImageBuf &picture, int x, int baseline, const std::string &text, const std::string &font,
                  const float *ink, const OIIO::ROI &region);

// Draws what the message says into bytes with four channels. False: `reason` says why.
struct message_export_text;
bool caption_draw_into(const struct raster *raster, const struct message_export_text *wanted, char *reason,
                       size_t reason_bytes);
