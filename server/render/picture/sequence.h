/* SPDX-License-Identifier: MIT */
/* The random numbers of a sample, equal to the bit to those of shaders/common/sequence.glsl, which describes
 * them. */
#ifndef FARLIGHT_RENDER_PICTURE_SEQUENCE_H
#define FARLIGHT_RENDER_PICTURE_SEQUENCE_H

#include <stdint.h>

/* A pixel's seed: that of its block, and the pixel's place there. */
struct sequence_seed {
    uint32_t block, place;
};

struct sequence_seed sequence_seed(uint32_t x, uint32_t y, uint32_t seed);
/* In [0, 1). `dimension`: SEQUENCE_* of shared/frame.h. */
float sequence_number(struct sequence_seed pixel, uint32_t dimension, uint32_t index);
void sequence_pair(float pair[2], struct sequence_seed pixel, uint32_t dimension, uint32_t index);
/* Numbers of the pair in another order: those of 2^group_shift samples, which begin at a multiple of that, close
 * together. */
void sequence_pair_sorted(float pair[2], struct sequence_seed pixel, uint32_t dimension, uint32_t index,
                          uint32_t group_shift);

#endif
