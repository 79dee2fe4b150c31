/* SPDX-License-Identifier: MIT */
/* Slices that are queued on the device and not known to be done. The host never waits for one: it looks whether
 * the oldest is done when it could queue another one. */
#ifndef FARLIGHT_RENDER_SLICES_AHEAD_H
#define FARLIGHT_RENDER_SLICES_AHEAD_H

#include "gpu/readback.h"
#include "render/slices.h"
#include "shared/wave.h"

/* While the device works on one, the next is there already. */
#define SLICES_AHEAD_MAX 2

/* From where to do it again. */
struct slice_ahead {
    struct gpu_readback state; /* a struct wave_state, as it is behind the slice's last pass */
    struct slices slices;      /* before it was taken */
    uint32_t sample, rays;     /* of its first wave */
    unsigned queries[2];       /* GL time stamps: it begins, it ends */
};

/* All-zero is the valid empty one. */
struct slices_ahead {
    struct slice_ahead ring[SLICES_AHEAD_MAX];
    uint32_t oldest, count;
    uint32_t slice_rays; /* of the slices that take as long as they should; 0: not known */
};

/* How many rays a slice of at most that many has. */
uint32_t slices_ahead_rays(const struct slices_ahead *ahead, uint32_t maximum);
/* A slice is about to be taken from `slices`, at that sample. There is a place for it. */
void slices_ahead_begin(struct slices_ahead *ahead, struct gpu_device *device, const struct slices *slices,
                        uint32_t sample);
/* All passes of the slice, which has so many rays in its first wave, are queued. */
bool slices_ahead_add(struct slices_ahead *ahead, struct gpu_device *device, const struct gpu_buffer *wave_state,
                      uint32_t rays, struct error *error);
/* Whether the oldest is done; false if there is none. */
bool slices_ahead_has_done(const struct slices_ahead *ahead);
/* Takes the oldest, which is done: what became of it. *slice is valid until the next one begins. */
bool slices_ahead_take(struct slices_ahead *ahead, struct gpu_device *device, const struct slice_ahead **slice,
                       struct wave_state *state, struct error *error);
/* From the slice just taken, how large those to come are to be for the device to work about `step_ns` on one. */
void slices_ahead_learn(struct slices_ahead *ahead, const struct slice_ahead *slice, uint64_t step_ns);
/* What it learns: how many rays the next slices have, after one of `rays` took so long. */
uint32_t slices_ahead_next_rays(uint32_t rays, uint64_t took_ns, uint64_t step_ns);
/* Other rays, or by another tracer: the next slice is a first one. */
void slices_ahead_forget(struct slices_ahead *ahead);
void slices_ahead_drop(struct slices_ahead *ahead); /* all of them */
void slices_ahead_finish(struct slices_ahead *ahead, struct gpu_device *device);

#endif
