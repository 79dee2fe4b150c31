/* SPDX-License-Identifier: MIT */
/* Lists made on the device by prefix sums, in the order of their sources, every time, and without holes; or
 * made by the host (host_passes). The device notes their lengths in wave->state, from which the passes over
 * them are dispatched. */
#ifndef FARLIGHT_RENDER_WAVES_COMPACT_H
#define FARLIGHT_RENDER_WAVES_COMPACT_H

#include "render/context/wave.h"

/* In the order of struct wave_state. */
enum wave_list { WAVE_RAYS, WAVE_RAY_BLOCKS, WAVE_HITS, WAVE_HIT_BLOCKS, WAVE_SHADOW_RAYS };

/* A slice begins: sets the state of its first wave, of wave->ray_count rays. */
void compact_begin(struct render_wave *wave);
/* A slice that the device stopped is done again. */
void compact_repeat(struct render_wave *wave);
/* Dispatches an invocation of the program for each item of the list. */
void compact_dispatch(struct render_wave *wave, const struct gpu_program *program, enum wave_list list);
/* Lists the hits of the wave: hit_list, hit_places and hit_count. */
bool compact_hits(struct render_wave *wave, struct error *error);
struct compact_order {
    uint32_t children_a_hit;
    bool last_queued; /* no wave is queued behind this one, so that no child may be left */
    bool sorts;       /* by the children's directions, where that pays (compact_sample.comp) */
};

/* Finds the places of the hits' children (wave->block_offsets) and their number, wave->ray_count. */
bool compact_children(struct render_wave *wave, const struct compact_order *order, struct gpu_buffer *child_counts,
                      struct error *error);
/* Makes the wave one of `count` shadow rays of each hit. `all_count`: all of them count as rays of the slice;
 * else the children's scan counts those that are alive. */
bool compact_shadow_rays(struct render_wave *wave, uint32_t count, bool all_count, struct wave *rays,
                         struct error *error);
/* Makes the wave one of the current wave's rays. */
void compact_rays(struct render_wave *wave, struct wave *rays);

/* Announce the programs of compact_hits(), and of compact_children() and compact_shadow_rays(). */
void compact_announce_hits(struct render_wave *wave);
void compact_announce_children(struct render_wave *wave, bool sorts);

#endif
