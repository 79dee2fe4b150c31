/* SPDX-License-Identifier: MIT */
/* Loops run over blocks of a fixed size and in 16 bits, so that they become vector instructions. */
#include "encode/ycbcr.h"

#include <string.h>

#define BLOCK 16u
#define CHANNELS 3u
/* Before the first column lies its like, which the filter needs; two bytes keep pairs of columns together. */
#define MARGIN 2u

/* Widths are rounded up to whole blocks of chroma, so that no loop has a rest. */
static size_t padded(uint32_t width)
{
    return ((size_t)width + 2 * BLOCK - 1) / (2 * BLOCK) * (2 * BLOCK);
}

static size_t row_bytes(uint32_t width)
{
    return MARGIN + padded(width);
}

/* Two rows of each channel, and a block of what is not kept. */
size_t ycbcr_scratch_bytes(uint32_t width)
{
    return 2 * CHANNELS * row_bytes(width) + 3 * padded(width);
}

/* One row, channel by channel, and what lies beside it. */
static void split_row(uint8_t *row, const uint8_t *pixels, uint32_t width)
{
    size_t bytes = row_bytes(width);
    for (size_t channel = 0; channel < CHANNELS; channel++, row += bytes) {
        uint8_t *to = row + MARGIN;
        size_t x = 0;
        for (; x + BLOCK <= width; x += BLOCK) {
            uint32_t words[BLOCK];
            memcpy(words, pixels + 4 * x, sizeof words);
            for (size_t i = 0; i < BLOCK; i++)
                to[x + i] = (uint8_t)(words[i] >> 8 * channel); /* little-endian */
        }
        for (; x < width; x++)
            to[x] = pixels[4 * x + channel];
        memset(to + width, to[width - 1], padded(width) - width);
        memset(row, to[0], MARGIN);
    }
}

/* Weights are those of the matrix times 219 / 255, in 256ths. */
static void convert_luma(uint8_t *restrict y, const uint8_t *restrict row, uint32_t width)
{
    const uint8_t *red = row + MARGIN, *green = red + row_bytes(width), *blue = green + row_bytes(width);
    for (size_t x = 0; x < padded(width); x += BLOCK) {
        for (size_t i = 0; i < BLOCK; i++) {
            uint16_t sum = (uint16_t)(47 * red[x + i] + 157 * green[x + i] + 16 * blue[x + i] + 128);
            y[x + i] = (uint8_t)(16 + (sum >> 8));
        }
    }
}

/* Means of one channel for a block of chroma, from its columns of two rows, two of which are a word. */
static void mean_of(int16_t *restrict mean, const uint8_t *restrict upper, const uint8_t *restrict lower)
{
    uint16_t pairs[2][BLOCK], before[2][BLOCK];
    memcpy(pairs[0], upper, sizeof pairs[0]);
    memcpy(pairs[1], lower, sizeof pairs[1]);
    memcpy(before[0], upper - 2, sizeof before[0]);
    memcpy(before[1], lower - 2, sizeof before[1]);
    for (size_t i = 0; i < BLOCK; i++) {
        uint16_t left = (uint16_t)((before[0][i] >> 8) + (before[1][i] >> 8));
        uint16_t middle = (uint16_t)((pairs[0][i] & 255) + (pairs[1][i] & 255));
        uint16_t right = (uint16_t)((pairs[0][i] >> 8) + (pairs[1][i] >> 8));
        mean[i] = (int16_t)((left + 2 * middle + right + 4) >> 3);
    }
}

/* Weights are those of the matrix times 224 / 255, in 256ths; of each they add up to 0. */
static void convert_chroma(uint8_t *restrict cb, uint8_t *restrict cr, const uint8_t *upper, const uint8_t *lower,
                           uint32_t width)
{
    size_t bytes = row_bytes(width);
    for (size_t x = 0; 2 * x < padded(width); x += BLOCK) {
        int16_t red[BLOCK], green[BLOCK], blue[BLOCK];
        size_t at = MARGIN + 2 * x;
        mean_of(red, upper + at, lower + at);
        mean_of(green, upper + bytes + at, lower + bytes + at);
        mean_of(blue, upper + 2 * bytes + at, lower + 2 * bytes + at);
        for (size_t i = 0; i < BLOCK; i++) {
            int16_t b = (int16_t)(112 * blue[i] - 26 * red[i] - 86 * green[i] + 128);
            int16_t r = (int16_t)(112 * red[i] - 102 * green[i] - 10 * blue[i] + 128);
            cb[x + i] = (uint8_t)(128 + (b >> 8));
            cr[x + i] = (uint8_t)(128 + (r >> 8));
        }
    }
}

void ycbcr_convert(const struct picture *picture, const struct ycbcr_target *planes, uint8_t *scratch)
{
    uint32_t width = picture->width;
    uint8_t *upper = scratch, *lower = upper + CHANNELS * row_bytes(width);
    uint8_t *y = lower + CHANNELS * row_bytes(width), *cb = y + padded(width), *cr = cb + padded(width);
    for (uint32_t row = 0; row < planes->height; row += 2) {
        uint32_t next = row + 1 < picture->height ? row + 1 : row;
        split_row(upper, picture->pixels + (size_t)4 * width * row, width);
        split_row(lower, picture->pixels + (size_t)4 * width * next, width);
        convert_luma(y, upper, width);
        memcpy(planes->y + row * planes->y_stride_bytes, y, planes->width);
        convert_luma(y, lower, width);
        memcpy(planes->y + (row + 1) * planes->y_stride_bytes, y, planes->width);
        convert_chroma(cb, cr, upper, lower, width);
        memcpy(planes->cb + row / 2 * planes->c_stride_bytes, cb, planes->width / 2);
        memcpy(planes->cr + row / 2 * planes->c_stride_bytes, cr, planes->width / 2);
    }
}
