/* SPDX-License-Identifier: MIT */
/* The tracers that one owner keeps, each with the changes of the scene that it has not received. */
#ifndef FARLIGHT_RENDER_FRAME_TRACER_SET_H
#define FARLIGHT_RENDER_FRAME_TRACER_SET_H

#include "trace/tracer.h"

/* When each kind of change last happened to a scene's copy on the device. It determines the changes that a
 * tracer still has to receive, whatever its owner and however long it was not in use. */
struct change_history {
    uint64_t update_count;               /* number of updates with a change */
    uint64_t last[sizeof(unsigned) * 8]; /* number of the last update with each bit of enum scene_change */
};
void change_history_note(struct change_history *history, unsigned changed);

#define TRACERS_KEPT 4 /* where no frame uses a tracer, the one that was used longest ago is replaced */

/* A scene's tracers, or those of one view (frame/state.h). Zero, but for the history, is an empty set. */
struct tracer_set {
    const struct change_history *history; /* the scene's; outlives the set */
    struct tracer_slot {
        struct tracer *tracer; /* NULL: free */
        const struct tracer_impl *impl;
        struct tracer_options options;
        uint64_t told;          /* updates in the history before its last update */
        struct trace_view view; /* the view of its last update; zero: there was none, or no view */
        uint64_t last_use;
        uint32_t users; /* frames in progress */
    } slots[TRACERS_KEPT];
    uint64_t use_count;
};

/* Whether tracers of these sorts can all be taken now without a change to those in use: a frame that takes
 * one that is being updated waits for it with the others, and does steps of the update. */
bool tracer_set_are_free(const struct tracer_set *set, const struct tracer_impl *const impls[], size_t count,
                         const struct tracer_options *options);
/* The tracer of that sort and options, made if need be. It is held until it is given back as often as it was
 * taken, and once it was brought to the scene, it stays as it is. */
struct tracer *tracer_set_take(struct tracer_set *set, struct gpu_device *device, const struct tracer_impl *impl,
                               const struct tracer_options *options, struct error *error);
/* Takes one that is taken already for a second purpose, whether or not it was brought to the scene yet. */
struct tracer *tracer_set_take_again(struct tracer_set *set, struct tracer *tracer);
/* Does a step of updating a taken tracer to the scene and the view (tracer_update_step). The set knows the
 * changes; update->changed is ignored. A tracer that does not depend on them is left alone. */
enum tracer_progress tracer_set_bring(struct tracer_set *set, const struct tracer *tracer, struct gpu_scene *scene,
                                      const struct tracer_update *update, uint64_t step_ns, struct error *error);
/* Accepts NULL. An update that no frame waits for any longer is abandoned. */
void tracer_set_give(struct tracer_set *set, const struct tracer *tracer);
uint64_t tracer_set_device_bytes(const struct tracer_set *set);
void tracer_set_finish(struct tracer_set *set);

#endif
