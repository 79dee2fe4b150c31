/* SPDX-License-Identifier: MIT */
/* The lossless encoding `predicted`, both ways: each byte minus its prediction from its neighbours, compressed by
 * Zstandard. The protocol's document describes the format.
 *
 * The predictor is the median edge detector of LOCO-I (M. J. Weinberger, G. Seroussi, G. Sapiro: The LOCO-I
 * Lossless Image Compression Algorithm, IEEE Transactions on Image Processing 9(8), 2000, section III-A).
 *
 * Rendered frames (three of 1280x720 in rgba8, two of 640x360 in rgba32f), relative to zstd at the same level:
 *
 *                    bytes         time of a processor
 *   rgba8    1    0.75 .. 0.83     0.95 .. 1.85, most where both are quick
 *   rgba8    3    0.83 .. 0.93     1.05 .. 1.9
 *   rgba32f  1    0.70 .. 0.81     0.95 .. 1.2
 *   rgba32f  3    0.70 .. 0.79     0.9 .. 1.2
 *
 * Level 1 gives fewer bytes of rgba8 than level 3: residuals have few repetitions that are worth a search.
 *
 * Any thread. Errors are values; the texts are constants. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_PREDICTED_H
#define FARLIGHT_PROTOCOL_PIXELS_PREDICTED_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum predicted_status { PREDICTED_DONE, PREDICTED_NO_MEMORY, PREDICTED_FAILED, PREDICTED_GIVEN_UP };

struct predicted_result {
    enum predicted_status status;
    const char *reason; /* cause of a failure; else NULL */
    size_t bytes;       /* number of encoded bytes */
};

/* Dimensions, all at least 1; rows have no gaps. */
struct predicted_form {
    uint32_t width, rows, pixel_bytes;
};

struct predicted_source {
    struct predicted_form form;
    const uint8_t *pixels;
    unsigned level; /* zstd's, clamped to 1 .. 19 */
    /* Called at each row of a channel; true ends the work. NULL: the work is never given up. */
    bool (*is_given_up)(const void *context);
    const void *context;
};

/* Maximum size that predicted_encode() may need; 0: it exceeds a size_t. */
size_t predicted_bound(const struct predicted_form *form);
/* Fails if `capacity` is too small. */
struct predicted_result predicted_encode(const struct predicted_source *source, uint8_t *out, size_t capacity);
/* Fills width * rows * pixel_bytes bytes. Pixels have 2, 4, 8 or 16 bytes. Fails if `encoded` is damaged or has
 * another size. */
struct predicted_result predicted_decode(const struct predicted_form *form, const uint8_t *encoded,
                                         size_t encoded_bytes, uint8_t *pixels);

#endif
