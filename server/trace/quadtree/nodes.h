/* SPDX-License-Identifier: MIT */
/* From what the rasteriser saw to the nodes of the quadtrees (sections 3.2 and 3.3 of the paper). It reads
 * `visible` and the uniforms of a store and writes its nodes, in units: of each slice its leaves, then level 1,
 * then each level above it of all slices. GL thread.
 *
 * On software GL leaves take 27 ns of a core a texel, 62 where the scene has spheres and discs as well, since all
 * branches are taken; the levels above them take 15. */
#ifndef FARLIGHT_TRACE_QUADTREE_NODES_H
#define FARLIGHT_TRACE_QUADTREE_NODES_H

#include "base/error.h"
#include "gpu/buffer.h"
#include "gpu_scene/scene.h"
#include "trace/quadtree/store.h"
#include "trace/step.h"

#include <stdbool.h>
#include <stdint.h>

/* All-zero: nothing is reserved. The buffers stay from build to build. */
struct quadtree_node_build {
    struct gpu_buffer planes, errors; /* quadtree/layout.h */
    uint32_t stage;                   /* what the next unit is of */
    uint64_t first;                   /* its first node there */
};

/* The nodes of all slices of a store. */
uint64_t quadtree_nodes_count(const struct quadtree_uniforms *uniforms);
/* Reserves store->nodes and what the build needs, before the first unit. */
bool quadtree_nodes_begin(struct quadtree_node_build *build, struct quadtree_store *store, struct error *error);
/* A unit; queues the work. */
enum tracer_progress quadtree_nodes_go_on(struct quadtree_node_build *build, struct quadtree_store *store,
                                          struct gpu_scene *scene, struct error *error);
void quadtree_nodes_finish(struct quadtree_node_build *build, struct gpu_device *device); /* leaves it empty */
uint64_t quadtree_nodes_bytes(const struct quadtree_node_build *build);

#endif
