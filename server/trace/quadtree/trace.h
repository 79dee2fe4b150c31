/* SPDX-License-Identifier: MIT */
/* Waves through the quadtrees (shaders/quadtree/traverse.glsl), and counts of how their rays ended. */
#ifndef FARLIGHT_TRACE_QUADTREE_TRACE_H
#define FARLIGHT_TRACE_QUADTREE_TRACE_H

#include "gpu/readback.h"
#include "trace/quadtree/store.h"
#include "trace/tracer.h"

struct quadtree_state {
    struct trace_state base;
    struct gpu_buffer counts; /* struct quadtree_counts for each kind of rays of the frame */
    struct gpu_readback copied_counts;
    struct gpu_buffer beams; /* where the rays of each tile begin (eyes.h) */
    uint64_t eye_samples;    /* samples of the frame that eyes.h has traced */
};

struct trace_state *quadtree_state_create(struct gpu_device *device, const struct tracer_options *options,
                                          struct error *error);
void quadtree_state_destroy(struct trace_state *state);
uint64_t quadtree_state_device_bytes(const struct trace_state *state);
bool quadtree_state_copy_counts(struct trace_state *state, struct error *error);
bool quadtree_state_report(struct trace_state *state, struct structure_rows *rows, struct error *error);

/* Prepares the counts before a wave, and clears them before the first wave of a frame. */
bool quadtree_trace_begin(struct trace_state *state, struct error *error);
/* Finds intersections with HIT_UNKNOWN and HIT_LAYER bits, or transmittances. An unknown shadow ray that ends
 * behind the first surface of the view counts as stopped. */
bool quadtree_intersect(struct quadtree_store *store, struct gpu_scene *scene, struct quadtree_state *state,
                        const struct ray_range *rays, const struct tracer_options *options, struct error *error);
/* Maximum of rounds of a ray: it passes a texel of each column and each row, and a node of each level for each. */
uint64_t quadtree_rounds_of_a_ray(const struct quadtree_store *store);
/* Implements tracer_impl.layer_hits. */
bool quadtree_layer_hits(struct quadtree_store *store, struct gpu_scene *scene, const struct ray_range *rays,
                         uint32_t layer, struct error *error);
/* Implements tracer_impl.announce. */
void quadtree_announce(struct gpu_scene *scene, const struct wave *wave, const struct tracer_options *options);

#endif
