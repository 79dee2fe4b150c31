/* SPDX-License-Identifier: MIT */
/* Pixels to bytes. Leaf on base: knows no GL, no protocol, no job. Any thread. */
#ifndef FARLIGHT_ENCODE_ENCODER_H
#define FARLIGHT_ENCODE_ENCODER_H

#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum encoding {
    ENCODING_RAW,
    ENCODING_ZSTD,
    ENCODING_JPEG,
    ENCODING_H264,
    ENCODING_PREDICTED,
    ENCODING_COUNT
}; /* protocol's numbers */

struct picture {
    uint32_t width, height;
    uint32_t bytes_per_pixel; /* 4, 8 or 16; four channels */
    const uint8_t *pixels;    /* rows from the top, without gaps */
};

struct encoder_impl {
    const char *name;
    /* 0: this encoder cannot do that picture. */
    size_t (*bound)(const struct picture *picture);
    /* Writes at most `capacity` bytes, returns how many; 0 and *error on failure. */
    size_t (*encode)(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                     struct error *error);
};
extern const struct encoder_impl encoder_raw_impl, encoder_zstd_impl, encoder_jpeg_impl, encoder_predicted_impl;

/* Whether `encoding` can carry pictures of that pixel size, for the check before a job starts. */
bool encoder_supports(enum encoding encoding, uint32_t bytes_per_pixel);
/* What comes back is not exactly what was given, and how near it is goes by a quality. */
bool encoder_loses(enum encoding encoding);
/* *out is malloc'ed; quality as in the protocol's render message. */
bool encoder_encode(enum encoding encoding, const struct picture *picture, unsigned quality, uint8_t **out,
                    size_t *out_bytes, struct error *error);

#endif
