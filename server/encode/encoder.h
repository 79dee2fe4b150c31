/* SPDX-License-Identifier: MIT */
/* Pixels to bytes. Leaf on base: knows no GL, no protocol, no job. Any thread. */
#ifndef FARLIGHT_ENCODE_ENCODER_H
#define FARLIGHT_ENCODE_ENCODER_H

#include "base/error.h"
#include "base/ycbcr.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct picture {
    uint32_t width, height;
    uint32_t bytes_per_pixel; /* 4, 8 or 16; four channels. Of attachments 1 and 2, where an encoder takes them */
    const uint8_t *pixels;    /* rows from the top, without gaps */
    /* Other than none: of RGBA8 these planes are given, and no pixels. Only what encoder_takes() says is encoded.
     */
    enum ycbcr ycbcr;
    struct ycbcr_planes planes;
    bool in_scans; /* of a JPEG: its beginning is a coarser picture. Takes four times as long, and fewer bytes */
    /* Asked every few milliseconds by encoders that may take seconds: the bytes are not wanted any more. NULL:
     * they always are. */
    bool (*is_given_up)(const void *context);
    const void *given_up_context;
};

/* Of the pixels; 0: more than a size_t can say. */
size_t picture_bytes(const struct picture *picture);

struct encoder_impl {
    const char *name;
    /* See encoder_takes(). NULL: none, whatever the quality. */
    enum ycbcr (*takes)(unsigned quality);
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
/* Which planes spare it a conversion and lose nothing that it keeps; RGBA8 it takes in any case. */
enum ycbcr encoder_takes(enum encoding encoding, unsigned quality);
bool encoder_given_up(struct error *error); /* the error of an encoder that was; false */
/* *out is malloc'ed; quality as in the protocol's render message. ERROR_CANCELLED: it was given up. */
bool encoder_encode(enum encoding encoding, const struct picture *picture, unsigned quality, uint8_t **out,
                    size_t *out_bytes, struct error *error);

#endif
