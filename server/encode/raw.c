/* SPDX-License-Identifier: MIT */
/* Pictures without compression. */
#include "encode/encoder.h"

#include <string.h>

static size_t raw_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                         struct error *error)
{
    (void)quality;
    size_t bytes = picture_bytes(picture);
    if (bytes > capacity) {
        error_set(error, ERROR_INTERNAL, "encoding", "%zu bytes do not fit into %zu", bytes, capacity);
        return 0;
    }
    memcpy(out, picture->pixels, bytes);
    return bytes;
}

const struct encoder_impl encoder_raw_impl = {.name = "raw", .bound = picture_bytes, .encode = raw_encode};
