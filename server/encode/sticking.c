/* SPDX-License-Identifier: MIT */
/* Encoder of the shares that depend on the eye. */
#include "encode/sticking.h"

#include "protocol/pixels/sticking.h"

#include <stdlib.h>

/* Level of zstd: 57600 blocks take a third of a millisecond, and up to a tenth less than at level 1. */
#define LEVEL 9

bool sticking_encode(const uint8_t *shares, size_t apart, uint32_t width, uint32_t height, uint8_t **out,
                     size_t *out_bytes, struct error *error)
{
    const struct picture picture = {
        .width = sticking_blocks(width), .height = sticking_blocks(height), .bytes_per_pixel = 1};
    uint8_t *blocks = malloc((size_t)picture.width * picture.height);
    if (!blocks)
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "out of memory for what sticks in a frame");
    sticking_round(shares, apart, width, height, blocks);
    struct picture packed = picture;
    packed.pixels = blocks;
    const bool done = encoder_encode(ENCODING_ZSTD, &packed, LEVEL, out, out_bytes, error);
    free(blocks);
    return done;
}
