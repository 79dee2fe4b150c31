/* SPDX-License-Identifier: MIT */
/* The quadtree over one layer of a key view, and what tells quickly how the layer is in a rectangle: both are
 * built bottom-up, each part of QUADTREE_SIDE by QUADTREE_SIDE texels for itself. */
#ifndef FARLIGHT_CLIENT_WARP_TREE_H
#define FARLIGHT_CLIENT_WARP_TREE_H

#include "quadtree/layout.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define WARP_JOINED_WORD 32 /* texels whose `joined` share a word */
#define WARP_BLOCK_LOW 2u   /* the level of the smallest blocks, 4x4 texels */

/* Of the texels of a block. */
struct warp_block {
    float w_min, w_max;     /* of the planes of its leaves */
    float steep_x, steep_y; /* greatest difference to the next texel on the right, and below */
};

void warp_block_join(struct warp_block *block, const struct warp_block *other);

/* Arrays of texels have rows of padded_width, as the lowest level of the tree. */
struct warp_layer {
    uint32_t width, height, padded_width, padded_height;
    float tolerance; /* |dw| of a plane over several texels, seen from far away */
    float nearness;  /* radius / unit */
    float noise;     /* the given w is at most so far from the true one */
    uint32_t *colours;
    float *w;
    uint8_t *sticking;
    bool sticks;      /* else that holds nothing */
    uint32_t *joined; /* a bit a texel: it, the one to the right, and those below them show one surface */
    uint32_t *nodes;  /* two words each */
    float *errors; /* of the levels above the lowest: how far a plane is from those of the leaves at most; then a
                      row of zeros */
    struct warp_block *blocks;
    uint32_t block_first[QUADTREE_TOP + 1]; /* of a level */
};

struct warp_rectangle {
    uint32_t left, top, right, bottom; /* the last two are the first beyond */
};

/* False: no memory. All texels show nothing, until they are built. */
bool warp_layer_init(struct warp_layer *layer, uint32_t width, uint32_t height);
void warp_layer_finish(struct warp_layer *layer);

uint32_t warp_layer_nodes(const struct warp_layer *layer);

/* Floats that building a part needs beside. */
size_t warp_layer_scratch(const struct warp_layer *layer);
/* Those parts whose structure follows from texels of a rectangle: a rectangle of parts. */
struct warp_rectangle warp_layer_parts(const struct warp_layer *layer, const struct warp_rectangle *texels);
/* Of a row of parts those from `left` on. Different rows may be built at the same time. */
void warp_layer_build(struct warp_layer *layer, uint32_t row, uint32_t left, uint32_t right, float *scratch);

#endif
