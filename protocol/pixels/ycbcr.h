/* SPDX-License-Identifier: MIT */
/* Pictures for video: 8-bit sRGB with straight alpha to opaque RGB or Y'CbCr.
 *
 * Alpha is ignored, or the picture lies over black, in linear light (IEC 61966-2-1). Y'CbCr: the matrix of ITU-R
 * BT.709-6 item 3.2 on the RGB values as they are, quantised as in item 3.4 with 8 bits: Y' 16 to 235, Cb and Cr
 * 16 to 240 around 128; each value is the nearest one. With half chroma (4:2:0), a sample lies on the luma of its
 * left column and between its two rows (left siting, what H.264 assumes when nothing is said); it is the mean of
 * the columns around it with weights 1, 2, 1, over two rows. Beyond the edges the picture repeats its last row and
 * column. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_YCBCR_H
#define FARLIGHT_PROTOCOL_PIXELS_YCBCR_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum ycbcr_alpha { YCBCR_ALPHA_IGNORED, YCBCR_ALPHA_OVER_BLACK };

struct ycbcr_converter {
    uint8_t (*over_black)[256]; /* table by alpha and value; NULL: alpha is ignored */
    uint32_t width, height;     /* size of the pictures */
    uint8_t *rows[2];           /* RGB, with margins */
};

struct ycbcr_target {
    uint8_t *y, *cb, *cr;
    size_t y_stride_bytes, c_stride_bytes;
    uint32_t width, height; /* size of the luma; larger than the picture: the edge is repeated */
    bool half_chroma;       /* Cb and Cr have (width + 1) / 2 x (height + 1) / 2 samples */
};

/* Sizes are at most 8192; widths of targets at most one more than that. False: out of memory. */
bool ycbcr_converter_init(struct ycbcr_converter *converter, uint32_t width, uint32_t height,
                          enum ycbcr_alpha alpha);
void ycbcr_converter_finish(struct ycbcr_converter *converter); /* accepts a zeroed struct */

/* Converts `pixels`: rgba8, rows from the top without gaps. */
void ycbcr_convert(struct ycbcr_converter *converter, const uint8_t *pixels, const struct ycbcr_target *target);
/* A row as displayed: red, green, blue; valid until the next call. */
const uint8_t *ycbcr_opaque_row(struct ycbcr_converter *converter, const uint8_t *pixels, uint32_t row);

#endif
