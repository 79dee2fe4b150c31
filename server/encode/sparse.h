/* SPDX-License-Identifier: MIT */
/* Pictures of which most is not there. */
#ifndef FARLIGHT_ENCODE_SPARSE_H
#define FARLIGHT_ENCODE_SPARSE_H

#include <stdint.h>

/* Gives RGBA8 pixels where nothing is (depth 0) colours that cost few bytes and bleed little: in each 8x8 block of
 * JPEG's the mean of what is there; where a block has nothing, that of the one before. */
void sparse_fill(uint8_t *pixels, const float *depths, uint32_t width, uint32_t height);

#endif
