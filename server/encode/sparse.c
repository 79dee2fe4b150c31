/* SPDX-License-Identifier: MIT */
/* Colours for empty pixels, block by block. */
#include "encode/sparse.h"

#include <stddef.h>
#include <string.h>

#define BLOCK 8u

struct block {
    uint8_t *pixels;
    const float *depths;
    uint32_t stride, width, height; /* pixels */
};

/* Mean over a block; the previous mean stays if the block is empty. */
static void mean_of(const struct block *block, uint8_t mean[4])
{
    uint32_t sums[4] = {0}, count = 0;
    for (uint32_t y = 0; y < block->height; y++)
        for (uint32_t x = 0; x < block->width; x++) {
            const size_t i = (size_t)y * block->stride + x;
            count += block->depths[i] > 0.0f;
            for (int c = 0; c < 4 && block->depths[i] > 0.0f; c++)
                sums[c] += block->pixels[4 * i + (size_t)c];
        }
    for (int c = 0; c < 4 && count > 0; c++)
        mean[c] = (uint8_t)((sums[c] + count / 2) / count);
}

static void fill(const struct block *block, const uint8_t colour[4])
{
    for (uint32_t y = 0; y < block->height; y++)
        for (uint32_t x = 0; x < block->width; x++) {
            const size_t i = (size_t)y * block->stride + x;
            if (!(block->depths[i] > 0.0f))
                memcpy(block->pixels + 4 * i, colour, 4);
        }
}

void sparse_fill(uint8_t *pixels, const float *depths, uint32_t width, uint32_t height)
{
    uint8_t colour[4] = {0};
    for (uint32_t y = 0; y < height; y += BLOCK)
        for (uint32_t x = 0; x < width; x += BLOCK) {
            const size_t first = (size_t)y * width + x;
            const struct block block = {.pixels = pixels + 4 * first,
                                        .depths = depths + first,
                                        .stride = width,
                                        .width = width - x < BLOCK ? width - x : BLOCK,
                                        .height = height - y < BLOCK ? height - y : BLOCK};
            mean_of(&block, colour);
            fill(&block, colour);
        }
}
