/* SPDX-License-Identifier: MIT */
/* Y'CbCr 4:2:0 of RGBA8 in double precision, pixel by pixel, as base/ycbcr.h says what it is. */
#ifndef FARLIGHT_TESTS_YCBCR_EXACT_H
#define FARLIGHT_TESTS_YCBCR_EXACT_H

#include "base/ycbcr.h"

#include <math.h>
#include <stdlib.h>

struct exact_picture {
    const uint8_t *pixels; /* RGBA8, rows without gaps */
    uint32_t width, height;
    enum ycbcr kind;
};

/* Red, green and blue, 0 .. 1; beyond the picture lies what is at its edge. */
static inline void exact_colour(const struct exact_picture *picture, int64_t x, int64_t y, double colour[3])
{
    x = x < 0 ? 0 : x < picture->width ? x : picture->width - 1;
    y = y < picture->height ? y : picture->height - 1;
    for (int i = 0; i < 3; i++)
        colour[i] = picture->pixels[4 * (y * picture->width + x) + i] / 255.0;
}

/* Luma, and blue and red less luma, each of those 0 .. 1 and -1/2 .. 1/2. */
static inline void exact_matrix(enum ycbcr kind, const double colour[3], double out[3])
{
    const double red = kind == YCBCR_VIDEO ? 0.2126 : 0.299, blue = kind == YCBCR_VIDEO ? 0.0722 : 0.114;
    out[0] = red * colour[0] + (1 - red - blue) * colour[1] + blue * colour[2];
    out[1] = (colour[2] - out[0]) / (2 * (1 - blue));
    out[2] = (colour[0] - out[0]) / (2 * (1 - red));
}

static inline double exact_luma(const struct exact_picture *picture, uint32_t x, uint32_t y)
{
    double colour[3], out[3];
    exact_colour(picture, x, y, colour);
    exact_matrix(picture->kind, colour, out);
    return picture->kind == YCBCR_VIDEO ? 16 + 219 * out[0] : 255 * out[0];
}

/* 0: Cb, 1: Cr; of the columns 2x and the rows 2y on. */
static inline double exact_chroma(const struct exact_picture *picture, int which, uint32_t x, uint32_t y)
{
    static const double video[] = {0.25, 0.5, 0.25},
                        jpeg[] = {0, 0.5, 0.5}; /* weights of the columns from 2x - 1 on */
    const double *weights = picture->kind == YCBCR_VIDEO ? video : jpeg;
    double mean[3] = {0}, out[3];
    for (int column = 0; column < 3; column++) {
        for (int row = 0; row < 2; row++) {
            double colour[3];
            exact_colour(picture, 2 * (int64_t)x - 1 + column, 2 * (int64_t)y + row, colour);
            for (int i = 0; i < 3; i++)
                mean[i] += weights[column] / 2 * colour[i];
        }
    }
    exact_matrix(picture->kind, mean, out);
    return 128 + (picture->kind == YCBCR_VIDEO ? 224 : 255) * out[1 + which];
}

static inline uint8_t exact_code(double value)
{
    double nearest = floor(value + 0.5);
    return (uint8_t)(nearest < 255 ? nearest : 255);
}

/* Rows in a renderer's form; for free(). NULL: no memory. */
static inline uint8_t *exact_rows(const struct exact_picture *picture)
{
    size_t row_bytes = ycbcr_row_bytes(picture->width), luma_bytes = ycbcr_luma_bytes(picture->width);
    uint8_t *rows = malloc(row_bytes * ycbcr_row_count(picture->height));
    for (uint32_t y = 0; rows && y < ycbcr_row_count(picture->height); y++) {
        for (uint32_t x = 0; x < luma_bytes; x++)
            rows[y * row_bytes + x] = exact_code(exact_luma(picture, x, y));
        for (uint32_t x = 0; x < luma_bytes / 2; x++)
            rows[y * row_bytes + luma_bytes + x] = exact_code(exact_chroma(picture, y & 1, x, y / 2));
    }
    return rows;
}

#endif
