/* SPDX-License-Identifier: MIT */
/* The passes of a wave, by an integrator's row: what left the scene, what hits send out and ask for, shadow rays
 * traced and gathered, children made the next wave. */
#ifndef FARLIGHT_RENDER_WAVES_SHADING_H
#define FARLIGHT_RENDER_WAVES_SHADING_H

#include "render/waves/integrator.h"

enum wave_progress {
    WAVE_FAILED,
    WAVE_AGAIN,    /* the current wave is not finished: call again */
    WAVE_MORE,     /* the context holds the next wave's rays and paths, not yet traced */
    WAVE_DONE,     /* no ray is left */
    WAVE_OVERFLOW, /* the next wave is larger than its capacity: the slice must be done again, in parts */
};

/* Its buffers. Owner: a frame's work. */
struct wave_passes {
    const struct integrator *integrator; /* NULL: not set up; otherwise all-zero */
    struct gpu_buffer radiance, children, child_counts;
    struct gpu_buffer shadow_rays, shadow_times, visibility, light_samples;
};

void wave_passes_finish(struct wave_passes *passes, struct gpu_device *device); /* leaves it all-zero */
/* Makes the buffers fit context->wave_capacity; at the start of a frame and when the capacity grows. */
bool wave_passes_reserve(struct wave_passes *passes, struct render_context *context, struct error *error);
uint64_t wave_passes_device_bytes(const struct wave_passes *passes);
/* Shades the wave whose hits the context holds and adds it to slice_sums. A batch of shadow rays, as many of each
 * hit as the buffers hold, is made in one call and traced in the next ones; their number goes to
 * context->shadow_rays. A call is short. */
enum wave_progress wave_passes_shade(struct wave_passes *passes, struct render_context *context,
                                     struct error *error);

/* Whether hits are likely to send rays on. If they do all the same, slices whose waves do not fit are split. */
bool wave_passes_expect_bounces(const struct wave_passes *passes, const struct render_context *context);
/* Announces the programs that every frame of the integrator needs (gpu_program_announce): those of its first wave,
 * and of its bounces where there will be some. */
void wave_passes_announce(struct wave_passes *passes, struct render_context *context);
/* Announces those that shade its first hits and trace their shadow rays, which take longest to compile. */
void wave_passes_announce_long(struct wave_passes *passes, struct render_context *context);
/* Announces the one that shades hits, which is the longest of many materials. */
void wave_passes_announce_hits(struct wave_passes *passes, struct render_context *context);
/* Announces those of the first wave that trace nothing. */
void wave_passes_announce_shading(struct wave_passes *passes, struct render_context *context);

#endif
