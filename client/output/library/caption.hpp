// SPDX-License-Identifier: MIT
// Lines of text in pictures.
#pragma once

#include "output/raster.h"

#include <OpenImageIO/imagebuf.h>

#include <string>

// The font's name; "" if none is installed. Opens the files for drawing, which the sandbox forbids later.
std::string caption_font();
// Draws a line from `x` on, or in the middle of the region for a negative `x`. A line that is too long loses its
// beginning, because the end says more, as in a file's path. `ink` has a number for each channel.
void caption_draw(OIIO::ImageBuf &picture, int x, int baseline, const std::string &text, const std::string &font,
                  const float *ink, const OIIO::ROI &region);

// Draws the message's text into bytes with four channels. False: `reason` is set.
struct message_export_text;
bool caption_draw_into(const struct raster *raster, const struct message_export_text *wanted, char *reason,
                       size_t reason_bytes);
