/* SPDX-License-Identifier: MIT */
/* Slices that are queued on the device and not known to be done. The host never waits for one: it looks whether
 * the oldest is done when it could queue another one. */
#ifndef FARLIGHT_RENDER_FRAME_SLICES_AHEAD_H
#define FARLIGHT_RENDER_FRAME_SLICES_AHEAD_H

#include "gpu/readback.h"
#include "render/frame/slices.h"
#include "shared/wave.h"

/* While the device works on one, the next is there already. */
#define SLICES_AHEAD_MAX 2

/* A queued slice, with the data to repeat it. */
struct slice_ahead {
    struct gpu_readback state; /* a struct wave_state, as it is behind the slice's last pass */
    struct slices slices;      /* before it was taken */
    uint32_t sample, rays;     /* sample of the slice, and rays of its first wave */
    unsigned queries[2];       /* GL time stamps: it begins, it ends */
};

struct slice_cost {
    uint32_t rays;
    uint64_t took_ns;
};

/* An all-zero one is empty and valid. */
struct slices_ahead {
    struct slice_ahead ring[SLICES_AHEAD_MAX];
    uint32_t oldest, count;
    uint32_t slice_rays;    /* rays of slices that take as long as they should; 0: not known */
    struct slice_cost last; /* no rays: there was none */
    uint64_t fixed_ns;      /* time of a slice however few rays it has */
    bool knows_fixed;       /* slices of two sizes were measured */
};

/* How many rays a slice of at most that many has. */
uint32_t slices_ahead_rays(const struct slices_ahead *ahead, uint32_t maximum);
/* A slice is about to be taken from `slices`, at that sample. There is a place for it. */
void slices_ahead_begin(struct slices_ahead *ahead, struct gpu_device *device, const struct slices *slices,
                        uint32_t sample);
/* Adds the slice after all of its passes were queued; its first wave has that many rays. */
bool slices_ahead_add(struct slices_ahead *ahead, struct gpu_device *device, const struct gpu_buffer *wave_state,
                      uint32_t rays, struct error *error);
/* Whether the oldest is done; false if there is none. */
bool slices_ahead_has_done(const struct slices_ahead *ahead);
/* Takes the oldest slice, which is done, with its outcome. *slice is valid until the next one begins. */
bool slices_ahead_take(struct slices_ahead *ahead, struct gpu_device *device, const struct slice_ahead **slice,
                       struct wave_state *state, struct error *error);
/* Derives the size of later slices from the slice just taken, so that the device works about `step_ns` on
 * one. */
void slices_ahead_learn(struct slices_ahead *ahead, const struct slice_ahead *slice, uint64_t step_ns);
/* Learns from a slice that took so long. is_rest: it has fewer rays than were asked for, as a band of the picture
 * ended. */
void slices_ahead_note(struct slices_ahead *ahead, struct slice_cost cost, bool is_rest, uint64_t step_ns);
/* Number of rays of the next slices: the device works about `step_ns` on each, or twice its fixed time if
 * that is more, so that at least half of its time goes into rays. */
uint32_t slices_ahead_next_rays(struct slice_cost cost, uint64_t fixed_ns, uint64_t step_ns);
/* Other rays, or by another tracer: the next slice is a first one. */
void slices_ahead_forget(struct slices_ahead *ahead);
void slices_ahead_drop(struct slices_ahead *ahead); /* drops every slice */
void slices_ahead_finish(struct slices_ahead *ahead, struct gpu_device *device);

#endif
