/* SPDX-License-Identifier: MIT */
/* Iterative image warping (Bowles and others): the surface at a pixel lies where its own depth puts it, so a
 * fixed-point iteration finds it. Near edges it may find either surface, or none. */
#include "warp/trace.h"

#include "warp/colour.h"

#define ROUNDS 3
#define FOUND_TEXELS 1.0f /* the search has failed if the last round moved further */

/* LANES pixels of a row, and the places that the search has reached. */
struct search {
    float x[LANES], y[LANES], way[LANES];
    uint32_t mask[LANES], colours[LANES];
    uint8_t sticking[LANES];
};

static inline void load_w(const float *w, const int places[LANES], float loaded[LANES])
{
    for (int k = 0; k < LANES; k++)
        loaded[k] = w[places[k]];
}

static inline void load_sticking(const uint8_t *sticking, const int places[LANES], uint8_t loaded[LANES])
{
    for (int k = 0; k < LANES; k++)
        loaded[k] = sticking[places[k]];
}

/* Searches from the place (x, y) of the picture. */
LANES_KERNEL_OF_LOADS static void search_pixels(const struct warp_rays *rays, const struct warp_layer *layer,
                                                const float place[2], struct search *restrict search)
{
    const float right = (float)((int)layer->width), bottom = (float)((int)layer->height), limit = rays->w_limit;
    const int across = (int)layer->padded_width, last_x = (int)layer->width - 1, last_y = (int)layer->height - 1;
    const float left = place[0] + 0.5f, top = place[1] + 0.5f;
    struct warp_packet packet;
    float w[LANES];
    int places[LANES];
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const struct warp_ray ray = rays_at(rays, left + (float)k, top);
        packet.x[k] = search->x[k] = ray.x;
        packet.y[k] = search->y[k] = ray.y;
        packet.shift_x[k] = ray.shift_x;
        packet.shift_y[k] = ray.shift_y;
    }
    for (int round = 0; round < ROUNDS; round++) {
#pragma omp simd
        for (int k = 0; k < LANES; k++)
            places[k] = texel_of(search->y[k], last_y) * across + texel_of(search->x[k], last_x);
        load_w(layer->w, places, w);
#pragma omp simd
        for (int k = 0; k < LANES; k++) {
            const float at = min_of(w[k], limit);
            const float x = packet.x[k] + at * packet.shift_x[k], y = packet.y[k] + at * packet.shift_y[k];
            search->way[k] = magnitude(x - search->x[k]) + magnitude(y - search->y[k]);
            search->x[k] = x;
            search->y[k] = y;
        }
    }
    if (layer->sticks) /* read at the last place of the search, which is within a texel of the result */
        load_sticking(layer->sticking, places, search->sticking);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float x = search->x[k], y = search->y[k];
        const uint32_t is_inside = mask_of(x >= 0) & mask_of(y >= 0) & mask_of(x < right) & mask_of(y < bottom);
        const int found = pick_int(mask_of(search->way[k] < FOUND_TEXELS), FL_WARP_KNOWN, FL_WARP_BEHIND);
        search->mask[k] = (uint32_t)pick_int(is_inside, found, FL_WARP_OUTSIDE);
    }
}

void warp_iterate_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally)
{
    const struct warp_layer *layer = &task->layers[0];
    struct search search = {.sticking = {0}};
    for (uint32_t y = row * WARP_TILE; y < (row + 1) * WARP_TILE && y < task->height; y++)
        for (uint32_t x = 0; x < task->width; x += LANES) {
            search_pixels(&task->rays, layer, (const float[2]){(float)x, (float)y}, &search);
            warp_colour(layer, search.x, search.y, search.colours);
            const struct warp_pixels pixels = {LANES, search.colours, search.mask, search.sticking};
            warp_store(task, x, y, &pixels, tally);
        }
}
