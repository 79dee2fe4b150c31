/* SPDX-License-Identifier: MIT */
/* The tracers that were asked for on one scene, each with what it has not yet been told about it. */
#ifndef FARLIGHT_RENDER_TRACER_SET_H
#define FARLIGHT_RENDER_TRACER_SET_H

#include "trace/tracer.h"

#define TRACERS_KEPT 4 /* the one that was used longest ago makes room */

struct tracer_set {
    struct tracer_slot {
        struct tracer *tracer; /* NULL: free */
        const struct tracer_impl *impl;
        struct tracer_options options;
        struct scene_changes pending; /* since its last update */
        uint64_t last_use;
    } slots[TRACERS_KEPT];
    uint64_t use_count;
};

/* The scene's copy has changed, or (NULL) must be taken to be new. */
void tracer_set_note(struct tracer_set *set, const struct scene_changes *changes);
/* The tracer of that sort and options, made if need be and brought to the scene. */
struct tracer *tracer_set_get(struct tracer_set *set, struct scene_gpu *scene, const struct tracer_impl *impl,
                              const struct tracer_options *options, struct stage_times *times,
                              struct error *error);
uint64_t tracer_set_device_bytes(const struct tracer_set *set);
void tracer_set_finish(struct tracer_set *set);

#endif
