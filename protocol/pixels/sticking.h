/* SPDX-License-Identifier: MIT */
/* How much of each pixel follows the eye: the means of blocks of pixels, in a few steps. It says when a client
 * needs another picture, and about where colours are wrong until then, which needs no more.
 *
 * Of 1280x720 pixels of six models, with mirrors, glass or textured metal, 57600 blocks take 0.1 to 3.3 KB with
 * zstd; each pixel in 255 steps took 2 to 76 KB, and in 7 steps 1 to 29 KB. Any thread. */
#ifndef FARLIGHT_PROTOCOL_PIXELS_STICKING_H
#define FARLIGHT_PROTOCOL_PIXELS_STICKING_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define STICKING_BLOCK 4u /* pixels along a side; those at the right and lower edge have what is left */
#define STICKING_STEPS 7u /* of the share 1 */

uint32_t sticking_blocks(uint32_t pixels); /* along a side of so many */
/* `shares`: 255 times them, one every `apart` bytes. */
void sticking_round(const uint8_t *shares, size_t apart, uint32_t width, uint32_t height, uint8_t *blocks);
/* To 255 times the share of each pixel. False: a block has more than STICKING_STEPS. */
bool sticking_restore(const uint8_t *blocks, uint32_t width, uint32_t height, uint8_t *shares);

#endif
