/* SPDX-License-Identifier: MIT */
/* GPU time of a frame's passes, by pairs of timestamp queries. */
#ifndef FARLIGHT_GPU_TIMER_H
#define FARLIGHT_GPU_TIMER_H

#include "base/stage_times.h"
#include "gpu/device.h"

struct gpu_timer;

struct gpu_timer *gpu_timer_create(struct gpu_device *device); /* NULL: out of memory */
void gpu_timer_destroy(struct gpu_timer *timer);               /* accepts NULL */
/* Begins and ends a span; spans may not nest. Those beyond the ring's size are measured on the CPU alone. Each
 * span is also measured with the CPU clock, and both are added to the stage times. */
void gpu_timer_begin(struct gpu_timer *timer, enum stage stage, uint32_t wave);
void gpu_timer_end(struct gpu_timer *timer);
/* Waits until the GPU has finished the spans, and adds every span since the last collect to `times` (may be
 * NULL). A query without a result is left out, never reported as 0. */
void gpu_timer_collect(struct gpu_timer *timer, struct stage_times *times);
/* Drops the spans. */
void gpu_timer_drop(struct gpu_timer *timer);
/* Adds the spans that the GPU has finished, without a wait. Returns the number of remaining ones. */
size_t gpu_timer_collect_done(struct gpu_timer *timer, struct stage_times *times);

#endif
