/* SPDX-License-Identifier: MIT */
/* Decoding of the share of a pixel's colour that moves with the eye. */
#include "lib/sticking.h"

#include "protocol/pixels/sticking.h"

#include <stdlib.h>
#include <zstd.h>

uint8_t *fl_sticking_decode(const uint8_t *encoded, uint64_t encoded_bytes, uint32_t width, uint32_t height,
                            struct fl_error *error)
{
    const size_t count = (size_t)sticking_blocks(width) * sticking_blocks(height);
    uint8_t *blocks = malloc(count), *shares = malloc((size_t)width * height);
    bool good = blocks && shares;
    if (!good)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    else if (ZSTD_decompress(blocks, count, encoded, (size_t)encoded_bytes) != count)
        good = fl_error_set(error, FL_ERROR_PROTOCOL, "frame",
                            "the sticking map does not decompress to %zu blocks", count);
    else if (!sticking_restore(blocks, width, height, shares))
        good = fl_error_set(error, FL_ERROR_PROTOCOL, "frame", "more than all of a block sticks");
    free(blocks);
    if (good)
        return shares;
    free(shares);
    return NULL;
}
