/* SPDX-License-Identifier: MIT */
/* Tracing of tiles of rays. A tile first narrows the range of w in which its rays can hit something: the range
 * gives the texels that the rays pass, and the blocks of these texels give a new range. Where the layer is too
 * flat there to occlude anything, each ray hits one surface, which is solved for. Elsewhere the tile is divided
 * into quarters, and the smallest are traced from node to node. */
#include "warp/trace.h"

#include "warp/colour.h"
#include "warp/march.h"

#include <math.h>

#define PACKET_COLUMNS 8u
#define PACKET_ROWS 2u
#define NARROWINGS_MAX 4
#define NARROWING_LEAST 0.8f /* narrowing stops if a round leaves more than this share of the range */
#define RANGE_SLACK 0.001f   /* share of w */
#define BLOCKS_ACROSS 4u     /* approximate number along the longer side of a rectangle */
/* Maximum stretch between neighbouring texels in the picture, in texels, if rays hit one surface: from 1 on one
 * texel may hide the other. Below it the solution's iteration converges by this factor. */
#define STRETCH_MAX 0.5f
#define SHIFT_MIN 1e-6f   /* texels per unit of w: a ray that moves less stays in place */
#define NEAR_LIMIT 0.999f /* share of the w of the eye's plane */

/* The pixels of a tile or of a part of one, and the surfaces that their rays can hit. */
struct tile {
    uint32_t x, y, size;
    struct warp_ray rays[4]; /* rays of the corners */
    float range[2];
    bool is_inside;  /* no ray leaves the layer within the range */
    bool is_outside; /* no ray is inside the layer within it */
    uint32_t level;  /* nodes of this level are as large as the region that the rays pass */
    float stretch;
};

/* ---- ranges ---- */

static struct warp_block blocks_of(const struct warp_layer *layer, const uint32_t low[2], const uint32_t high[2],
                                   uint32_t *level_out)
{
    const uint32_t across = high[0] - low[0], down = high[1] - low[1], longer = across > down ? across : down;
    uint32_t level = WARP_BLOCK_LOW;
    while (level < QUADTREE_TOP && longer >> level >= BLOCKS_ACROSS)
        level++;
    *level_out = level;
    const struct warp_block *blocks = layer->blocks + layer->block_first[level];
    const uint32_t row = layer->padded_width >> level;
    struct warp_block all = blocks[(low[1] >> level) * row + (low[0] >> level)];
    for (uint32_t y = low[1] >> level; y <= high[1] >> level; y++)
        for (uint32_t x = low[0] >> level; x <= high[0] >> level; x++)
            warp_block_join(&all, &blocks[y * row + x]);
    return all;
}

void warp_task_find_ranges(struct warp_task *task)
{
    for (uint32_t l = 0; l < task->layer_count; l++) {
        const struct warp_layer *layer = &task->layers[l];
        uint32_t level;
        const struct warp_block all =
            blocks_of(layer, (uint32_t[2]){0, 0}, (uint32_t[2]){layer->width - 1, layer->height - 1}, &level);
        const float slack = layer->tolerance + 2 * layer->noise;
        task->ranges[l][0] = max_of(all.w_min * (1 - RANGE_SLACK) - slack, 0);
        task->ranges[l][1] = min_of(all.w_max * (1 + RANGE_SLACK) + slack, task->rays.w_limit * NEAR_LIMIT);
        task->ranges[l][1] = max_of(task->ranges[l][1], task->ranges[l][0]);
    }
}

static void place_tile(const struct warp_task *task, struct tile *tile)
{
    const float side = (float)(tile->size - 1), x = (float)tile->x + 0.5f, y = (float)tile->y + 0.5f;
    for (int i = 0; i < 4; i++)
        tile->rays[i] = rays_at(&task->rays, x + (i & 1 ? side : 0), y + (i >> 1 ? side : 0));
}

/* Bounds of the rays within the range, and the maximum shift along each axis. */
struct box {
    float low[2], high[2], shift[2];
};

static struct box box_of(const struct tile *tile)
{
    struct box box = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}, {0, 0}};
    for (int i = 0; i < 4; i++) {
        const float places[2] = {tile->rays[i].x, tile->rays[i].y};
        const float shifts[2] = {tile->rays[i].shift_x, tile->rays[i].shift_y};
        for (int axis = 0; axis < 2; axis++) {
            const float near = places[axis] + tile->range[1] * shifts[axis];
            const float far = places[axis] + tile->range[0] * shifts[axis];
            box.low[axis] = min_of(min_of(near, far), box.low[axis]);
            box.high[axis] = max_of(max_of(near, far), box.high[axis]);
            box.shift[axis] = max_of(magnitude(shifts[axis]), box.shift[axis]);
        }
    }
    return box;
}

/* Narrows the range once; true if another round may help. */
static bool narrow_once(const struct warp_layer *layer, struct tile *tile)
{
    const float last[2] = {(float)(layer->width - 1), (float)(layer->height - 1)};
    const struct box box = box_of(tile);
    tile->is_outside =
        !(box.high[0] >= 0 && box.high[1] >= 0 && box.low[0] <= last[0] + 1 && box.low[1] <= last[1] + 1);
    tile->is_inside = box.low[0] >= 0 && box.low[1] >= 0 && box.high[0] <= last[0] && box.high[1] <= last[1];
    if (tile->is_outside)
        return false;
    uint32_t first[2], end[2];
    for (int axis = 0; axis < 2; axis++) {
        first[axis] = (uint32_t)clamp(box.low[axis], 0, last[axis]);
        end[axis] = (uint32_t)clamp(box.high[axis], 0, last[axis]);
    }
    const struct warp_block all = blocks_of(layer, first, end, &tile->level);
    const float slack = layer->tolerance + 2 * layer->noise, before = tile->range[1] - tile->range[0];
    tile->stretch = all.steep_x * box.shift[0] + all.steep_y * box.shift[1];
    tile->range[1] = min_of(tile->range[1], all.w_max * (1 + RANGE_SLACK) + slack);
    tile->range[0] = max_of(tile->range[0], all.w_min * (1 - RANGE_SLACK) - slack);
    tile->range[1] = max_of(tile->range[1], tile->range[0]);
    return tile->range[1] - tile->range[0] < NARROWING_LEAST * before;
}

static void narrow(const struct warp_layer *layer, struct tile *tile)
{
    for (int i = 0; i < NARROWINGS_MAX && narrow_once(layer, tile); i++)
        continue;
}

/* ---- packets ---- */

LANES_KERNEL static void place_packet(const struct warp_rays *rays, struct warp_packet *restrict packet, float x,
                                      float y)
{
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const int column = k % (int)PACKET_COLUMNS, row = k / (int)PACKET_COLUMNS;
        const struct warp_ray ray = rays_at(rays, x + (float)column + 0.5f, y + (float)row + 0.5f);
        packet->x[k] = ray.x;
        packet->y[k] = ray.y;
        packet->shift_x[k] = ray.shift_x;
        packet->shift_y[k] = ray.shift_y;
    }
}

/* Sets the places from which rays without a known hit take their colours. */
static void go_back(const struct warp_packet *packet, float texels, struct warp_march *march)
{
    for (int k = 0; k < LANES; k++) {
        const float across = packet->shift_x[k], down = packet->shift_y[k];
        const float share = texels / max_of(sqrtf(across * across + down * down), SHIFT_MIN);
        const bool is_hit = march->state[k] == MARCH_HIT;
        march->x[k] = is_hit ? march->x[k] : march->before_x[k] + share * across;
        march->y[k] = is_hit ? march->y[k] : march->before_y[k] + share * down;
    }
}

/* Results of a packet. */
struct result {
    uint32_t colours[LANES], mask[LANES], deeper;
    uint8_t sticking[LANES];
};

/* Continues the rays that passed behind the previous layers in this one. */
static void march_deeper(const struct warp_task *task, uint32_t l, const struct warp_packet *packet,
                         float w_begin[LANES], struct result *result)
{
    const struct warp_layer *layer = &task->layers[l];
    struct warp_march march = {.x = {0}};
    uint32_t colours[LANES];
    uint8_t sticking[LANES];
    for (int k = 0; k < LANES; k++) {
        march.state[k] = result->mask[k] == FL_WARP_BEHIND ? MARCH_ON : MARCH_IDLE;
        march.w[k] = min_of(w_begin[k], task->ranges[l][1]);
    }
    warp_march(layer, packet, &march, max_of(task->ranges[l][0], 0), QUADTREE_TOP);
    for (int k = 0; k < LANES; k++) {
        const int x = texel_of(march.x[k], (int)layer->width - 1),
                  y = texel_of(march.y[k], (int)layer->height - 1);
        const bool is_something = layer->w[(uint32_t)y * layer->padded_width + (uint32_t)x] > 0;
        if (march.state[k] == MARCH_HIT && !is_something)
            march.state[k] = MARCH_IDLE;
        if (march.state[k] == MARCH_BEHIND)
            w_begin[k] = march.w[k];
    }
    warp_colour(layer, march.x, march.y, colours);
    if (task->sticks)
        warp_sticking(layer, march.x, march.y, sticking);
    for (int k = 0; k < LANES; k++)
        if (march.state[k] == MARCH_HIT) {
            result->colours[k] = colours[k];
            result->sticking[k] = task->sticks ? sticking[k] : 0;
            result->mask[k] = FL_WARP_KNOWN;
            result->deeper++;
        }
}

static void march_packet(const struct warp_task *task, const struct tile *tile, const struct warp_packet *packet,
                         struct result *result)
{
    const struct warp_layer *layer = &task->layers[0];
    struct warp_march march;
    bool any_behind = false;
    for (int k = 0; k < LANES; k++) {
        march.state[k] = MARCH_ON;
        march.w[k] = tile->range[1];
        march.x[k] = march.y[k] = march.before_x[k] = march.before_y[k] = 0;
    }
    warp_march(layer, packet, &march, tile->range[0], tile->level);
    for (int k = 0; k < LANES; k++) {
        const bool is_hit = march.state[k] == MARCH_HIT;
        result->mask[k] = is_hit                           ? FL_WARP_KNOWN
                          : march.state[k] == MARCH_BEHIND ? FL_WARP_BEHIND
                                                           : FL_WARP_OUTSIDE;
        any_behind |= march.state[k] == MARCH_BEHIND;
    }
    go_back(packet, task->fill_back, &march);
    warp_colour(layer, march.x, march.y, result->colours);
    if (task->sticks)
        warp_sticking(layer, march.x, march.y, result->sticking);
    for (uint32_t l = 1; l < task->layer_count && any_behind; l++)
        march_deeper(task, l, packet, march.w, result);
}

/* ---- out ---- */

/* Draws a faint chequer: the colour half way to a light and a dark grey. */
static uint32_t under_pattern(uint32_t colour, uint32_t x, uint32_t y)
{
    const uint32_t grey = (x >> 3 ^ y >> 3) & 1 ? 0x505050u : 0x303030u;
    return (colour & 0xff000000u) | ((colour >> 1 & 0x7f7f7fu) + grey);
}

static void store_sticking(const struct warp_task *task, size_t first, const struct warp_pixels *pixels,
                           uint32_t count, struct warp_tally *tally)
{
    uint32_t sum = 0;
    for (uint32_t k = 0; k < count; k++)
        sum += pixels->mask[k] == FL_WARP_KNOWN ? pixels->sticking[k] : 0;
    tally->sticking += sum;
    for (uint32_t k = 0; task->sticking && k < count; k++)
        task->sticking[first + k] = pixels->mask[k] == FL_WARP_KNOWN ? pixels->sticking[k] : 0;
}

void warp_store(const struct warp_task *task, uint32_t x, uint32_t y, const struct warp_pixels *pixels,
                struct warp_tally *tally)
{
    if (x >= task->width || y >= task->height)
        return;
    const uint32_t count = pixels->count < task->width - x ? pixels->count : task->width - x;
    uint32_t *colours = task->colours + (size_t)y * task->stride + x, behind = 0, outside = 0;
    uint8_t *mask = task->mask + (size_t)y * task->stride + x;
    memcpy(colours, pixels->colours, count * sizeof(*colours));
    for (uint32_t k = 0; k < count; k++) {
        mask[k] = (uint8_t)pixels->mask[k];
        behind += pixels->mask[k] == FL_WARP_BEHIND;
        outside += pixels->mask[k] == FL_WARP_OUTSIDE;
    }
    tally->by_mask[FL_WARP_KNOWN] += count - behind - outside;
    tally->by_mask[FL_WARP_BEHIND] += behind;
    tally->by_mask[FL_WARP_OUTSIDE] += outside;
    if (task->sticks)
        store_sticking(task, (size_t)y * task->stride + x, pixels, count, tally);
    if (task->holes != FL_WARP_PATTERN || behind + outside == 0)
        return;
    for (uint32_t k = 0; k < count; k++)
        if (mask[k] != FL_WARP_KNOWN)
            colours[k] = under_pattern(colours[k], x + k, y);
}

/* Stores a packet with known pixels only, all within the picture. */
static void store_known(const struct warp_task *task, uint32_t x, uint32_t y, const struct result *result,
                        struct warp_tally *tally)
{
    const size_t i = (size_t)y * task->stride + x;
    const uint32_t *colours = result->colours;
    memcpy(task->colours + i, colours, PACKET_COLUMNS * sizeof(*colours));
    memcpy(task->colours + i + task->stride, colours + PACKET_COLUMNS, PACKET_COLUMNS * sizeof(*colours));
    if (task->sticks && task->sticking) {
        memcpy(task->sticking + i, result->sticking, PACKET_COLUMNS);
        memcpy(task->sticking + i + task->stride, result->sticking + PACKET_COLUMNS, PACKET_COLUMNS);
    }
    for (int k = 0; task->sticks && k < LANES; k++)
        tally->sticking += result->sticking[k];
    memset(task->mask + i, FL_WARP_KNOWN, PACKET_COLUMNS);
    memset(task->mask + i + task->stride, FL_WARP_KNOWN, PACKET_COLUMNS);
    tally->by_mask[FL_WARP_KNOWN] += LANES;
}

static void trace_packet(const struct warp_task *task, const struct tile *tile, bool is_smooth, uint32_t x,
                         uint32_t y, struct warp_tally *tally)
{
    struct warp_packet packet;
    struct warp_march march;
    struct result result;
    if (x >= task->width || y >= task->height)
        return;
    const bool is_whole = x + PACKET_COLUMNS <= task->width && y + PACKET_ROWS <= task->height;
    place_packet(&task->rays, &packet, (float)x, (float)y);
    const bool is_solved = is_smooth && warp_solve(&task->layers[0], &packet, tile->range, &march);
    if (is_solved)
        warp_colour(&task->layers[0], march.x, march.y, result.colours);
    if (is_solved && task->sticks)
        warp_sticking(&task->layers[0], march.x, march.y, result.sticking);
    if (is_solved && is_whole) {
        store_known(task, x, y, &result, tally);
        return;
    }
    memset(result.mask, FL_WARP_KNOWN, sizeof(result.mask));
    result.deeper = 0;
    if (!is_solved) {
        march_packet(task, tile, &packet, &result);
        tally->marched += LANES;
        tally->deeper += result.deeper;
    }
    for (uint32_t row = 0; row < PACKET_ROWS; row++) {
        const uint32_t first = row * PACKET_COLUMNS;
        const struct warp_pixels pixels = {PACKET_COLUMNS, result.colours + first, result.mask + first,
                                           result.sticking + first};
        warp_store(task, x, y + row, &pixels, tally);
    }
}

static void trace_tile(const struct warp_task *task, struct tile tile, struct warp_tally *tally)
{
    place_tile(task, &tile);
    narrow(&task->layers[0], &tile);
    const bool is_smooth = tile.is_inside && tile.stretch <= STRETCH_MAX;
    if (!is_smooth && tile.size > PACKET_COLUMNS && !tile.is_outside) {
        const uint32_t half = tile.size / 2;
        for (uint32_t i = 0; i < 4; i++) {
            struct tile quarter = {.x = tile.x + (i & 1) * half, .y = tile.y + (i >> 1) * half, .size = half};
            quarter.range[0] = tile.range[0];
            quarter.range[1] = tile.range[1];
            trace_tile(task, quarter, tally);
        }
        return;
    }
    for (uint32_t y = tile.y; y < tile.y + tile.size; y += PACKET_ROWS)
        for (uint32_t x = tile.x; x < tile.x + tile.size; x += PACKET_COLUMNS)
            trace_packet(task, &tile, is_smooth, x, y, tally);
}

void warp_trace_row(const struct warp_task *task, uint32_t row, struct warp_tally *tally)
{
    for (uint32_t x = 0; x < task->width; x += WARP_TILE) {
        struct tile tile = {.x = x, .y = row * WARP_TILE, .size = WARP_TILE};
        tile.range[0] = task->ranges[0][0];
        tile.range[1] = task->ranges[0][1];
        trace_tile(task, tile, tally);
    }
}
