/* SPDX-License-Identifier: MIT */
/* The share of each pixel's colour that moves with the eye (mirrors, glass), as means of blocks in a few steps.
 * A client uses it to see when it needs another picture and about where colours are wrong until then, which
 * allows this low precision.
 *
 * Measured on six models with mirrors, glass or textured metal at 1280x720: 57600 blocks take 0.1 to 3.3 KB
 * with zstd; single pixels took 2 to 76 KB in 255 steps and 1 to 29 KB in 7 steps. Any thread. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_STICKING_H
#define FARLIGHT_PROTOCOL_PIXELS_STICKING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STICKING_BLOCK 4u /* pixels along a side; blocks at the right and lower edge may be smaller */
#define STICKING_STEPS 7u /* number of steps for a share of 1 */

uint32_t sticking_blocks(uint32_t pixels); /* number of blocks along a side of this length */
/* Rounds shares to blocks; `shares` holds 255 times the shares, one every `apart` bytes. */
void sticking_round(const uint8_t *shares, size_t apart, uint32_t width, uint32_t height, uint8_t *blocks);
/* Expands blocks to 255 times the share of each pixel. False: a block has more than STICKING_STEPS. */
bool sticking_restore(const uint8_t *blocks, uint32_t width, uint32_t height, uint8_t *shares);

#endif
