/* SPDX-License-Identifier: MIT */
/* Draws the layers of a view's faces. GL thread. Either all of a face in one pass, by a k-buffer, where the device
 * fetches_framebuffer; or each behind the one before, by depth peeling. Both find the same surfaces.
 * Bavoil, Callahan, Lefohn, Comba, Silva. Multi-Fragment Effects on the GPU using the k-Buffer. 2007.
 * Everitt. Interactive Order-Independent Transparency. 2001. */
#ifndef FARLIGHT_TRACE_QUADTREE_LAYERS_H
#define FARLIGHT_TRACE_QUADTREE_LAYERS_H

#include "trace/quadtree/store.h"
#include "trace/raster/view.h"
#include "trace/step.h"

/* All-zero is empty. Keeps its memory, and what it has learnt, from one view to the next. */
struct quadtree_layers {
    struct quadtree_store *store;
    uint32_t pass_layers;         /* that a pass draws: 1, or all of a face */
    struct gpu_buffer frame;      /* struct frame_uniforms of the face */
    struct gpu_texture depths[2]; /* of the layer that is drawn, and of the one before; or of all in the first */
    struct gpu_framebuffer framebuffer;
    struct raster_span *spans; /* of primitives that the face may see */
    uint32_t span_count, span_capacity;
    /* where drawing goes on */
    struct raster_view drawing;
    uint32_t face, layer;
    bool begun; /* the pass: its layers are cleared, and its framebuffer is there */
};

/* Into store->visible, which is placed; the store stays until the layers are done or finished. */
bool quadtree_layers_begin(struct quadtree_layers *layers, struct quadtree_store *store, struct error *error);
/* The next parts, until some milliseconds are over; the same scene each time. at_once: all that is left. */
enum tracer_progress quadtree_layers_go_on(struct quadtree_layers *layers, struct gpu_scene *scene, bool at_once,
                                           struct error *error);
void quadtree_layers_finish(struct quadtree_layers *layers); /* leaves it empty */
uint64_t quadtree_layers_bytes(const struct quadtree_layers *layers);

#endif
