/* SPDX-License-Identifier: MIT */
/* One Zstandard frame over the pixels as they are, which names its decoded size. */
#include "encode/encoder.h"

#include <zstd.h>

/* Higher levels need more than a second a megapixel. */
#define LEVEL_MAX 19

static size_t zstd_bound(const struct picture *picture)
{
    size_t bytes = picture_bytes(picture);
    if (!bytes)
        return 0;
    size_t bound = ZSTD_compressBound(bytes);
    return ZSTD_isError(bound) ? 0 : bound;
}

static size_t zstd_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                          struct error *error)
{
    int level = quality < 1 ? 1 : quality > LEVEL_MAX ? LEVEL_MAX : (int)quality;
    size_t used = ZSTD_compress(out, capacity, picture->pixels, picture_bytes(picture), level);
    if (ZSTD_isError(used)) {
        error_set(error, ERROR_INTERNAL, "encoding", "zstd: %s", ZSTD_getErrorName(used));
        return 0;
    }
    return used;
}

const struct encoder_impl encoder_zstd_impl = {.name = "zstd", .bound = zstd_bound, .encode = zstd_encode};
