/* SPDX-License-Identifier: MIT */
/* Y'CbCr 4:2:0 in memory: renderers make it for encoders that would otherwise convert from RGBA8. */
#ifndef FARLIGHT_BASE_YCBCR_H
#define FARLIGHT_BASE_YCBCR_H

#include <stddef.h>
#include <stdint.h>

/* Kinds of conversion. Both use sRGB values unchanged; each code is the nearest one. */
enum ycbcr {
    YCBCR_NONE,  /* RGBA8 */
    YCBCR_VIDEO, /* ITU-R BT.709-6, items 3.2 and 3.4: 16 .. 235 and 16 .. 240 around 128. Chroma lies on the luma
                  * of its left column and between its two rows: columns around it by weights 1, 2, 1 */
    YCBCR_JPEG   /* ITU-T T.871 (JFIF): the matrix of BT.601, 0 .. 255. Chroma lies between its four pixels:
                    their mean */
};

/* Planes with even numbers of columns and rows of luma; those beyond the picture repeat its last ones. */
struct ycbcr_planes {
    const uint8_t *y, *cb, *cr;
    size_t y_stride_bytes, c_stride_bytes;
};

/* Layout in one allocation: a row of luma is followed by a row of chroma, Cb in even rows, Cr in odd ones. So
 * each plane has a stride, and the bytes of some rows of all three planes are contiguous, as the device
 * delivers them. Strides of luma are multiples of 8: both kinds of rows consist of whole words there. */
static inline size_t ycbcr_luma_bytes(uint32_t width)
{
    return ((size_t)width + 7) & ~(size_t)7;
}

static inline size_t ycbcr_row_bytes(uint32_t width)
{
    return ycbcr_luma_bytes(width) / 2 * 3;
}

static inline uint32_t ycbcr_row_count(uint32_t height)
{
    return height + (height & 1);
}

static inline struct ycbcr_planes ycbcr_planes_at(const uint8_t *bytes, uint32_t width)
{
    size_t luma_bytes = ycbcr_luma_bytes(width), row_bytes = ycbcr_row_bytes(width);
    return (struct ycbcr_planes){bytes, bytes + luma_bytes, bytes + row_bytes + luma_bytes, row_bytes,
                                 2 * row_bytes};
}

#endif
