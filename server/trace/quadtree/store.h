/* SPDX-License-Identifier: MIT */
/* The structure on the device: shaders/quadtree/layout.h says what is in it. GL thread. */
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

/* All-zero, but for the device, is empty. */
struct quadtree_store {
    struct gpu_device *device;
    bool only_leaves; /* no nodes above them: for those who look at layers, and trace no rays */
    struct quadtree_uniforms uniforms;
    struct gpu_buffer uniform_buffer;
    struct gpu_texture visible; /* GL_RG32UI array: a layer a slice, padded size */
    struct gpu_buffer nodes;
    struct quadtree_runs runs; /* of the scene that it was placed for */
};

/* How many are asked for. */
uint32_t quadtree_layer_count(const struct quadtree_settings *settings);
bool quadtree_hits_planes(const struct quadtree_settings *settings);
void quadtree_store_finish(struct quadtree_store *store); /* leaves it empty */
uint64_t quadtree_store_bytes(const struct quadtree_store *store);
/* The view whose pixels are the texels of a view's face: `view` with its margin, at the resolution that is asked
 * for. The same eye and direction; larger, and with a wider angle. */
void quadtree_texel_view(struct trace_view *texels, const struct trace_view *view,
                         const struct quadtree_settings *settings);
/* Where the faces of such a view lie, and how large they are: fills store->uniforms, uploads them, and makes room
 * for the slices, with store->only_leaves as it is. */
bool quadtree_store_place(struct quadtree_store *store, const struct gpu_scene *scene,
                          const struct trace_view *view, const struct quadtree_settings *settings,
                          struct error *error);
/* Binds uniforms, `visible` and `nodes` at their places. */
void quadtree_store_bind(struct quadtree_store *store);

#endif
