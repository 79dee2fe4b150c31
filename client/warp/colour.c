/* SPDX-License-Identifier: MIT */
/* Interpolation of a layer's colours. */
#include "warp/colour.h"

#include "warp/rays.h"

#include <string.h>

#define SHARES 256 /* weights of texels are multiples of 1 / SHARES */

/* Mixes two values of 8 bits each, in bits 0 to 7 and 16 to 23, with two others. */
LANES_INLINE uint32_t mix_pair(uint32_t a, uint32_t b, uint32_t share)
{
    return ((a * (SHARES - share) + b * share + 0x800080u) >> 8) & 0xff00ffu;
}

/* Interpolates between two texels of two rows each. */
LANES_INLINE uint32_t mix_four(const uint32_t above[2], const uint32_t below[2], uint32_t share_x,
                               uint32_t share_y)
{
    const uint32_t even = mix_pair(mix_pair(above[0] & 0xff00ffu, above[1] & 0xff00ffu, share_x),
                                   mix_pair(below[0] & 0xff00ffu, below[1] & 0xff00ffu, share_x), share_y);
    const uint32_t odd =
        mix_pair(mix_pair(above[0] >> 8 & 0xff00ffu, above[1] >> 8 & 0xff00ffu, share_x),
                 mix_pair(below[0] >> 8 & 0xff00ffu, below[1] >> 8 & 0xff00ffu, share_x), share_y);
    return even | odd << 8;
}

/* Texels loaded for each place: the bits that show where four texels are one surface, and two texels of two
 * rows. */
struct texels {
    uint32_t joined[LANES], above[LANES][2], below[LANES][2];
};

static inline void load_texels(const struct warp_layer *layer, const int places[LANES], struct texels *texels)
{
    const uint32_t *colours = layer->colours;
    for (int k = 0; k < LANES; k++) {
        const size_t i = (size_t)places[k];
        texels->joined[k] = layer->joined[i / 32];
        memcpy(texels->above[k], colours + i, sizeof(texels->above[k]));
        memcpy(texels->below[k], colours + i + layer->padded_width, sizeof(texels->below[k]));
    }
}

LANES_KERNEL static void colour_places(const struct warp_layer *layer, const float *x, const float *y,
                                       uint32_t *colours)
{
    const float last_x = (float)((int)layer->width - 1), last_y = (float)((int)layer->height - 1);
    const int across = (int)layer->padded_width;
    struct texels texels;
    uint32_t shares_x[LANES], shares_y[LANES];
    int places[LANES];
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float left = clamp(x[k] - 0.5f, 0, last_x), top = clamp(y[k] - 0.5f, 0, last_y);
        places[k] = (int)top * across + (int)left;
        shares_x[k] = (uint32_t)(int)((left - (float)(int)left) * SHARES + 0.5f);
        shares_y[k] = (uint32_t)(int)((top - (float)(int)top) * SHARES + 0.5f);
    }
    load_texels(layer, places, &texels);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const uint32_t joined = mask_of((int)(texels.joined[k] >> (places[k] & 31) & 1u));
        /* Texels of several surfaces are not mixed: the nearest counts. */
        const uint32_t nearest_x = (shares_x[k] + SHARES / 2) & SHARES,
                       nearest_y = (shares_y[k] + SHARES / 2) & SHARES;
        const uint32_t share_x = (shares_x[k] & joined) | (nearest_x & ~joined);
        const uint32_t share_y = (shares_y[k] & joined) | (nearest_y & ~joined);
        colours[k] = mix_four(texels.above[k], texels.below[k], share_x, share_y);
    }
}

void warp_colour(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                 uint32_t colours[LANES])
{
    colour_places(layer, x, y, colours);
}

LANES_KERNEL static void find_texels(const struct warp_layer *layer, const float *x, const float *y, int *texels)
{
    const int last_x = (int)layer->width - 1, last_y = (int)layer->height - 1, across = (int)layer->padded_width;
#pragma omp simd
    for (int k = 0; k < LANES; k++)
        texels[k] = texel_of(y[k], last_y) * across + texel_of(x[k], last_x);
}

void warp_sticking(const struct warp_layer *layer, const float x[LANES], const float y[LANES],
                   uint8_t sticking[LANES])
{
    int texels[LANES];
    memset(sticking, 0, LANES);
    if (!layer->sticks)
        return;
    find_texels(layer, x, y, texels);
    for (int k = 0; k < LANES; k++)
        sticking[k] = layer->sticking[texels[k]];
}
