/* SPDX-License-Identifier: MIT */
/* The quadtree over one layer of a key view, and blocks with bounds of rectangles: both are built bottom-up,
 * each part of QUADTREE_SIDE by QUADTREE_SIDE texels on its own. */
#ifndef FARLIGHT_CLIENT_WARP_TREE_H
#define FARLIGHT_CLIENT_WARP_TREE_H

#include "quadtree/layout.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define WARP_JOINED_WORD 32 /* texels whose `joined` share a word */
#define WARP_BLOCK_LOW 2u   /* the level of the smallest blocks, 4x4 texels */

/* Bounds over the texels of a block. */
struct warp_block {
    float w_min, w_max;     /* bounds of the leaves' planes */
    float steep_x, steep_y; /* maximum difference to the next texel on the right, and below */
};

void warp_block_join(struct warp_block *block, const struct warp_block *other);

/* A layer. Rows of texels are padded_width long, as in the lowest level of the tree. */
struct warp_layer {
    uint32_t width, height, padded_width, padded_height;
    float tolerance; /* |dw| of a plane over several texels, seen from far away */
    float nearness;  /* radius / unit */
    float noise;     /* maximum error of the given w */
    uint32_t *colours;
    float *w;
    uint8_t *sticking;
    bool sticks;      /* false: `sticking` is empty */
    uint32_t *joined; /* a bit for each texel: it and its neighbours to the right and below show one surface */
    uint32_t *nodes;  /* two words each */
    /* Maximum error of a plane against those of the leaves, for levels above the lowest; then a row of zeros */
    float *errors;
    struct warp_block *blocks;
    uint32_t block_first[QUADTREE_TOP + 1]; /* index of a level's first block */
};

struct warp_rectangle {
    uint32_t left, top, right, bottom; /* right and bottom are exclusive */
};

/* Allocates a layer without surfaces. False: no memory. */
bool warp_layer_init(struct warp_layer *layer, uint32_t width, uint32_t height);
void warp_layer_finish(struct warp_layer *layer);

uint32_t warp_layer_nodes(const struct warp_layer *layer);

/* Number of floats of scratch memory for building a part. */
size_t warp_layer_scratch(const struct warp_layer *layer);
/* The parts whose structure depends on texels of a rectangle, as a rectangle of parts. */
struct warp_rectangle warp_layer_parts(const struct warp_layer *layer, const struct warp_rectangle *texels);
/* Builds the parts of a row from `left` up to `right`. Different rows may be built at the same time. */
void warp_layer_build(struct warp_layer *layer, uint32_t row, uint32_t left, uint32_t right, float *scratch);

#endif
