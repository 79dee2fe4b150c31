/* SPDX-License-Identifier: MIT */
/* Draws the layers of a view's faces. GL thread. All layers of a face take one pass with a k-buffer, where the
 * device fetches_framebuffer; otherwise depth peeling draws each behind the one before. Both find the same
 * surfaces. Bavoil, Callahan, Lefohn, Comba, Silva. Multi-Fragment Effects on the GPU using the k-Buffer. 2007.
 * Everitt. Interactive Order-Independent Transparency. 2001. */
#ifndef FARLIGHT_TRACE_QUADTREE_LAYERS_H
#define FARLIGHT_TRACE_QUADTREE_LAYERS_H

#include "trace/quadtree/store.h"
#include "trace/raster/view.h"
#include "trace/step.h"

/* All-zero is empty. Buffers and measured costs stay from one view to the next. */
struct quadtree_layers {
    struct quadtree_store *store;
    uint32_t pass_layers;           /* layers that a pass draws: 1, or all of a face */
    struct frame_uniforms uniforms; /* uniforms of the current face */
    struct gpu_buffer frame;        /* buffer of these */
    struct gpu_texture depths[2];   /* the current layer and the one before it; in one pass, all layers in the
                                       first */
    struct gpu_framebuffer framebuffer;
    struct raster_span *spans; /* primitives that the face may see */
    uint32_t span_count, span_capacity;
    /* The next primitive to draw. */
    struct raster_view drawing;
    uint32_t face, layer;
    bool begun; /* the pass has cleared its layers and bound its framebuffer */
};

/* Begins to draw into store->visible, which is placed; the store must stay until the layers are complete or
 * finished. */
bool quadtree_layers_begin(struct quadtree_layers *layers, struct quadtree_store *store, struct error *error);
/* Draws the next parts until some milliseconds are over, or all with at_once. The scene must be the same each
 * time. */
enum tracer_progress quadtree_layers_step(struct quadtree_layers *layers, struct gpu_scene *scene, bool at_once,
                                          struct error *error);
void quadtree_layers_finish(struct quadtree_layers *layers); /* leaves it empty */
uint64_t quadtree_layers_bytes(const struct quadtree_layers *layers);

#endif
