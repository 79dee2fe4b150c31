/* SPDX-License-Identifier: MIT */
/* The rays of pinhole eyes near the view's own (shaders/quadtree/eyes.comp). Neither rays nor hits go through
 * buffers, which takes a quarter of the time. */
#ifndef FARLIGHT_TRACE_QUADTREE_EYES_H
#define FARLIGHT_TRACE_QUADTREE_EYES_H

#include "shared/frame.h"
#include "trace/quadtree/trace.h"

/* Implements tracer_impl.finds_eyes. */
bool quadtree_finds_eyes(const struct quadtree_store *store, const struct gpu_scene *scene,
                         const struct frame_uniforms *frame, const struct tracer_options *options);
/* Implements tracer_impl.eye_hits. */
bool quadtree_eye_hits(struct quadtree_store *store, struct quadtree_state *state, const struct eye_rays *rays,
                       struct error *error);

#endif
