/* SPDX-License-Identifier: MIT */
/* Shares of pixels that move with the eye, as block means. */
#include "protocol/pixels/sticking.h"

#include <string.h>

#define WHOLE 255u

uint32_t sticking_blocks(uint32_t pixels)
{
    return (pixels + STICKING_BLOCK - 1) / STICKING_BLOCK;
}

static uint32_t end_of(uint32_t block, uint32_t pixels)
{
    const uint32_t end = (block + 1) * STICKING_BLOCK;
    return end < pixels ? end : pixels;
}

void sticking_round(const uint8_t *shares, size_t apart, uint32_t width, uint32_t height, uint8_t *blocks)
{
    for (uint32_t row = 0; row < sticking_blocks(height); row++)
        for (uint32_t column = 0; column < sticking_blocks(width); column++) {
            const uint32_t left = column * STICKING_BLOCK, right = end_of(column, width);
            const uint32_t top = row * STICKING_BLOCK, bottom = end_of(row, height);
            uint32_t sum = 0;
            for (uint32_t y = top; y < bottom; y++)
                for (uint32_t x = left; x < right; x++)
                    sum += shares[((size_t)y * width + x) * apart];
            const uint32_t whole = WHOLE * (right - left) * (bottom - top);
            *blocks++ = (uint8_t)((sum * STICKING_STEPS + whole / 2) / whole);
        }
}

bool sticking_restore(const uint8_t *blocks, uint32_t width, uint32_t height, uint8_t *shares)
{
    const uint32_t across = sticking_blocks(width), count = across * sticking_blocks(height);
    for (uint32_t i = 0; i < count; i++)
        if (blocks[i] > STICKING_STEPS)
            return false;
    for (uint32_t y = 0; y < height; y++, shares += width) {
        if (y % STICKING_BLOCK > 0) {
            memcpy(shares, shares - width, width);
            continue;
        }
        const uint8_t *row = blocks + (size_t)(y / STICKING_BLOCK) * across;
        for (uint32_t x = 0; x < width; x++)
            shares[x] = (uint8_t)((row[x / STICKING_BLOCK] * WHOLE + STICKING_STEPS / 2) / STICKING_STEPS);
    }
    return true;
}
