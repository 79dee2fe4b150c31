/* SPDX-License-Identifier: MIT */
/* Waves through the quadtrees (shaders/quadtree/traverse.glsl), and what came of their rays. */
#ifndef FARLIGHT_TRACE_QUADTREE_TRACE_H
#define FARLIGHT_TRACE_QUADTREE_TRACE_H

#include "gpu/readback.h"
#include "trace/quadtree/store.h"
#include "trace/tracer.h"

struct quadtree_state {
    struct trace_state base;
    struct gpu_buffer counts; /* struct quadtree_counts for each kind of rays, of the frame */
    struct gpu_readback copied_counts;
    struct gpu_buffer beams; /* of eyes.h */
    uint64_t eye_samples;    /* that eyes.h was asked for, of the frame */
};

struct trace_state *quadtree_state_create(struct gpu_device *device, const struct tracer_options *options,
                                          struct error *error);
void quadtree_state_destroy(struct trace_state *state);
uint64_t quadtree_state_device_bytes(const struct trace_state *state);
bool quadtree_state_copy_counts(struct trace_state *state, struct error *error);
bool quadtree_state_tell(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* Before a wave: the counts are there, those of a frame's first wave zero. */
bool quadtree_trace_begin(struct trace_state *state, struct error *error);
/* Intersections with HIT_UNKNOWN and HIT_LAYER bits, or transmittances: of rays that are unknown those that end
 * behind what the view sees first are stopped. */
bool quadtree_intersect(struct quadtree_store *store, struct gpu_scene *scene, struct quadtree_state *state,
                        const struct ray_range *rays, const struct tracer_options *options, struct error *error);
/* A ray passes a texel of each column and each row, by a node of each level at most. */
uint64_t quadtree_rounds_of_a_ray(const struct quadtree_store *store);
/* As tracer_impl.layer_hits. */
bool quadtree_layer_hits(struct quadtree_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                         uint32_t layer, struct error *error);
/* As tracer_impl.announce. */
void quadtree_announce(struct gpu_scene *scene, const struct wave *wave, const struct tracer_options *options);

#endif
