// SPDX-License-Identifier: MIT
// Layers of a frame as the channels of one EXR file.
#pragma once

#include "image.h"

#include <OpenEXR/ImfChannelList.h>

#include <string>

// True if the frame has layers besides the beauty, or others instead.
bool has_layers(const struct message_frame_begin &begin);
// The picture that the frame is a part of; for an impossible window the frame itself.
struct image_window window_of(const struct image &image);
// Lists layers as "beauty,depth".
std::string layer_names(unsigned layers);

// True for layers that are light or colour.
bool is_colour_layer(enum protocol_layer layer);

// Parts of a file with DWAA, which compresses with loss all channels that look like colours by the end of their
// names, so that the Y of a position would be one.
enum class exr_part { whole, colours, data };

// The channels of a file, or of a part of it, and their types. `half_floats` stores colours, directions and shares
// as half floats; distances, positions and object numbers stay 32-bit.
Imf::ChannelList channels_of_part(const struct image &image, enum exr_part part);
// Writes all rows to an OutputFile or an OutputPart with those channels.
template <typename output> void write_rows(output &file, const struct image &image, enum exr_part part);
