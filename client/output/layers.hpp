// SPDX-License-Identifier: MIT
// A frame that brings several images, as the channels of one EXR file.
#pragma once

#include "image.h"

#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfOutputFile.h>

#include <string>

// Whether it is more than the picture, or something else.
bool has_layers(const struct message_frame_begin &begin);
// The picture that the frame is a part of; what is told and cannot be is the frame itself.
struct image_window window_of(const struct image &image);
// "beauty,depth"
std::string layer_names(unsigned layers);

// The channels of the file and their types. With `half_floats` those are half floats that such numbers suffice
// for: colours, directions and shares. Distances, places and numbers of objects never are.
void add_channels(Imf::ChannelList &channels, unsigned layers, bool half_floats);
// Writes all rows to an output that has those channels.
void write_rows(Imf::OutputFile &output, const struct image &image);
