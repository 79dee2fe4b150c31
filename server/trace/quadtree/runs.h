/* SPDX-License-Identifier: MIT */
/* Boxes round runs of a mesh's triangles, or of a set's spheres. A run outside of a face need not be drawn into
 * it, and drawing takes most of the time of a build over a large model. */
#ifndef FARLIGHT_TRACE_QUADTREE_RUNS_H
#define FARLIGHT_TRACE_QUADTREE_RUNS_H

#include "base/error.h"
#include "gpu_scene/scene.h"
#include "trace/raster/view.h"

#include <stdbool.h>
#include <stdint.h>

/* Primitives per run. A draw call costs about as much as ten of them. */
#define QUADTREE_RUN 512u

struct quadtree_run_box {
    float lower[3], upper[3]; /* object space */
};

struct quadtree_run_owner {
    uint32_t id, node, count; /* the geometry's identity, and its number of primitives */
    uint64_t revision;
    size_t first; /* index of its first box */
    bool is_mesh;
};

/* Runs of all geometries of a scene, by geometry number. All-zero is empty. */
struct quadtree_runs {
    struct quadtree_run_box *boxes;
    struct quadtree_run_owner *owners;
    uint32_t owner_count;
};

/* Brings the runs to the scene. Finds boxes again where the scene has other geometries. */
bool quadtree_runs_update(struct quadtree_runs *runs, const struct gpu_scene *scene, struct error *error);
void quadtree_runs_finish(struct quadtree_runs *runs); /* leaves it empty */
/* Number of runs of an instance: one, without a known box, if it deforms or there are no boxes. */
uint32_t quadtree_runs_of(const struct quadtree_runs *runs, const struct gpu_scene *scene, uint32_t instance);
struct raster_span quadtree_run_span(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                     uint32_t instance, uint32_t run);
/* The box of a run; NULL: unknown. */
const struct quadtree_run_box *quadtree_run_box(const struct quadtree_runs *runs, const struct gpu_scene *scene,
                                                uint32_t instance, uint32_t run);

#endif
