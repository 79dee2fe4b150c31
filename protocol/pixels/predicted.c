/* SPDX-License-Identifier: MIT */
/* The encoding `predicted`. */
#include "protocol/pixels/predicted.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>
#include <zstd.h>

#define LEVEL_MAX 19u /* higher levels need more than a second a megapixel */
#define BLOCK 16u     /* loops over this many bytes become vector instructions */

static size_t bytes_of(const struct predicted_form *form)
{
    size_t row_bytes, bytes;
    if (__builtin_mul_overflow((size_t)form->width, (size_t)form->pixel_bytes, &row_bytes) ||
        __builtin_mul_overflow(row_bytes, (size_t)form->rows, &bytes))
        return 0;
    return bytes;
}

static struct predicted_result no_memory(void)
{
    return (struct predicted_result){.status = PREDICTED_NO_MEMORY, .reason = "out of memory"};
}

static struct predicted_result failed(const char *reason)
{
    return (struct predicted_result){.status = PREDICTED_FAILED, .reason = reason};
}

size_t predicted_bound(const struct predicted_form *form)
{
    size_t bytes = bytes_of(form);
    if (!bytes)
        return 0;
    size_t bound = ZSTD_compressBound(bytes);
    return ZSTD_isError(bound) ? 0 : bound;
}

/* The minimum of left and above if the third is at least both, their maximum if it is at most both, else left +
 * above - third; written without branches, for vector instructions. */
static inline uint8_t predict(uint8_t left, uint8_t above, uint8_t above_left)
{
    uint8_t minimum = left < above ? left : above;
    uint8_t maximum = left < above ? above : left;
    uint8_t third = above_left > maximum ? maximum : above_left < minimum ? minimum : above_left;
    return (uint8_t)(minimum + maximum - third);
}

/* ---- encode ---- */

/* `row` and `above` have a byte before the first one, as its left neighbour. */
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

/* Pixels of four bytes, the usual ones, are read as words, for vector instructions. */
static void copy_channel_of_4(uint8_t *restrict row, const uint8_t *restrict pixels, size_t width, size_t channel)
{
    size_t x = 0;
    for (; x + BLOCK <= width; x += BLOCK) {
        uint32_t words[BLOCK];
        memcpy(words, pixels + 4 * x, sizeof(words));
        for (size_t i = 0; i < BLOCK; i++)
            row[x + i] = (uint8_t)(words[i] >> 8 * channel); /* little-endian */
    }
    for (; x < width; x++)
        row[x] = pixels[4 * x + channel];
}

static void copy_channel(uint8_t *restrict row, const uint8_t *restrict pixels, size_t width, size_t step)
{
    for (size_t x = 0; x < width; x++)
        row[x] = pixels[x * step];
}

struct residuals {
    const struct predicted_form *form;
    const uint8_t *pixels;
    uint8_t *row, *above; /* rows of one channel; the byte before the first is 0 */
    uint8_t *out;
};

static struct residuals *residuals_create(const struct predicted_form *form, const uint8_t *pixels)
{
    size_t width = form->width;
    struct residuals *residuals = calloc(1, sizeof(*residuals) + 3 * width + 2);
    if (!residuals)
        return NULL;
    residuals->form = form;
    residuals->pixels = pixels;
    residuals->row = (uint8_t *)(residuals + 1) + 1;
    residuals->above = residuals->row + width + 1;
    residuals->out = residuals->above + width;
    return residuals;
}

/* Computes the residuals of a row. Called for the rows of a channel in turn, from the first on. */
static void residuals_of_row(struct residuals *residuals, size_t channel, size_t y)
{
    size_t width = residuals->form->width, step = residuals->form->pixel_bytes;
    const uint8_t *pixels = residuals->pixels + y * width * step;
    uint8_t *row = residuals->above;
    residuals->above = residuals->row;
    residuals->row = row;
    if (!y)
        memset(residuals->above, 0, width);
    if (step == 4)
        copy_channel_of_4(row, pixels, width, channel);
    else
        copy_channel(row, pixels + channel, width, step);
    predict_row(residuals->out, row, residuals->above, width);
}

/* Packs row by row, since all residuals at once would take as much memory as the picture. *left: 0, an error of
 * zstd's, or the number of bytes that did not fit into `out`. False: the work was given up. */
static bool pack(ZSTD_CCtx *context, struct residuals *residuals, const struct predicted_source *source,
                 ZSTD_outBuffer *out, size_t *left)
{
    size_t height = residuals->form->rows, rows = residuals->form->pixel_bytes * height;
    *left = 0;
    for (size_t i = 0; i < rows; i++) {
        if (source->is_given_up && source->is_given_up(source->context))
            return false;
        residuals_of_row(residuals, i / height, i % height);
        ZSTD_inBuffer in = {residuals->out, residuals->form->width, 0};
        bool last = i + 1 == rows;
        do {
            *left = ZSTD_compressStream2(context, out, &in, last ? ZSTD_e_end : ZSTD_e_continue);
            if (ZSTD_isError(*left) || (*left && out->pos == out->size))
                return true;
        } while (last ? *left > 0 : in.pos < in.size);
    }
    return true;
}

struct predicted_result predicted_encode(const struct predicted_source *source, uint8_t *out, size_t capacity)
{
    ZSTD_outBuffer packed = {out, capacity, 0};
    ZSTD_CCtx *context = ZSTD_createCCtx();
    struct residuals *residuals = residuals_create(&source->form, source->pixels);
    struct predicted_result result = no_memory();
    if (context && residuals) {
        unsigned level = source->level;
        size_t left;
        ZSTD_CCtx_setParameter(context, ZSTD_c_compressionLevel,
                               (int)(level < 1           ? 1
                                     : level > LEVEL_MAX ? LEVEL_MAX
                                                         : level));
        ZSTD_CCtx_setPledgedSrcSize(context, bytes_of(&source->form));
        if (!pack(context, residuals, source, &packed, &left))
            result = (struct predicted_result){.status = PREDICTED_GIVEN_UP};
        else
            result = ZSTD_isError(left) ? failed(ZSTD_getErrorName(left))
                     : left             ? failed("the capacity is too small")
                                        : (struct predicted_result){.bytes = packed.pos};
    }
    free(residuals);
    ZSTD_freeCCtx(context);
    return result;
}

/* ---- decode ---- */

/* Adds all channels of a row in one pass: a byte depends on its left neighbour, but not on the channels beside
 * that. Inlined for constant values of `step`. */
static inline __attribute__((always_inline)) void add_row(uint8_t *pixels, const uint8_t *above,
                                                          const uint8_t *residuals, size_t plane_bytes,
                                                          size_t width, size_t step)
{
    uint8_t left[16] = {0}, above_left[16] = {0};
    for (size_t x = 0; x < width; x++) {
        for (size_t c = 0; c < step; c++) {
            uint8_t over = above[x * step + c];
            left[c] = (uint8_t)(residuals[c * plane_bytes + x] + predict(left[c], over, above_left[c]));
            above_left[c] = over;
            pixels[x * step + c] = left[c];
        }
    }
}

static void add_predictions(const struct predicted_form *form, const uint8_t *residuals, const uint8_t *zeros,
                            uint8_t *pixels)
{
    size_t width = form->width, step = form->pixel_bytes, plane_bytes = width * form->rows;
    const uint8_t *above = zeros;
    for (uint32_t y = 0; y < form->rows; y++, residuals += width) {
        if (step == 2)
            add_row(pixels, above, residuals, plane_bytes, width, 2);
        else if (step == 4)
            add_row(pixels, above, residuals, plane_bytes, width, 4);
        else if (step == 8)
            add_row(pixels, above, residuals, plane_bytes, width, 8);
        else
            add_row(pixels, above, residuals, plane_bytes, width, 16);
        above = pixels;
        pixels += width * step;
    }
}

struct predicted_result predicted_decode(const struct predicted_form *form, const uint8_t *encoded,
                                         size_t encoded_bytes, uint8_t *pixels)
{
    size_t bytes = bytes_of(form);
    uint8_t *residuals = malloc(bytes), *zeros = calloc(form->width, form->pixel_bytes);
    struct predicted_result result = no_memory();
    if (residuals && zeros) {
        size_t made = ZSTD_decompress(residuals, bytes, encoded, encoded_bytes);
        result = ZSTD_isError(made) ? failed(ZSTD_getErrorName(made))
                 : made != bytes    ? failed("its number of bytes differs from the picture's")
                                    : (struct predicted_result){.bytes = encoded_bytes};
        if (result.status == PREDICTED_DONE)
            add_predictions(form, residuals, zeros, pixels);
    }
    free(residuals);
    free(zeros);
    return result;
}
