/* SPDX-License-Identifier: MIT */
/* Light transport: from a wave's hits to radiance and the next wave. One interface, one file per transport. */
#ifndef FARLIGHT_RENDER_INTEGRATORS_INTEGRATOR_H
#define FARLIGHT_RENDER_INTEGRATORS_INTEGRATOR_H

#include "render/context.h"

enum integrator_progress {
    INTEGRATOR_FAILED,
    INTEGRATOR_AGAIN,    /* the wave in hand needs more of it: call again */
    INTEGRATOR_MORE,     /* the context holds the next wave's rays and paths, not yet traced */
    INTEGRATOR_DONE,     /* no ray is left */
    INTEGRATOR_OVERFLOW, /* the next wave is larger than its capacity: the slice must be done again, in parts */
};

struct integrator {
    const struct integrator_impl *impl;
    struct gpu_device *device;
};

struct integrator_impl {
    const char *name;
    struct integrator *(*create)(struct gpu_device *device, struct error *error);
    void (*destroy)(struct integrator *integrator);
    /* Makes the buffers fit context->wave_capacity; at the start of a frame and when the capacity grows. */
    bool (*reserve)(struct integrator *integrator, struct render_context *context, struct error *error);
    uint64_t (*device_bytes)(const struct integrator *integrator);
    /* Shades the wave whose hits the context holds and adds it to slice_sums. Shadow rays that it needs it has
     * traced itself; their number goes to context->shadow_rays. A call is short, and what is left waits for the
     * next one (wave_passes.h). */
    enum integrator_progress (*shade)(struct integrator *integrator, struct render_context *context,
                                      struct error *error);
};

extern const struct integrator_impl integrator_whitted_impl, integrator_distributed_impl, integrator_raycast_impl,
    integrator_ao_impl, integrator_path_impl;

/* By frame_request's number; NULL: there is none. */
const struct integrator_impl *integrator_impl_by_number(unsigned number);

#endif
