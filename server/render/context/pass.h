/* SPDX-License-Identifier: MIT */
/* A pass of a frame, or of a slice of its samples: four functions. frame/passes.c lists the passes in order.
 * `self` is a pass's state: part of a frame's work, or the renderer. */
#ifndef FARLIGHT_RENDER_CONTEXT_PASS_H
#define FARLIGHT_RENDER_CONTEXT_PASS_H

#include "render/context/wave.h"

enum pass_progress {
    PASS_FAILED,
    PASS_MORE, /* the pass is not finished: run it again */
    PASS_DONE, /* the next pass may run */
    /* A slice that does not fit its buffers is repeated, before any of it has reached the picture; a frame
     * goes back to its builds, for the next of its pictures. */
    PASS_REPEAT,
};

struct pass {
    const char *name;
    /* Whether the pass has work on the wave that the passes before it have left. NULL: it always has. */
    bool (*wants)(const void *self, const struct render_wave *wave);
    /* Reserves buffers for slices of that many samples and waves of wave->capacity rays, or releases those
     * that the frame does not need; may be postponed (gpu_reserve_begin). NULL: the pass needs none. */
    bool (*reserve)(void *self, struct render_wave *wave, uint32_t slice_samples, struct error *error);
    /* Does a step of a few milliseconds. Inside no span. */
    enum pass_progress (*run)(void *self, struct render_wave *wave, struct error *error);
    /* Releases the state's memory on the device and leaves it empty. NULL: it has none. */
    void (*finish)(void *self, struct gpu_device *device);
};

#endif
