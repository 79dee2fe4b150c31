/* SPDX-License-Identifier: MIT */
/* Encoders that remember: a picture of a stream is told by what changed since the one before. */
#ifndef FARLIGHT_ENCODE_STREAM_H
#define FARLIGHT_ENCODE_STREAM_H

#include "encode/encoder.h"

/* One thread at a time; any. */
struct encoder_stream;

/* What a picture is to be like. */
struct encoder_wish {
    unsigned quality; /* 1 .. 100, as of JPEG */
    uint64_t bytes;   /* that it may have, about; 0: as many as the quality takes */
    bool key_frame;   /* to be decoded without those before; the first one is so in any case */
};

struct encoded_picture {
    uint8_t *bytes; /* malloc'ed */
    size_t size_bytes;
    bool key_frame;
};

/* Whether there is an encoder of that kind for pictures of that pixel size. The first call may take a while (tens
 * of milliseconds) to load a library: daemons that are never asked go without it. Any thread. */
bool encoder_stream_supports(enum encoding encoding, uint32_t bytes_per_pixel);
/* NULL: there is no memory for it. `frames_per_second` is how many are to come at most. */
struct encoder_stream *encoder_stream_create(enum encoding encoding, float frames_per_second, struct error *error);
/* Of RGBA8, or of the planes that encoder_takes() says. Each picture comes out at once. One of another size than
 * the one before is a key frame. */
bool encoder_stream_encode(struct encoder_stream *stream, const struct picture *picture,
                           const struct encoder_wish *wish, struct encoded_picture *out, struct error *error);
void encoder_stream_destroy(struct encoder_stream *stream); /* accepts NULL */

#endif
