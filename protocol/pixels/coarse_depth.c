/* SPDX-License-Identifier: MIT */
/* Encoding and decoding of coarse depths. */
#include "protocol/pixels/coarse_depth.h"

#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#define SIDE COARSE_DEPTH_SIDE
#define OFF_BYTES 2u
#define LEVEL 9u /* minimum level of zstd: the data are small, and this level saves a tenth */
#define SHARES                                                                                                    \
    (2 * SIDE)   /* divisions of the way from a square's middle to the next one's: texels lie at the odd ones */
#define ALIKE 8u /* four depths belong to one surface if they differ by at most this share of the nearest */

/* The nearest depth of each square. */
struct squares {
    uint32_t width, height; /* size of the picture */
    uint32_t across, down;
    uint16_t *nearest;
};

static uint32_t squares_along(uint32_t texels)
{
    return texels / SIDE + (texels % SIDE != 0);
}

/* False: out of memory. */
static bool squares_init(struct squares *squares, uint32_t width, uint32_t height)
{
    *squares = (struct squares){width, height, squares_along(width), squares_along(height), NULL};
    squares->nearest = calloc((size_t)squares->across * squares->down, sizeof(*squares->nearest));
    return squares->nearest != NULL;
}

static struct predicted_form form_of(const struct squares *squares)
{
    return (struct predicted_form){squares->across, squares->down, sizeof(*squares->nearest)};
}

static uint16_t greater_of(uint16_t a, uint16_t b)
{
    return a > b ? a : b;
}

static uint16_t lesser_of(uint16_t a, uint16_t b)
{
    return a < b ? a : b;
}

/* ---- from squares to texels ---- */

/* The four squares whose middles surround some texels, and the position of the texels' row between them. */
struct corners {
    uint16_t above[2], below[2];
    uint32_t share_y;
};

static bool are_alike(const struct corners *corners)
{
    const uint16_t *a = corners->above, *b = corners->below;
    const uint16_t greatest = greater_of(greater_of(a[0], a[1]), greater_of(b[0], b[1]));
    const uint16_t least = lesser_of(lesser_of(a[0], a[1]), lesser_of(b[0], b[1]));
    return ((uint32_t)greatest - least) * ALIKE <= greatest;
}

/* Interpolates the SIDE texels between the middles of two neighbouring squares. */
static void fill_between(const struct corners *corners, uint16_t texels[SIDE])
{
    const uint32_t below = corners->share_y, above = SHARES - below;
    if (are_alike(corners)) {
        const uint32_t left = corners->above[0] * above + corners->below[0] * below;
        const uint32_t right = corners->above[1] * above + corners->below[1] * below;
        for (uint32_t i = 0, share = 1; i < SIDE; i++, share += 2)
            texels[i] =
                (uint16_t)((left * (SHARES - share) + right * share + SHARES * SHARES / 2) / (SHARES * SHARES));
        return;
    }
    const uint16_t *own = below < above ? corners->above : corners->below;
    for (uint32_t i = 0; i < SIDE; i++)
        texels[i] = own[i >= SIDE / 2];
}

/* Fills row y of the picture, and up to SIDE texels beyond both of its ends. */
static void fill_row(const struct squares *squares, uint32_t y, uint16_t *row)
{
    const uint32_t from_first = y + SIDE / 2, below = from_first / SIDE, across = squares->across;
    const uint16_t *upper = squares->nearest + (size_t)(below > 0 ? below - 1 : 0) * across;
    const uint16_t *lower = squares->nearest + (size_t)(below < squares->down ? below : below - 1) * across;
    for (uint32_t right = 0; right <= across; right++) {
        const uint32_t a = right > 0 ? right - 1 : 0, b = right < across ? right : right - 1;
        const struct corners corners = {{upper[a], upper[b]}, {lower[a], lower[b]}, 2 * (from_first % SIDE) + 1};
        fill_between(&corners, row + (size_t)right * SIDE);
    }
}

/* Allocates the row that fill_row() fills; the picture's first texel is at SIDE / 2. */
static uint16_t *row_create(const struct squares *squares)
{
    return malloc(((size_t)squares->across + 1) * SIDE * sizeof(uint16_t));
}

/* ---- both ways ---- */

size_t coarse_depth_bound(uint32_t width, uint32_t height)
{
    const struct predicted_form form = {squares_along(width), squares_along(height), sizeof(uint16_t)};
    const size_t bound = predicted_bound(&form);
    return bound == 0 || bound > SIZE_MAX - OFF_BYTES ? 0 : OFF_BYTES + bound;
}

/* Finds the nearest depths of a row of squares; `row` is memory for the nearest of each column. */
static void find_nearest_of_row(struct squares *squares, const uint16_t *depths, uint32_t rows, uint16_t *row,
                                uint16_t *nearest)
{
    const uint32_t width = squares->width;
    memcpy(row, depths, width * sizeof(*row));
    for (uint32_t y = 1; y < rows; y++)
        for (uint32_t x = 0; x < width; x++)
            row[x] = greater_of(row[x], depths[(size_t)y * width + x]);
    for (uint32_t x = 0; x < width; x++)
        nearest[x / SIDE] = greater_of(nearest[x / SIDE], row[x]);
}

static void find_nearest(struct squares *squares, const uint16_t *depths, uint16_t *row)
{
    for (uint32_t y = 0; y < squares->down; y++) {
        const uint32_t first = y * SIDE, left = squares->height - first;
        find_nearest_of_row(squares, depths + (size_t)first * squares->width, left < SIDE ? left : SIDE, row,
                            squares->nearest + (size_t)y * squares->across);
    }
}

static uint16_t find_off(const struct squares *squares, const uint16_t *depths, uint16_t *row)
{
    const uint32_t width = squares->width;
    uint16_t off = 0;
    for (uint32_t y = 0; y < squares->height; y++, depths += width) {
        fill_row(squares, y, row);
        for (uint32_t x = 0; x < width; x++) {
            const uint16_t texel = row[SIDE / 2 + x];
            off = greater_of(off, (uint16_t)(greater_of(texel, depths[x]) - lesser_of(texel, depths[x])));
        }
    }
    return off;
}

struct predicted_result coarse_depth_encode(const struct predicted_source *source, uint8_t *out, size_t capacity)
{
    struct predicted_result result = {.status = PREDICTED_NO_MEMORY, .reason = "out of memory"};
    struct squares squares;
    uint16_t *row = NULL;
    const uint16_t *depths = (const uint16_t *)(const void *)source->pixels;
    if (capacity < OFF_BYTES)
        return (struct predicted_result){.status = PREDICTED_FAILED, .reason = "the capacity is too small"};
    if (squares_init(&squares, source->form.width, source->form.rows) && (row = row_create(&squares))) {
        struct predicted_source coarse = *source;
        find_nearest(&squares, depths, row);
        coarse.form = form_of(&squares);
        coarse.level = LEVEL > source->level ? LEVEL : source->level;
        coarse.pixels = (const uint8_t *)squares.nearest;
        const uint16_t off = find_off(&squares, depths, row);
        memcpy(out, &off, OFF_BYTES); /* little-endian */
        result = predicted_encode(&coarse, out + OFF_BYTES, capacity - OFF_BYTES);
        result.bytes += result.status == PREDICTED_DONE ? OFF_BYTES : 0;
    }
    free(row);
    free(squares.nearest);
    return result;
}

struct predicted_result coarse_depth_decode(uint32_t width, uint32_t height, const uint8_t *encoded,
                                            size_t encoded_bytes, uint16_t *rounded, uint16_t *off)
{
    struct predicted_result result = {.status = PREDICTED_NO_MEMORY, .reason = "out of memory"};
    struct squares squares;
    uint16_t *row = NULL;
    if (encoded_bytes < OFF_BYTES)
        return (struct predicted_result){.status = PREDICTED_FAILED, .reason = "it is too short"};
    if (squares_init(&squares, width, height) && (row = row_create(&squares))) {
        const struct predicted_form form = form_of(&squares);
        result =
            predicted_decode(&form, encoded + OFF_BYTES, encoded_bytes - OFF_BYTES, (uint8_t *)squares.nearest);
    }
    for (uint32_t y = 0; result.status == PREDICTED_DONE && y < height; y++) {
        fill_row(&squares, y, row);
        memcpy(rounded + (size_t)y * width, row + SIDE / 2, width * sizeof(*rounded));
    }
    if (result.status == PREDICTED_DONE) {
        result.bytes = encoded_bytes;
        memcpy(off, encoded, OFF_BYTES);
    }
    free(row);
    free(squares.nearest);
    return result;
}
