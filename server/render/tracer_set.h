/* SPDX-License-Identifier: MIT */
/* The tracers that were asked for on one scene, each with what it has not yet been told about it. */
#ifndef FARLIGHT_RENDER_TRACER_SET_H
#define FARLIGHT_RENDER_TRACER_SET_H

#include "trace/tracer.h"

#define TRACERS_KEPT 4 /* of those that no frame uses the one that was used longest ago makes room */

struct tracer_set {
    struct tracer_slot {
        struct tracer *tracer; /* NULL: free */
        const struct tracer_impl *impl;
        struct tracer_options options;
        struct scene_changes pending; /* since its last update */
        uint64_t last_use;
        uint32_t users; /* frames in progress */
    } slots[TRACERS_KEPT];
    uint64_t use_count;
};

/* The scene's copy has changed, or (NULL) must be taken to be new. */
void tracer_set_note(struct tracer_set *set, const struct scene_changes *changes);
/* Whether tracers of these sorts can all be taken now, which leaves those alone that are taken already: who takes
 * one that is being brought to the scene waits for that with the others, and does steps of it. */
bool tracer_set_are_free(const struct tracer_set *set, const struct tracer_impl *const impls[], size_t count,
                         const struct tracer_options *options);
/* The tracer of that sort and options, made if need be. It stays the taker's until it is given back as often as it
 * was taken, and once it was brought to the scene, it stays as it is. */
struct tracer *tracer_set_take(struct tracer_set *set, struct gpu_device *device, const struct tracer_impl *impl,
                               const struct tracer_options *options, struct error *error);
/* One that is taken, for a second purpose of who took it, whether or not it was brought to the scene yet. */
struct tracer *tracer_set_take_again(struct tracer_set *set, struct tracer *tracer);
/* Brings one that is taken to the scene, a step at a time (tracer_update_step). `times`: what this step took.
 */
enum tracer_progress tracer_set_bring(struct tracer_set *set, const struct tracer *tracer, struct gpu_scene *scene,
                                      uint64_t step_ns, struct stage_times *times, struct error *error);
/* Accepts NULL. What nobody waits for any longer is not built to the end. */
void tracer_set_give(struct tracer_set *set, const struct tracer *tracer);
uint64_t tracer_set_device_bytes(const struct tracer_set *set);
void tracer_set_finish(struct tracer_set *set);

#endif
