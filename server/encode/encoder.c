/* SPDX-License-Identifier: MIT */
/* Choice of an encoder by its number. */
#include "encode/encoder.h"

#include <stdlib.h>

/* Implementations by the protocol's number; all their callers are in this file. */
static const struct encoder_impl *const impls[ENCODING_COUNT] = {
    [ENCODING_RAW] = &encoder_raw_impl,
    [ENCODING_ZSTD] = &encoder_zstd_impl,
    [ENCODING_JPEG] = &encoder_jpeg_impl,
    [ENCODING_PREDICTED] = &encoder_predicted_impl,
};

static bool is_known(enum encoding encoding)
{
    return (unsigned)encoding < ENCODING_COUNT && impls[encoding];
}

/* Width and height have at most 32 bits each, so only their product with the pixel size can overflow. */
size_t picture_bytes(const struct picture *picture)
{
    size_t row_bytes, bytes;
    if (__builtin_mul_overflow((size_t)picture->width, (size_t)picture->bytes_per_pixel, &row_bytes) ||
        __builtin_mul_overflow(row_bytes, (size_t)picture->height, &bytes))
        return 0;
    return bytes;
}

bool encoder_supports(enum encoding encoding, uint32_t bytes_per_pixel)
{
    struct picture probe = {.width = 1, .height = 1, .bytes_per_pixel = bytes_per_pixel};
    bool is_pixel_size = bytes_per_pixel == 4 || bytes_per_pixel == 8 || bytes_per_pixel == 16;
    return is_known(encoding) && is_pixel_size && impls[encoding]->bound(&probe) != 0;
}

bool encoder_loses(enum encoding encoding)
{
    return encoding == ENCODING_JPEG || encoding == ENCODING_H264;
}

enum ycbcr encoder_takes(enum encoding encoding, unsigned quality)
{
    if (encoding == ENCODING_H264)
        return YCBCR_VIDEO;
    return is_known(encoding) && impls[encoding]->takes ? impls[encoding]->takes(quality) : YCBCR_NONE;
}

bool encoder_given_up(struct error *error)
{
    return error_set(error, ERROR_CANCELLED, "encoding", "the frame is not wanted any more");
}

bool encoder_encode(enum encoding encoding, const struct picture *picture, unsigned quality, uint8_t **out,
                    size_t *out_bytes, struct error *error)
{
    *out = NULL;
    *out_bytes = 0;
    if (!is_known(encoding))
        return error_set(error, ERROR_UNSUPPORTED, "encoding", "encoding number %u is not known",
                         (unsigned)encoding);
    const struct encoder_impl *impl = impls[encoding];
    size_t capacity = picture->width && picture->height ? impl->bound(picture) : 0;
    if (!capacity)
        return error_set(error, ERROR_UNSUPPORTED, "encoding", "%s cannot carry %ux%u pixels of %u bytes",
                         impl->name, picture->width, picture->height, picture->bytes_per_pixel);
    if (picture->ycbcr != YCBCR_NONE && picture->ycbcr != encoder_takes(encoding, quality))
        return error_set(error, ERROR_UNSUPPORTED, "encoding", "%s of quality %u does not take such planes",
                         impl->name, quality);
    uint8_t *bytes = malloc(capacity);
    if (!bytes)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no %zu bytes to encode a frame into", capacity);
    size_t used = impl->encode(picture, quality, bytes, capacity, error);
    if (!used) {
        free(bytes);
        /* An implementation that fails says why; this error only stands where it did not. */
        return error_set(error, ERROR_INTERNAL, "encoding", "%s gave no bytes", impl->name);
    }
    /* Trims the bytes: a compressed frame is usually far below its bound, and may wait in a queue for a while. */
    uint8_t *trimmed = used < capacity / 2 ? realloc(bytes, used) : NULL;
    *out = trimmed ? trimmed : bytes;
    *out_bytes = used;
    return true;
}
