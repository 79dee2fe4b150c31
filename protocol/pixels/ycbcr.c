/* SPDX-License-Identifier: MIT */
/* Conversion of pictures to RGB and Y'CbCr for video. */
#include "protocol/pixels/ycbcr.h"

#include "protocol/common/srgb.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Margins for odd pictures that are made even and for the filter: a column before the first and two after the
 * last. */
#define MARGIN_BEFORE 1u
#define MARGIN_AFTER 2u

/* ---- alpha ---- */

static uint8_t (*make_over_black(void))[256]
{
    uint8_t(*over_black)[256] = malloc(sizeof(*over_black) * 256);
    for (unsigned alpha = 0; over_black && alpha < 256; alpha++)
        for (unsigned value = 0; value < 256; value++)
            over_black[alpha][value] =
                (uint8_t)lround(255 * srgb_from_linear(linear_from_srgb(value / 255.0) * alpha / 255.0));
    return over_black;
}

bool ycbcr_converter_init(struct ycbcr_converter *converter, uint32_t width, uint32_t height,
                          enum ycbcr_alpha alpha)
{
    size_t row_bytes = 3 * ((size_t)width + MARGIN_BEFORE + MARGIN_AFTER);
    *converter = (struct ycbcr_converter){
        .over_black = alpha == YCBCR_ALPHA_OVER_BLACK ? make_over_black() : NULL,
        .width = width,
        .height = height,
        .rows = {malloc(row_bytes), malloc(row_bytes)},
    };
    if (converter->rows[0] && converter->rows[1] && (alpha == YCBCR_ALPHA_IGNORED || converter->over_black))
        return true;
    ycbcr_converter_finish(converter);
    return false;
}

void ycbcr_converter_finish(struct ycbcr_converter *converter)
{
    free(converter->over_black);
    free(converter->rows[0]);
    free(converter->rows[1]);
    *converter = (struct ycbcr_converter){0};
}

/* Copies three of every four bytes. */
static void copy_colours(uint8_t *to, const uint8_t *from, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++, from += 4, to += 3) {
        to[0] = from[0];
        to[1] = from[1];
        to[2] = from[2];
    }
}

static void copy_over_black(const struct ycbcr_converter *converter, uint8_t *to, const uint8_t *from)
{
    for (uint32_t x = 0; x < converter->width; x++, from += 4, to += 3) {
        const uint8_t *shown = converter->over_black[from[3]];
        to[0] = shown[from[0]];
        to[1] = shown[from[1]];
        to[2] = shown[from[2]];
    }
}

/* Makes one row of RGB with its margins, and returns its first pixel; rows beyond the last repeat it. */
static const uint8_t *make_row(struct ycbcr_converter *converter, unsigned which, const uint8_t *pixels,
                               uint32_t row)
{
    const uint32_t width = converter->width;
    const uint8_t *from = pixels + 4 * (size_t)width * (row < converter->height ? row : converter->height - 1);
    uint8_t *first = converter->rows[which] + (size_t)3 * MARGIN_BEFORE, *to = first + 3 * (size_t)width;
    if (converter->over_black)
        copy_over_black(converter, first, from);
    else
        copy_colours(first, from, width);
    for (unsigned i = 0; i < MARGIN_AFTER; i++, to += 3)
        memcpy(to, to - 3, 3);
    memcpy(first - 3, first, 3);
    return first;
}

const uint8_t *ycbcr_opaque_row(struct ycbcr_converter *converter, const uint8_t *pixels, uint32_t row)
{
    return make_row(converter, 0, pixels, row);
}

/* ---- Y'CbCr ---- */

/* BT.709-6: E'Y = 0.2126 R + 0.7152 G + 0.0722 B, E'Cb = (B - E'Y) / 1.8556, E'Cr = (R - E'Y) / 1.5748; then
 * 219 E'Y + 16 and 224 E'C + 128. Fixed point: with 22 bits the error of a luma is below 1e-4 of a step; chroma
 * comes from sums over 8 weights, so that 19 bits stay within 31 (error below 1e-3). */
#define LUMA_BITS 22
#define CHROMA_BITS 19
#define FIXED(value, bits) ((int32_t)((value) * (1 << (bits)) + ((value) < 0 ? -0.5 : 0.5)))
#define LUMA(weight) FIXED((weight)*219.0 / 255.0, LUMA_BITS)
#define CHROMA(weight, range) FIXED((weight) / (range)*224.0 / 255.0, CHROMA_BITS)

static uint8_t luma_of(const uint8_t rgb[3])
{
    return (uint8_t)((LUMA(0.2126) * rgb[0] + LUMA(0.7152) * rgb[1] + LUMA(0.0722) * rgb[2] +
                      (33 << (LUMA_BITS - 1))) >>
                     LUMA_BITS);
}

/* Computes chroma from sums, which are 8 times the colour. */
static void chroma_of(const int32_t sum[3], uint8_t *cb, uint8_t *cr)
{
    const int32_t half_and_128 = (257 << (CHROMA_BITS + 2));
    *cb = (uint8_t)((CHROMA(-0.2126, 1.8556) * sum[0] + CHROMA(-0.7152, 1.8556) * sum[1] +
                     CHROMA(0.9278, 1.8556) * sum[2] + half_and_128) >>
                    (CHROMA_BITS + 3));
    *cr = (uint8_t)((CHROMA(0.7874, 1.5748) * sum[0] + CHROMA(-0.7152, 1.5748) * sum[1] +
                     CHROMA(-0.0722, 1.5748) * sum[2] + half_and_128) >>
                    (CHROMA_BITS + 3));
}

static void convert_luma(const uint8_t *rgb, uint8_t *y, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++)
        y[x] = luma_of(rgb + 3 * (size_t)x);
}

static void convert_chroma(const uint8_t *rgb, uint8_t *cb, uint8_t *cr, uint32_t width)
{
    for (uint32_t x = 0; x < width; x++, rgb += 3) {
        const int32_t sum[3] = {8 * rgb[0], 8 * rgb[1], 8 * rgb[2]};
        chroma_of(sum, cb + x, cr + x);
    }
}

static void convert_half_chroma(const uint8_t *upper, const uint8_t *lower, uint8_t *cb, uint8_t *cr,
                                uint32_t count)
{
    for (uint32_t x = 0; x < count; x++, upper += 6, lower += 6) {
        int32_t sum[3];
        for (int c = 0; c < 3; c++)
            sum[c] = upper[c - 3] + 2 * upper[c] + upper[c + 3] + lower[c - 3] + 2 * lower[c] + lower[c + 3];
        chroma_of(sum, cb + x, cr + x);
    }
}

void ycbcr_convert(struct ycbcr_converter *converter, const uint8_t *pixels, const struct ycbcr_target *planes)
{
    const uint32_t half_width = (planes->width + 1) / 2;
    for (uint32_t row = 0; row < planes->height; row += planes->half_chroma ? 2 : 1) {
        const size_t chroma_row = planes->half_chroma ? row / 2 : row;
        uint8_t *cb = planes->cb + chroma_row * planes->c_stride_bytes;
        uint8_t *cr = planes->cr + chroma_row * planes->c_stride_bytes;
        const uint8_t *upper = make_row(converter, 0, pixels, row);
        convert_luma(upper, planes->y + row * planes->y_stride_bytes, planes->width);
        if (!planes->half_chroma) {
            convert_chroma(upper, cb, cr, planes->width);
            continue;
        }
        const uint8_t *lower = make_row(converter, 1, pixels, row + 1);
        if (row + 1 < planes->height)
            convert_luma(lower, planes->y + (row + 1) * planes->y_stride_bytes, planes->width);
        convert_half_chroma(upper, lower, cb, cr, half_width);
    }
}
