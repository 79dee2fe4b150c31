/* SPDX-License-Identifier: MIT */
/* Stream encoders: a picture is encoded as the change since the previous one. */
#ifndef FARLIGHT_ENCODE_STREAM_H
#define FARLIGHT_ENCODE_STREAM_H

#include "encode/encoder.h"

/* An encoder; used by one thread at a time, any. */
struct encoder_stream;

/* Parameters of a picture. */
struct encoder_request {
    unsigned quality; /* 1 .. 100, as for JPEG */
    uint64_t bytes;   /* target size; 0: as many as the quality needs */
    bool key_frame;   /* decodable without earlier pictures; the first picture always is */
};

struct encoded_picture {
    uint8_t *bytes; /* malloc'ed */
    size_t size_bytes;
    bool key_frame;
};

/* Whether there is an encoder of that kind for pictures of that pixel size. The first call may take a while
 * (tens of milliseconds) to load a library, so that daemons without video never load it. Any thread. */
bool encoder_stream_supports(enum encoding encoding, uint32_t bytes_per_pixel);
/* Creates an encoder. NULL: there is no memory. `frames_per_second` is the maximum. */
struct encoder_stream *encoder_stream_create(enum encoding encoding, float frames_per_second, struct error *error);
/* Encodes RGBA8, or the planes that encoder_takes() names. Each picture is returned at once. A picture of
 * another size than the one before is a key frame. */
bool encoder_stream_encode(struct encoder_stream *stream, const struct picture *picture,
                           const struct encoder_request *request, struct encoded_picture *out,
                           struct error *error);
void encoder_stream_destroy(struct encoder_stream *stream); /* accepts NULL */

#endif
