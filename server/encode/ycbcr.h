/* SPDX-License-Identifier: MIT */
/* RGBA8 to Y'CbCr 4:2:0 on the host: YCBCR_VIDEO of base/ycbcr.h, but for codes that may be one from the nearest
 * one. Alpha is dropped. */
#ifndef FARLIGHT_ENCODE_YCBCR_H
#define FARLIGHT_ENCODE_YCBCR_H

#include "encode/encoder.h"

struct ycbcr_target {
    uint8_t *y, *cb, *cr;
    size_t y_stride_bytes, c_stride_bytes;
    uint32_t width, height; /* of the luma: even, the picture's or one more, which repeats the edge */
};

/* What ycbcr_convert() works in, for planes of that width. */
size_t ycbcr_scratch_bytes(uint32_t width);
/* `picture` has 4 bytes a pixel; `scratch` is not needed from one call to the next. */
void ycbcr_convert(const struct picture *picture, const struct ycbcr_target *planes, uint8_t *scratch);

#endif
