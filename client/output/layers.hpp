// SPDX-License-Identifier: MIT
// A frame that brings several images, as the channels of one EXR file.
#pragma once

#include "image.h"

#include <OpenImageIO/imageio.h>

#include <string>
#include <vector>

// Whether it is more than the picture, or something else.
bool has_layers(const struct message_frame_begin &begin);
// "beauty,depth"
std::string layer_names(unsigned layers);

// The channels of the file and their types; the rest of `spec` stays. With `half` those are half floats that such
// numbers suffice for: colours, directions and shares. Distances, places and numbers of objects never are.
void set_layer_channels(OIIO::ImageSpec &spec, unsigned layers, bool half);
// Writes all rows to an output that is open with that spec. False: geterror() of the output says why.
bool write_layers(OIIO::ImageOutput &output, const struct image &image);
