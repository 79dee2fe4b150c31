/* SPDX-License-Identifier: MIT */
/* Receiving the pixels of a frame. */
#include "incoming.h"

#include <stdlib.h>
#include <string.h>

bool incoming_begin(struct incoming *incoming, const struct message_frame_begin *begin, bool keep)
{
    const uint64_t layers = (uint64_t)__builtin_popcount(begin->layers);
    const uint64_t bytes = layers * begin->width * begin->height * protocol_pixel_format_bytes(begin->format);
    if (incoming->begun || begin->encoding != PROTOCOL_ENCODING_RAW || begin->size_bytes != bytes)
        return false;
    incoming->begun = true;
    incoming->begin = *begin;
    incoming->received_bytes = 0;
    incoming->pixels = keep ? malloc((size_t)bytes) : NULL;
    return true;
}

bool incoming_take(struct incoming *incoming, const struct message_frame_data *data)
{
    if (!incoming->begun || data->offset_bytes != incoming->received_bytes ||
        data->data_bytes > incoming->begin.size_bytes - incoming->received_bytes)
        return false;
    if (incoming->pixels && data->data_bytes > 0)
        memcpy(incoming->pixels + incoming->received_bytes, data->data, data->data_bytes);
    incoming->received_bytes += data->data_bytes;
    return true;
}

bool incoming_is_whole(const struct incoming *incoming)
{
    return incoming->begun && incoming->received_bytes == incoming->begin.size_bytes;
}

void incoming_finish(struct incoming *incoming)
{
    free(incoming->pixels);
    *incoming = (struct incoming){0};
}
