/* SPDX-License-Identifier: MIT */
/* The device for a frame's passes: programs, the time of each pass, and the way of waiting for counts. */
#ifndef FARLIGHT_RENDER_CONTEXT_DEVICE_H
#define FARLIGHT_RENDER_CONTEXT_DEVICE_H

#include "base/stage_times.h"
#include "gpu/device.h"
#include "gpu/program.h"
#include "gpu/timer.h"

struct render_device {
    struct gpu_device *gpu;
    struct gpu_timer *timer;
    struct stage_times times;     /* the frame's spans */
    struct stage_times collected; /* scratch memory, on the way to `times` */
    uint32_t wave_number;         /* the wave that new spans are noted for */
    uint32_t span_count;          /* spans begun since the timer was last collected */
    /* True: the host waits for the counts of each wave and dispatches as many groups as it needs. False: it
     * queues a slice's waves at their largest size, and the device skips the rest (waves/compact.h). */
    bool counts_on_host;
};

/* Begin and end a span of this frame; the timer's ring is emptied before it is full. */
void context_span_begin(struct render_device *device, enum stage stage);
void context_span_end(struct render_device *device);
/* Collect all spans, waiting for the device; or those that the device has finished, without waiting. */
void context_collect(struct render_device *device);
void context_collect_done(struct render_device *device);
/* Empties the scratch memory for spans of this frame and returns it. */
struct stage_times *context_scratch_times(struct render_device *device);
/* Adds spans of this frame that its timer did not measure. */
void context_add_times(struct render_device *device, const struct stage_times *spans);
/* Adds the host's work for a stage from start_ns to now. */
void context_add_cpu_time(struct render_device *device, enum stage stage, uint64_t start_ns);
/* A compute program of shaders/, in use; without defines, or with defines that end with {0}. */
const struct gpu_program *context_use(struct render_device *device, const char *compute, struct error *error);
const struct gpu_program *context_use_with(struct render_device *device, const char *compute,
                                           const struct gpu_define *defines, struct error *error);

#endif
