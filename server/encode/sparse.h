/* SPDX-License-Identifier: MIT */
/* Colours for the empty part of sparse pictures. */
#ifndef FARLIGHT_ENCODE_SPARSE_H
#define FARLIGHT_ENCODE_SPARSE_H

#include <stdint.h>

/* Fills empty RGBA8 pixels (depth 0) with colours that cost few bytes and bleed little: the mean of the rest of
 * each 8x8 block of JPEG's; in an empty block, that of the previous one. */
void sparse_fill(uint8_t *pixels, const float *depths, uint32_t width, uint32_t height);

#endif
