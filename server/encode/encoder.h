/* SPDX-License-Identifier: MIT */
/* Encoders from pixels to bytes. Leaf on base: knows no GL, no protocol, no job. Any thread. */
#ifndef FARLIGHT_ENCODE_ENCODER_H
#define FARLIGHT_ENCODE_ENCODER_H

#include "base/error.h"
#include "base/ycbcr.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct picture {
    uint32_t width, height;
    uint32_t bytes_per_pixel; /* 4, 8 or 16; four channels. 1 and 2 for attachments, in encoders that support
                                 them */
    const uint8_t *pixels;    /* rows from the top, without gaps */
    /* Not none: the picture is RGBA8 as these planes, without pixels. Only the planes that encoder_takes()
     * names can be encoded. */
    enum ycbcr ycbcr;
    struct ycbcr_planes planes;
    bool in_scans; /* for JPEG: the beginning is a coarser picture. Takes four times as long, and fewer bytes */
    /* Asked every few milliseconds by encoders that may take seconds: whether the bytes are no longer needed.
     * NULL: they always are. */
    bool (*is_given_up)(const void *context);
    const void *given_up_context;
};

/* Bytes of the pixels; 0: more than a size_t holds. */
size_t picture_bytes(const struct picture *picture);

struct encoder_impl {
    const char *name;
    /* See encoder_takes(). NULL: no planes, whatever the quality. */
    enum ycbcr (*takes)(unsigned quality);
    /* Maximum of encoded bytes; 0: the encoder does not support the picture. */
    size_t (*bound)(const struct picture *picture);
    /* Writes at most `capacity` bytes, returns their number; 0 and *error on failure. */
    size_t (*encode)(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                     struct error *error);
};
extern const struct encoder_impl encoder_raw_impl, encoder_zstd_impl, encoder_jpeg_impl, encoder_predicted_impl;

/* Whether `encoding` supports pictures of that pixel size, for the check before a job starts. */
bool encoder_supports(enum encoding encoding, uint32_t bytes_per_pixel);
/* Whether the encoding is lossy, with a quality that controls the loss. */
bool encoder_loses(enum encoding encoding);
/* Planes that spare the encoder a conversion and lose nothing that it keeps; it always accepts RGBA8. */
enum ycbcr encoder_takes(enum encoding encoding, unsigned quality);
bool encoder_given_up(struct error *error); /* sets the error of an abandoned encoder; false */
/* Encodes a picture. *out is malloc'ed; quality as in the protocol's render message. ERROR_CANCELLED: it was
 * abandoned. */
bool encoder_encode(enum encoding encoding, const struct picture *picture, unsigned quality, uint8_t **out,
                    size_t *out_bytes, struct error *error);

#endif
