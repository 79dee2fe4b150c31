/* SPDX-License-Identifier: MIT */
/* The random numbers of a sample, equal to the bit to those of shaders/common/sequence.glsl, which describes
 * them. */
#ifndef FARLIGHT_RENDER_SEQUENCE_H
#define FARLIGHT_RENDER_SEQUENCE_H

#include <stdint.h>

uint32_t sequence_hash(uint32_t v);
uint32_t sequence_seed(uint32_t number, uint32_t seed);
/* In [0, 1). `dimension`: SEQUENCE_* of shared/frame.h. */
float sequence_number(uint32_t pixel_seed, uint32_t dimension, uint32_t index);
void sequence_pair(float pair[2], uint32_t pixel_seed, uint32_t dimension, uint32_t index);
/* The same numbers in another order: those of 2^group_shift samples, which begin at a multiple of that, close
 * together. */
void sequence_pair_sorted(float pair[2], uint32_t pixel_seed, uint32_t dimension, uint32_t index,
                          uint32_t group_shift);

#endif
