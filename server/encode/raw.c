/* SPDX-License-Identifier: MIT */
#include "encode/encoder.h"

#include <string.h>

/* Width and height have at most 32 bits each, so only their product with the pixel size can overflow. */
static size_t raw_bound(const struct picture *picture)
{
    size_t row_bytes, bytes;
    if (__builtin_mul_overflow((size_t)picture->width, (size_t)picture->bytes_per_pixel, &row_bytes) ||
        __builtin_mul_overflow(row_bytes, (size_t)picture->height, &bytes))
        return 0;
    return bytes;
}

static size_t raw_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                         struct error *error)
{
    (void)quality;
    size_t bytes = raw_bound(picture);
    if (bytes > capacity) {
        error_set(error, ERROR_INTERNAL, "encoding", "%zu bytes do not fit into %zu", bytes, capacity);
        return 0;
    }
    memcpy(out, picture->pixels, bytes);
    return bytes;
}

const struct encoder_impl encoder_raw_impl = {.name = "raw", .bound = raw_bound, .encode = raw_encode};
