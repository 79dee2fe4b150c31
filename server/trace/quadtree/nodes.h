/* SPDX-License-Identifier: MIT */
/* Builds the nodes of the quadtrees from rasterised surfaces (sections 3.2 and 3.3 of the paper). It reads
 * `visible` and the uniforms of a store and writes its nodes, in units: the leaves and level 1 of each slice, then
 * each level above of all slices. GL thread.
 *
 * On software GL a texel takes 27 ns of a core for its leaf, 62 where the scene has spheres and discs as well,
 * since all branches are executed, and 15 for the levels above. */
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
    uint32_t stage;                   /* stage of the next unit */
    uint64_t first;                   /* first node of the next unit in its stage */
};

/* Number of nodes of all slices. */
uint64_t quadtree_nodes_count(const struct quadtree_uniforms *uniforms);
/* Reserves store->nodes and what the build needs, before the first unit. */
bool quadtree_nodes_begin(struct quadtree_node_build *build, struct quadtree_store *store, struct error *error);
/* Runs a unit; queues its work. */
enum tracer_progress quadtree_nodes_step(struct quadtree_node_build *build, struct quadtree_store *store,
                                         struct gpu_scene *scene, struct error *error);
void quadtree_nodes_finish(struct quadtree_node_build *build, struct gpu_device *device); /* leaves it empty */
uint64_t quadtree_nodes_bytes(const struct quadtree_node_build *build);

#endif
