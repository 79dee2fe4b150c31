/* SPDX-License-Identifier: MIT */
/* Quadtrees on the device; shaders/quadtree/layout.h describes their buffers. GL thread. */
#ifndef FARLIGHT_TRACE_QUADTREE_STORE_H
#define FARLIGHT_TRACE_QUADTREE_STORE_H

#include "base/error.h"
#include "gpu/buffer.h"
#include "gpu/device.h"
#include "gpu/texture.h"
#include "gpu_scene/scene.h"
#include "protocol/tracers.h"
#include "quadtree/layout.h"
#include "trace/quadtree/runs.h"
#include "trace/view.h"

#include <stdbool.h>
#include <stdint.h>

/* All-zero with a device is empty. */
struct quadtree_store {
    struct gpu_device *device;
    bool only_leaves; /* no nodes above the leaves: enough to read layers, not to trace rays */
    struct quadtree_uniforms uniforms;
    struct gpu_buffer uniform_buffer;
    struct gpu_texture visible; /* GL_RG32UI array, one layer per slice, padded size */
    struct gpu_buffer nodes;
    struct quadtree_runs runs; /* runs of the scene that the faces were placed for */
};

/* Number of layers that the settings ask for. */
uint32_t quadtree_layer_count(const struct quadtree_settings *settings);
bool quadtree_hits_planes(const struct quadtree_settings *settings);
void quadtree_store_finish(struct quadtree_store *store); /* leaves it empty */
uint64_t quadtree_store_bytes(const struct quadtree_store *store);
/* Gets the view whose pixels are the texels of a view's face: `view` with its margin at the requested
 * resolution. Eye and direction are the same; it is larger, with a wider angle. */
void quadtree_texel_view(struct trace_view *texels, const struct trace_view *view,
                         const struct quadtree_settings *settings);
/* Places the faces of a view: fills store->uniforms, uploads them, and reserves the slices, with
 * store->only_leaves as it is. */
bool quadtree_store_place(struct quadtree_store *store, const struct gpu_scene *scene,
                          const struct trace_view *view, const struct quadtree_settings *settings,
                          struct error *error);
/* Binds uniforms, `visible` and `nodes` at their binding points. */
void quadtree_store_bind(struct quadtree_store *store);

#endif
