/* SPDX-License-Identifier: MIT */
/* Boxes round runs of a mesh's triangles, or of a set's spheres: what lies beside a face need not be drawn into
 * it, and drawing is most of the time that it takes to build the structure of a large model. */
#ifndef FARLIGHT_TRACE_QUADTREE_RUNS_H
#define FARLIGHT_TRACE_QUADTREE_RUNS_H

#include "base/error.h"
#include "gpu_scene/scene.h"
#include "trace/raster/view.h"

#include <stdbool.h>
#include <stdint.h>

/* Primitives of a run. Each draw costs something of its own: about as much as some ten of them. */
#define QUADTREE_RUN 512u

struct quadtree_run_box {
    float lower[3], upper[3]; /* object space */
};

struct quadtree_run_owner {
    uint32_t id, node, count; /* of the geometry: its primitives */
    uint64_t revision;
    size_t first; /* of its boxes */
    bool is_mesh;
};

/* Of all geometries of a scene, by their numbers. All-zero is empty. */
struct quadtree_runs {
    struct quadtree_run_box *boxes;
    struct quadtree_run_owner *owners;
    uint32_t owner_count;
};

/* For the scene as it is now. Finds the boxes again where it shows other geometries. */
bool quadtree_runs_update(struct quadtree_runs *runs, const struct gpu_scene *scene, struct error *error);
void quadtree_runs_finish(struct quadtree_runs *runs); /* leaves it empty */
/* The runs of an instance: one, of which no box is known, if it deforms or there are no boxes at all. */
uint32_t quadtree_runs_of(const struct quadtree_runs *runs, const struct gpu_scene *scene, uint32_t instance);
struct raster_span quadtree_run_span(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                     uint32_t instance, uint32_t run);
/* NULL: it is not known. */
const struct quadtree_run_box *quadtree_run_box(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                                uint32_t instance, uint32_t run);

#endif
