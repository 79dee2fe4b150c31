/* SPDX-License-Identifier: MIT */
/* A key view for tests, all texels of which are known: planes, an edge between them, colours that tell places. */
#ifndef FARLIGHT_TESTS_UNIT_WARP_VIEWS_H
#define FARLIGHT_TESTS_UNIT_WARP_VIEWS_H

#include "warp/warp.h"

#include "tests/harness/test.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 300u /* no multiple of a part or of a tile */
#define HEIGHT 190u
#define COUNT (WIDTH * HEIGHT)
#define FOCAL 200.0 /* texels */

static uint32_t key_colours[FL_WARP_LAYERS_MAX][COUNT];
static float key_w[FL_WARP_LAYERS_MAX][COUNT];

static uint32_t random_bits(uint64_t *seed)
{
    *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)(*seed >> 32);
}

static double uniform(uint64_t *seed, double low, double high)
{
    return low + (high - low) * ((double)random_bits(seed) / 4294967296.0);
}

/* At the origin, turned about the vertical and then upwards; radians. */
static struct fl_warp_camera camera_turned(double right, double up)
{
    const double c = cos(right), s = sin(right), d = cos(up), t = sin(up);
    const double rows[12] = {c, -s * t, -s * d, 0, 0, d, -t, 0, s, c * t, c * d, 0};
    struct fl_warp_camera camera = {.fov_y = (float)(2 * atan(0.5 * HEIGHT / FOCAL))};
    for (int i = 0; i < 12; i++)
        camera.world_from_view[i] = (float)rows[i];
    return camera;
}

static inline struct fl_warp_camera camera_at(double right, double up, double back)
{
    struct fl_warp_camera camera = camera_turned(0, 0);
    camera.world_from_view[3] = (float)right;
    camera.world_from_view[7] = (float)up;
    camera.world_from_view[11] = (float)back;
    return camera;
}

static inline struct fl_warp_key key_of(uint32_t layers)
{
    struct fl_warp_key key = {.width = WIDTH,
                              .height = HEIGHT,
                              .camera = camera_turned(0, 0),
                              .radius = 0.15f,
                              .pixels = 0.25f,
                              .layer_count = layers};
    for (uint32_t l = 0; l < layers; l++)
        key.layers[l] = (struct fl_warp_layer){key_colours[l], key_w[l], NULL};
    return key;
}

static inline struct fl_warp *warp_with(unsigned threads, const struct fl_warp_key *key)
{
    struct fl_warp_error error = {0};
    struct fl_warp *warp = fl_warp_create(threads, &error);
    if (!warp || !fl_warp_set_key(warp, key, &error))
        fail_msg("%s: %s", error.field, error.text);
    return warp;
}

struct made {
    uint32_t colours[COUNT];
    uint8_t mask[COUNT];
    struct fl_warp_counts counts;
};

static inline void make(struct fl_warp *warp, const struct fl_warp_view *view, struct made *made)
{
    struct fl_warp_picture picture = {.colours = made->colours, .mask = made->mask};
    struct fl_warp_error error = {0};
    if (!fl_warp_make(warp, view, &picture, &error))
        fail_msg("%s: %s", error.field, error.text);
    made->counts = picture.counts;
}

static inline struct fl_warp_view view_of(struct fl_warp_camera camera, enum fl_warp_quality quality)
{
    return (struct fl_warp_view){.width = WIDTH, .height = HEIGHT, .camera = camera, .quality = quality};
}

/* A red that changes by 255 from column to column, a green from row to row: bilinear colours tell where a place
 * is, to a small part of a texel. */
static inline uint32_t place_colour(uint32_t x, uint32_t y)
{
    return 0xff000000u | (x & 1 ? 0xffu : 0) | (y & 1 ? 0xff00u : 0);
}

/* Value of a bilinear filter between the centres of texels. */
static inline double wave_at(double place)
{
    const double share = fmod(place - 0.5 + 2, 2);
    return 255 * (share < 1 ? share : 2 - share);
}

static inline double red_of(uint32_t colour)
{
    return colour & 255;
}

static inline double green_of(uint32_t colour)
{
    return colour >> 8 & 255;
}

#endif
