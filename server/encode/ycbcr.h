/* SPDX-License-Identifier: MIT */
/* 8-bit colours to Y'CbCr 4:2:0 as video has it: the matrix of ITU-R BT.709-6 item 3.2 on the values as they are,
 * quantised to 16 .. 235 and 16 .. 240 around 128 (item 3.4). A chroma sample lies on the luma of its left column
 * and between its two rows: the mean of the columns around it with weights 1, 2, 1. Each value is at most one from
 * the nearest one. Alpha is dropped. */
#ifndef FARLIGHT_ENCODE_YCBCR_H
#define FARLIGHT_ENCODE_YCBCR_H

#include "encode/encoder.h"

struct ycbcr_planes {
    uint8_t *y, *cb, *cr;
    size_t y_stride_bytes, c_stride_bytes;
    uint32_t width, height; /* of the luma: even, the picture's or one more, which repeats the edge */
};

/* What ycbcr_convert() works in, for planes of that width. */
size_t ycbcr_scratch_bytes(uint32_t width);
/* `picture` has 4 bytes a pixel; `scratch` is not needed from one call to the next. */
void ycbcr_convert(const struct picture *picture, const struct ycbcr_planes *planes, uint8_t *scratch);

#endif
