// SPDX-License-Identifier: MIT
// A frame that brings several images, as the channels of one EXR file.
#pragma once

#include "image.h"

#include <OpenEXR/ImfChannelList.h>

#include <string>

// Whether it is more than the picture, or something else.
bool has_layers(const struct message_frame_begin &begin);
// The picture that the frame is a part of; what is told and cannot be is the frame itself.
struct image_window window_of(const struct image &image);
// "beauty,depth"
std::string layer_names(unsigned layers);

// Whether it is light or a colour, and not a number of another kind.
bool is_colour_layer(enum protocol_layer layer);

// DWAA loses something of what it takes for colours, and goes by the ends of names: Y of a position would be one.
enum class exr_part { whole, colours, data };

// The channels of the file, or of a part of it, and their types. With `half_floats` those are half floats that
// such numbers suffice for: colours, directions and shares. Distances, places and numbers of objects never are.
Imf::ChannelList channels_of_part(const struct image &image, enum exr_part part);
// Writes all rows to an output that has those channels: an OutputFile or an OutputPart.
template <typename output> void write_rows(output &file, const struct image &image, enum exr_part part);
