/* SPDX-License-Identifier: MIT */
/* Stackless traversal of the quadtree (Widmer and others, section 4): the way up the tree follows from the bits
 * in which two neighbours differ. */
#include "warp/march.h"

#include "warp/node.h"

#define ITERATIONS_MAX 6
#define NODE_COLUMNS_MASK 0xffff /* hides the sign of the negative number of a neighbour beyond the border */
#define SHIFT_MIN 1e-6f          /* texels: a ray that moves less stays in its column or row */
/* Adjacent planes do not quite meet. A ray that is behind a plane by no more than the bound has hit it; so has
 * a ray that is behind it by this share of w, which covers rounding: 0.04 pixels at 1 m from an eye 15 cm
 * aside, for a focal length of 1000. */
#define ROUNDING_SHARE 2.441e-4f /* 2^-12 */
/* Maximum movement of a place in the last iteration, in texels. The remaining error is smaller by the deviation
 * of surfaces from planes. */
#define SOLVED_TEXELS 0.0625f
#define SLOPE_LEAST 0.25f /* limit of 1 - slope * shift, which is at least 0.5 where a solution is searched */

/* A layer as rays see it. */
struct ground {
    const uint32_t *nodes;
    int across, last_x, last_y; /* nodes in a row of the lowest level; indices of the last texels */
    uint32_t texels;
    float tolerance, nearness, noise;
};

static struct ground ground_of(const struct warp_layer *layer)
{
    return (struct ground){.nodes = layer->nodes,
                           .across = (int)layer->padded_width,
                           .last_x = (int)layer->width - 1,
                           .last_y = (int)layer->height - 1,
                           .texels = layer->padded_width * layer->padded_height,
                           .tolerance = layer->tolerance,
                           .nearness = layer->nearness,
                           .noise = 2 * layer->noise};
}

/* State of rays that each step changes. */
struct lanes {
    float inverse_x[LANES], inverse_y[LANES], w_end[LANES];
    int level[LANES], x[LANES], y[LANES], is_first[LANES], is_clipped[LANES], leaves[LANES];
};

LANES_INLINE float inverse_of(float shift)
{
    return 1 / (magnitude(shift) > SHIFT_MIN ? shift : shift < 0 ? -SHIFT_MIN : SHIFT_MIN);
}

LANES_KERNEL static void begin(const struct ground *ground, const struct warp_packet *packet,
                               struct warp_march *march, struct lanes *lanes, const float w_low, const int level)
{
    const float right = (float)(ground->last_x + 1), bottom = (float)(ground->last_y + 1);
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const float inverse_x = inverse_of(packet->shift_x[k]), inverse_y = inverse_of(packet->shift_y[k]);
        const float a = -packet->x[k] * inverse_x, b = (right - packet->x[k]) * inverse_x;
        const float c = -packet->y[k] * inverse_y, d = (bottom - packet->y[k]) * inverse_y;
        const float enters = min_of(max_of(a, b), max_of(c, d)), leaves = max_of(min_of(a, b), min_of(c, d));
        const float w = min_of(march->w[k], enters), w_end = max_of(w_low, leaves);
        const float x = clamp(packet->x[k] + packet->shift_x[k] * w, 0, right - 1);
        const float y = clamp(packet->y[k] + packet->shift_y[k] * w, 0, bottom - 1);
        const uint32_t is_active = mask_of(march->state[k] == MARCH_ON);
        lanes->inverse_x[k] = inverse_x;
        lanes->inverse_y[k] = inverse_y;
        lanes->w_end[k] = w_end;
        lanes->level[k] = level;
        lanes->x[k] = (int)x >> level;
        lanes->y[k] = (int)y >> level;
        lanes->is_first[k] = -1;
        lanes->is_clipped[k] = (int)mask_of(enters < march->w[k]);
        lanes->leaves[k] = (int)mask_of(leaves > w_low);
        march->state[k] = pick_int(is_active & mask_of(w < w_end), MARCH_OUTSIDE, march->state[k]);
        march->w[k] = pick(is_active, w, march->w[k]);
        march->before_x[k] = pick(is_active, x, march->before_x[k]);
        march->before_y[k] = pick(is_active, y, march->before_y[k]);
    }
}

LANES_INLINE float slack_at(const struct ground *ground, float w)
{
    const float near = max_of(1 - ground->nearness * w, 0);
    return ground->tolerance * near * near + ROUNDING_SHARE * w + ground->noise;
}

/* Moves a ray through the node `head`, `tail`; returns all bits if it continues. */
LANES_INLINE uint32_t step(const struct ground *ground, const struct warp_packet *packet, struct warp_march *march,
                           struct lanes *lanes, const int k, const uint32_t head, const uint32_t tail)
{
    const int level = lanes->level[k], x = lanes->x[k], y = lanes->y[k];
    const float from_x = packet->x[k], from_y = packet->y[k], shift_x = packet->shift_x[k];
    const float shift_y = packet->shift_y[k], w = march->w[k], w_end = lanes->w_end[k];
    const uint32_t is_active = mask_of(march->state[k] == MARCH_ON), is_first = (uint32_t)lanes->is_first[k];
    /* w decreases, so the ray moves against its shift. */
    const int to_right = shift_x < 0, to_below = shift_y < 0;
    const float exit_x = ((float)((x + to_right) << level) - from_x) * lanes->inverse_x[k];
    const float exit_y = ((float)((y + to_below) << level) - from_y) * lanes->inverse_y[k];
    const float w_out = min_of(max_of(max_of(exit_x, exit_y), w_end), w);
    /* The gap is the distance of the surface before the ray, in w: above 0 the ray is behind it. */
    const float half = 0.5f * (float)(1 << level), slope_x = plane_slope_x(tail), slope_y = plane_slope_y(tail);
    const float centre_x = (float)(x << level) + half, centre_y = (float)(y << level) + half,
                w_plane = plane_w(head);
    const float gap = w_plane + slope_x * (from_x - centre_x) + slope_y * (from_y - centre_y);
    const float growth = slope_x * shift_x + slope_y * shift_y - 1, gap_in = gap + growth * w;
    const float gap_out = gap + growth * w_out, slack = slack_at(ground, w_plane);
    const uint32_t is_plane = mask_of((int32_t)head < 0), is_last = mask_of(w_out <= w_end);
    const uint32_t is_behind_plane = is_plane & mask_of(gap_in > slack);
    /* A box with gaps has a negative value here. */
    const uint32_t is_behind = is_behind_plane | (~is_plane & mask_of(w < float_from_bits(tail) - slack));
    /* The last surface before the end is hit, however planes are rounded. */
    const uint32_t crosses = mask_of(gap_in >= 0) | mask_of(gap_out >= 0) | (is_last & mask_of(gap_out >= -slack));
    const uint32_t is_met = is_plane & ~is_behind & crosses;
    const uint32_t goes_down = ~is_plane & ~is_behind & mask_of(w_out <= float_from_bits(head));
    const uint32_t passes = ~(is_behind | is_met | goes_down);
    const float apart = gap_in - gap_out, share = gap_in / pick(mask_of(magnitude(apart) > 1e-20f), apart, 1e-20f);
    const float w_met = pick(mask_of(gap_in >= 0), w, w + (w_out - w) * clamp(share, 0, 1));
    /* The child that contains the ray. */
    const int lower = level - (level > 0), low_x = 2 * x, low_y = 2 * y;
    const int at_x = texel_of(from_x + shift_x * w, ground->last_x) >> lower;
    const int at_y = texel_of(from_y + shift_y * w, ground->last_y) >> lower;
    const int child_x = max_int(min_int(at_x, low_x + 1), low_x),
              child_y = max_int(min_int(at_y, low_y + 1), low_y);
    /* The neighbour, or the largest node that contains it but not this node. */
    const uint32_t is_across = mask_of(exit_x > exit_y);
    const int next_x = x + pick_int(is_across, 2 * to_right - 1, 0),
              next_y = y + pick_int(is_across, 0, 2 * to_below - 1);
    const uint32_t ends = is_last | mask_of(next_x < 0) | mask_of(next_y < 0) |
                          mask_of(next_x > ground->last_x >> level) | mask_of(next_y > ground->last_y >> level);
    const int differ = ((x ^ next_x) | (y ^ next_y)) & NODE_COLUMNS_MASK;
    const int up = (int)(bits_of((float)differ) >> 23) - 127; /* index of the highest set bit */
    const int higher = min_int(level + up, QUADTREE_TOP), by = higher - level;
    const int where_behind = pick_int(is_first & (uint32_t)lanes->is_clipped[k], MARCH_OUTSIDE, MARCH_BEHIND);
    const int where_ends = pick_int((uint32_t)lanes->leaves[k], MARCH_OUTSIDE, MARCH_BEHIND);
    const int state = pick_int(is_behind, where_behind,
                               pick_int(is_met, MARCH_HIT, pick_int(passes & ends, where_ends, MARCH_ON)));
    const uint32_t continues = is_active & mask_of(state == MARCH_ON), meets = is_active & is_met;
    const float w_passed = 0.5f * (w + w_out);
    march->before_x[k] = pick(is_active & passes, from_x + shift_x * w_passed, march->before_x[k]);
    march->before_y[k] = pick(is_active & passes, from_y + shift_y * w_passed, march->before_y[k]);
    march->x[k] = pick(meets, from_x + shift_x * w_met, march->x[k]);
    march->y[k] = pick(meets, from_y + shift_y * w_met, march->y[k]);
    march->w[k] = pick(is_active, pick(is_met, w_met, pick(passes, w_out, w)), w);
    march->state[k] = pick_int(is_active, state, march->state[k]);
    lanes->is_first[k] = (int)(is_first & (~is_active | goes_down));
    lanes->level[k] = pick_int(continues, pick_int(goes_down, lower, higher), level);
    lanes->x[k] = pick_int(continues, pick_int(goes_down, child_x, next_x >> by), x);
    lanes->y[k] = pick_int(continues, pick_int(goes_down, child_y, next_y >> by), y);
    return continues;
}

/* Loads the nodes of the rays one by one, since a gather is no faster. */
struct nodes {
    uint32_t words[LANES][2];
};

static inline void load_nodes(const struct ground *ground, const int places[LANES], struct nodes *nodes)
{
    for (int k = 0; k < LANES; k++)
        memcpy(nodes->words[k], ground->nodes + 2 * (size_t)places[k], sizeof(nodes->words[k]));
}

/* Moves all rays a step. False: no ray continues. */
LANES_KERNEL static bool march_step(const struct ground *ground, const struct warp_packet *restrict packet,
                                    struct warp_march *restrict march, struct lanes *restrict lanes)
{
    struct nodes nodes;
    int places[LANES];
    uint32_t any = 0;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        const int level = lanes->level[k];
        places[k] = (int)node_level_first(ground->texels, (uint32_t)level) +
                    lanes->y[k] * (ground->across >> level) + lanes->x[k];
    }
    load_nodes(ground, places, &nodes);
#pragma omp simd reduction(| : any)
    for (int k = 0; k < LANES; k++)
        any |= step(ground, packet, march, lanes, k, nodes.words[k][0], nodes.words[k][1]);
    return any != 0;
}

void warp_march(const struct warp_layer *layer, const struct warp_packet *packet, struct warp_march *march,
                float w_low, uint32_t level)
{
    const struct ground ground = ground_of(layer);
    struct lanes lanes;
    begin(&ground, packet, march, &lanes, w_low, (int)level);
    while (march_step(&ground, packet, march, &lanes))
        continue;
}

/* ---- one surface ---- */

/* Runs an iteration for all rays; false: none has moved much. */
LANES_KERNEL static bool solve_step(const struct ground *ground, const struct warp_packet *restrict packet,
                                    float *restrict w, const float range[2])
{
    const float low = range[0], high = range[1];
    struct nodes nodes;
    int x[LANES], y[LANES], places[LANES];
    uint32_t moved = 0;
#pragma omp simd
    for (int k = 0; k < LANES; k++) {
        x[k] = texel_of(packet->x[k] + packet->shift_x[k] * w[k], ground->last_x);
        y[k] = texel_of(packet->y[k] + packet->shift_y[k] * w[k], ground->last_y);
        places[k] = y[k] * ground->across + x[k];
    }
    load_nodes(ground, places, &nodes);
#pragma omp simd reduction(| : moved)
    for (int k = 0; k < LANES; k++) {
        const float slope_x = plane_slope_x(nodes.words[k][1]), slope_y = plane_slope_y(nodes.words[k][1]);
        const float gap = plane_w(nodes.words[k][0]) + slope_x * (packet->x[k] - ((float)x[k] + 0.5f)) +
                          slope_y * (packet->y[k] - ((float)y[k] + 0.5f));
        const float turn = max_of(1 - (slope_x * packet->shift_x[k] + slope_y * packet->shift_y[k]), SLOPE_LEAST);
        const float next = clamp(gap / turn, low, high), step_w = magnitude(next - w[k]);
        moved |=
            mask_of(step_w * max_of(magnitude(packet->shift_x[k]), magnitude(packet->shift_y[k])) > SOLVED_TEXELS);
        w[k] = next;
    }
    return moved != 0;
}

bool warp_solve(const struct warp_layer *layer, const struct warp_packet *packet, const float range[2],
                struct warp_march *march)
{
    const struct ground ground = ground_of(layer);
    bool has_moved = true;
    for (int k = 0; k < LANES; k++)
        march->w[k] = 0.5f * (range[0] + range[1]);
    for (int i = 0; i < ITERATIONS_MAX && has_moved; i++)
        has_moved = solve_step(&ground, packet, march->w, range);
    for (int k = 0; k < LANES; k++) {
        march->x[k] = packet->x[k] + packet->shift_x[k] * march->w[k];
        march->y[k] = packet->y[k] + packet->shift_y[k] * march->w[k];
    }
    return !has_moved;
}
