/* SPDX-License-Identifier: MIT */
/* Binary tree over emitters, by which one is chosen in proportion to an estimate of its light at a point: Conty
 * Estevez, Kulla. Importance Sampling of Many Lights with Adaptive Tree Splitting. 2018, without the splitting. */
#ifndef FARLIGHT_GPU_SCENE_EMITTER_TREE_H
#define FARLIGHT_GPU_SCENE_EMITTER_TREE_H

#include "shared/emitter.h"

#include <stdbool.h>
#include <stdint.h>

/* Bounds of surfaces that shine on both sides. Power 0: nothing, whatever the other members. */
struct emitter_bounds {
    float lower[3], upper[3];
    float axis[3]; /* unit; the angle between it and any normal, or the normal's opposite, is at most `spread` */
    float spread;  /* radians, 0 .. pi / 2 */
    float power;
};

/* Bounds of both. */
struct emitter_bounds emitter_bounds_union(const struct emitter_bounds *a, const struct emitter_bounds *b);

/* Builds the tree of `leaf_count` leaves, 1 or more. nodes: 2 * leaf_count - 1; trails: by leaf. False: no
 * memory. */
bool emitter_tree_build(const struct emitter_bounds *leaves, uint32_t leaf_count, struct emitter_node *nodes,
                        uint32_t *trails);
/* Refits the tree to leaves that have moved or changed their power. False: no memory. */
bool emitter_tree_refit(const struct emitter_bounds *leaves, uint32_t leaf_count, struct emitter_node *nodes);

#endif
