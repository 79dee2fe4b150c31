/* SPDX-License-Identifier: MIT */
/* Lists made on the device by prefix sums: their order is that of what they are made from, every time, and they
 * have no holes. */
#ifndef FARLIGHT_RENDER_COMPACT_H
#define FARLIGHT_RENDER_COMPACT_H

#include "render/context.h"
#include "shared/wave.h"

/* Lists the hits of the current wave: context->hit_list, hit_places and hit_count. Waits for the GPU. */
bool compact_hits(struct render_context *context, struct error *error);
/* Counts of item_count items' blocks, made by the program `count` that is in use, become places in
 * context->block_offsets; *state takes the sums. Waits for the GPU. */
bool compact_scan(struct render_context *context, const struct gpu_program *count, uint32_t item_count,
                  struct wave_state *state, struct error *error);

#endif
