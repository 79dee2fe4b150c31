/* SPDX-License-Identifier: MIT */
/* Lossless: what is left of each byte when its neighbours have foretold it, packed by Zstandard.
 *
 * The predictor is the median edge detector of LOCO-I (M. J. Weinberger, G. Seroussi, G. Sapiro: The LOCO-I
 * Lossless Image Compression Algorithm, IEEE Transactions on Image Processing 9(8), 2000, section III-A). The
 * format is described in the protocol's document.
 *
 * Of rendered frames (three of 1280x720 in rgba8, two of 640x360 in rgba32f), beside zstd at the same level:
 *
 *                    bytes         time of a processor
 *   rgba8    1    0.75 .. 0.83     0.95 .. 1.85, most where both are quick
 *   rgba8    3    0.83 .. 0.93     1.05 .. 1.9
 *   rgba32f  1    0.70 .. 0.81     0.95 .. 1.2
 *   rgba32f  3    0.70 .. 0.79     0.9 .. 1.2
 *
 * Level 1 gives fewer bytes of rgba8 than level 3: what is left has few repetitions that would be worth a search.
 */
#include "encode/encoder.h"

#include <stdlib.h>
#include <string.h>
#include <zstd.h>

#define LEVEL_MAX 19 /* as of zstd */
/* Loops over so many bytes become vector instructions. */
#define BLOCK 16u

static size_t picture_bytes(const struct picture *picture)
{
    size_t row_bytes, bytes;
    if (__builtin_mul_overflow((size_t)picture->width, (size_t)picture->bytes_per_pixel, &row_bytes) ||
        __builtin_mul_overflow(row_bytes, (size_t)picture->height, &bytes))
        return 0;
    return bytes;
}

static size_t predicted_bound(const struct picture *picture)
{
    size_t bytes = picture_bytes(picture);
    if (!bytes)
        return 0;
    size_t bound = ZSTD_compressBound(bytes);
    return ZSTD_isError(bound) ? 0 : bound;
}

/* The lesser of left and above where the third is at least as great as both, the greater where it is at most as
 * great, else left + above - third; written without a choice, so that many bytes are done at once. */
static inline uint8_t predict(uint8_t left, uint8_t above, uint8_t above_left)
{
    uint8_t least = left < above ? left : above;
    uint8_t greatest = left < above ? above : left;
    uint8_t third = above_left > greatest ? greatest : above_left < least ? least : above_left;
    return (uint8_t)(least + greatest - third);
}

/* `row` and `above` have a byte before the first one: what lies left of it. */
static void predict_row(uint8_t *restrict out, const uint8_t *restrict row, const uint8_t *restrict above,
                        size_t width)
{
    const uint8_t *left = row - 1, *above_left = above - 1;
    size_t x = 0;
    for (; x + BLOCK <= width; x += BLOCK) {
        for (size_t i = 0; i < BLOCK; i++)
            out[x + i] = (uint8_t)(row[x + i] - predict(left[x + i], above[x + i], above_left[x + i]));
    }
    for (; x < width; x++)
        out[x] = (uint8_t)(row[x] - predict(left[x], above[x], above_left[x]));
}

/* Pixels of four bytes are the common ones: taken as words, many are done at once. */
static void take_channel_of_4(uint8_t *restrict row, const uint8_t *restrict pixels, size_t width, size_t channel)
{
    size_t x = 0;
    for (; x + BLOCK <= width; x += BLOCK) {
        uint32_t words[BLOCK];
        memcpy(words, pixels + 4 * x, sizeof words);
        for (size_t i = 0; i < BLOCK; i++)
            row[x + i] = (uint8_t)(words[i] >> 8 * channel); /* little-endian */
    }
    for (; x < width; x++)
        row[x] = pixels[4 * x + channel];
}

static void take_channel(uint8_t *restrict row, const uint8_t *restrict pixels, size_t width, size_t step)
{
    for (size_t x = 0; x < width; x++)
        row[x] = pixels[x * step];
}

struct residuals {
    const struct picture *picture;
    uint8_t *row, *above; /* of one channel; before the first byte lies a 0 */
    uint8_t *out;
};

static struct residuals *residuals_create(const struct picture *picture)
{
    size_t width = picture->width;
    struct residuals *residuals = calloc(1, sizeof *residuals + 3 * width + 2);
    if (!residuals)
        return NULL;
    residuals->picture = picture;
    residuals->row = (uint8_t *)(residuals + 1) + 1;
    residuals->above = residuals->row + width + 1;
    residuals->out = residuals->above + width;
    return residuals;
}

/* For rows of one channel in turn, from the first on. */
static void residuals_of_row(struct residuals *residuals, size_t channel, size_t y)
{
    size_t width = residuals->picture->width, step = residuals->picture->bytes_per_pixel;
    const uint8_t *pixels = residuals->picture->pixels + y * width * step;
    uint8_t *row = residuals->above;
    residuals->above = residuals->row;
    residuals->row = row;
    if (!y)
        memset(residuals->above, 0, width);
    if (step == 4)
        take_channel_of_4(row, pixels, width, channel);
    else
        take_channel(row, pixels + channel, width, step);
    predict_row(residuals->out, row, residuals->above, width);
}

/* Row by row: all residuals at once would take as much memory as the picture. Returns 0, or an error of zstd's, or
 * how much is left that `out` has no room for. */
static size_t pack(ZSTD_CCtx *context, struct residuals *residuals, ZSTD_outBuffer *out)
{
    size_t height = residuals->picture->height, rows = residuals->picture->bytes_per_pixel * height, left = 0;
    for (size_t i = 0; i < rows; i++) {
        residuals_of_row(residuals, i / height, i % height);
        ZSTD_inBuffer in = {residuals->out, residuals->picture->width, 0};
        bool last = i + 1 == rows;
        do {
            left = ZSTD_compressStream2(context, out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
            if (ZSTD_isError(left) || (left && out->pos == out->size))
                return left;
        } while (last ? left > 0 : in.pos < in.size);
    }
    return left;
}

static bool pack_picture(ZSTD_CCtx *context, const struct picture *picture, ZSTD_outBuffer *out,
                         struct error *error)
{
    struct residuals *residuals = residuals_create(picture);
    if (!context || !residuals) {
        free(residuals);
        return error_set(error, ERROR_OUT_OF_MEMORY, "encoding", "no memory to encode a frame with");
    }
    ZSTD_CCtx_setPledgedSrcSize(context, picture_bytes(picture));
    size_t left = pack(context, residuals, out);
    free(residuals);
    if (ZSTD_isError(left))
        return error_set(error, ERROR_INTERNAL, "encoding", "zstd: %s", ZSTD_getErrorName(left));
    return !left || error_set(error, ERROR_INTERNAL, "encoding", "%zu bytes are too few for a frame", out->size);
}

static size_t predicted_encode(const struct picture *picture, unsigned quality, uint8_t *out, size_t capacity,
                               struct error *error)
{
    ZSTD_outBuffer packed = {out, capacity, 0};
    ZSTD_CCtx *context = ZSTD_createCCtx();
    if (context)
        ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel,
                               quality < 1           ? 1
                               : quality > LEVEL_MAX ? LEVEL_MAX
                                                     : (int)quality);
    bool good = pack_picture(context, picture, &packed, error);
    ZSTD_freeCCtx(context);
    return good ? packed.pos : 0;
}

const struct encoder_impl encoder_predicted_impl = {
    .name = "predicted", .bound = predicted_bound, .encode = predicted_encode};
