/* SPDX-License-Identifier: MIT */
/* A single Zstandard frame of the unchanged pixels, which includes its decoded size. */
#include "encode/encoder.h"

#include <zstd.h>

/* Maximum level: higher ones need more than a second per megapixel. */
#define LEVEL_MAX 19

static size_t zstd_bound(const struct picture *picture)
{
    size_t bytes = picture_bytes(picture);
    if (!bytes)
        return 0;
    size_t bound = ZSTD_compressBound(bytes);
    return ZSTD_isError(bound) ? 0 : bound;
}

/* Bytes of a step: some milliseconds at the highest level. */
#define STEP_BYTES ((size_t)64 << 10)
/* Limits below which encoding is too quick to be abandoned. */
#define WHOLE_BYTES ((size_t)4 << 20)
#define WHOLE_LEVEL_MAX 5

/* Encodes in steps. Returns the size, an error of zstd's, or 0: it was abandoned. */
static size_t encode_in_steps(ZSTD_CCtx *context, const struct picture *picture, uint8_t *out, size_t capacity)
{
    const size_t bytes = picture_bytes(picture);
    ZSTD_outBuffer packed = {out, capacity, 0};
    ZSTD_CCtx_setPledgedSrcSize(context, bytes);
    for (size_t done = 0; done < bytes;) {
        size_t step = bytes - done < STEP_BYTES ? bytes - done : STEP_BYTES;
        ZSTD_inBuffer in = {picture->pixels + done, step, 0};
        if (picture->is_given_up(picture->given_up_context))
            return 0;
        done += step;
        size_t left;
        do {
            left = ZSTD_compressStream2(context, &packed, &in, done < bytes ? ZSTD_e_continue : ZSTD_e_end);
            if (ZSTD_isError(left))
                return left;
        } while (done < bytes ? in.pos < in.size : left > 0); /* `out` has room for all */
    }
    return packed.pos;
}

static size_t zstd_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                          struct error *error)
{
    const size_t bytes = picture_bytes(picture);
    int level = quality < 1 ? 1 : quality > LEVEL_MAX ? LEVEL_MAX : (int)quality;
    bool whole =
        !picture->is_given_up || bytes <= WHOLE_BYTES || (level <= WHOLE_LEVEL_MAX && bytes <= 16 * WHOLE_BYTES);
    ZSTD_CCtx *context = ZSTD_createCCtx();
    if (!context) {
        error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no memory to encode a frame with");
        return 0;
    }
    ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel, level);
    size_t used = whole ? ZSTD_compress2(context, out, capacity, picture->pixels, bytes)
                        : encode_in_steps(context, picture, out, capacity);
    ZSTD_freeCCtx(context);
    if (ZSTD_isError(used)) {
        error_set(error, ERROR_INTERNAL, "encoding", "zstd: %s", ZSTD_getErrorName(used));
        return 0;
    }
    if (!used)
        encoder_given_up(error);
    return used;
}

const struct encoder_impl encoder_zstd_impl = {.name = "zstd", .bound = zstd_bound, .encode = zstd_encode};
