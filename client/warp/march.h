/* SPDX-License-Identifier: MIT */
/* Traversal of one layer by LANES rays in lockstep. */
#ifndef FARLIGHT_CLIENT_WARP_MARCH_H
#define FARLIGHT_CLIENT_WARP_MARCH_H

#include "warp/rays.h"
#include "warp/tree.h"

enum march_state {
    MARCH_ON,      /* the ray continues; initially: it has to be traced */
    MARCH_HIT,     /* the ray is at a surface */
    MARCH_BEHIND,  /* the ray passed behind a surface */
    MARCH_OUTSIDE, /* the ray left the layer, or entered it behind a surface */
    MARCH_IDLE     /* not to be traced */
};

/* State and result of each ray. */
struct warp_march {
    int state[LANES];
    float w[LANES];                         /* in: start of the ray */
    float x[LANES], y[LANES];               /* place of a hit */
    float before_x[LANES], before_y[LANES]; /* last place of the ray before a surface, within the layer */
};

/* Traverses the layer from w down to w_low, below which no ray has anything in front of it. `level` is the
 * level of the first nodes. */
void warp_march(const struct warp_layer *layer, const struct warp_packet *packet, struct warp_march *march,
                float w_low, uint32_t level);

/* Intersects rays with a layer in which each has a single surface between two depths, by Newton's method on the
 * planes of the leaves: sets w, x and y. False: some rays have not converged. */
bool warp_solve(const struct warp_layer *layer, const struct warp_packet *packet, const float range[2],
                struct warp_march *march);

#endif
