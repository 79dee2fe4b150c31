/* SPDX-License-Identifier: MIT */
/* LANES rays through one layer, in step. */
#ifndef FARLIGHT_CLIENT_WARP_WALK_H
#define FARLIGHT_CLIENT_WARP_WALK_H

#include "warp/rays.h"
#include "warp/tree.h"

enum walk_state {
    WALK_ON,      /* also: still to be traced */
    WALK_HIT,     /* the ray is at a surface */
    WALK_BEHIND,  /* it came behind one */
    WALK_OUTSIDE, /* it left what the layer covers, or came in behind a surface */
    WALK_IDLE     /* not to be traced */
};

/* Of each ray: what has become of it, and where. */
struct warp_walk {
    int state[LANES];
    float w[LANES];                         /* in: where the ray begins */
    float x[LANES], y[LANES];               /* of a hit */
    float before_x[LANES], before_y[LANES]; /* where the ray was last before a surface, within the layer */
};

/* Surfaces are searched from w downwards to w_low, below which no ray has anything before it. `level` is that of
 * the nodes to begin with. */
void warp_walk(const struct warp_layer *layer, const struct warp_packet *packet, struct warp_walk *walk,
               float w_low, uint32_t level);

/* Where each ray meets a layer that has one surface for each of them between two depths, by Newton's method on the
 * planes of its leaves: w, x and y of the walk. False: it has not come close enough to some of them. */
bool warp_solve(const struct warp_layer *layer, const struct warp_packet *packet, const float range[2],
                struct warp_walk *walk);

#endif
