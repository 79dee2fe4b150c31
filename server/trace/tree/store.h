/* SPDX-License-Identifier: MIT */
/* Trees on the device: one for each geometry, kept by (kind, id, revision), behind a space for the top tree. GL
 * thread. */
#ifndef FARLIGHT_TRACE_TREE_STORE_H
#define FARLIGHT_TRACE_TREE_STORE_H

#include "base/error.h"
#include "base/stage_times.h"
#include "gpu/buffer.h"
#include "gpu/device.h"
#include "trace/tree/build.h"
#include "trace/tree/build_top.h"
#include "trace/tree/refit.h"
#include "trace/step.h"
#include "gpu_scene/scene.h"

#include <stdbool.h>
#include <stdint.h>

/* A tree on the device. */
struct bvh_entry {
    bool is_mesh;
    uint32_t id;
    uint32_t node; /* gpu_scene_geometry.node */
    uint64_t revision;
    uint64_t deformed_revision; /* the vertices that it was built or refitted for */
    struct bvh_refit refit;
    float built_wear; /* wear at the build (bvh_tree.wear) */
    bool is_wanted;   /* the scene still has it, in this revision */
    uint32_t first_element, element_count;
    uint32_t first_texel, texel_count;
    float lower[3], upper[3]; /* object space, padded */
    struct bvh_grid grid;
    float grid_cost, leaf_extent; /* those of struct bvh_tree */
};

/* Trees being planned, then written: into the buffers themselves where the host shares their memory, otherwise
 * into arrays that are uploaded. */
struct bvh_store_build {
    struct bvh_job *jobs; /* owned; NULL: there are none */
    uint32_t *which;      /* owned; geometry of each job */
    uint32_t count;
    struct bvh_run *run;     /* NULL: it has ended */
    enum bvh_step step;      /* current step of the run */
    bool is_mapped;          /* both buffers are mapped for writing */
    uint64_t start_ns;       /* beginning of the run */
    uint32_t uploaded;       /* number of trees uploaded */
    uint64_t uploaded_bytes; /* bytes of the next tree's elements and primitives */
};

struct bvh_store {
    struct gpu_device *device;
    struct bvh_form settings;
    struct bvh_entry *entries; /* in the order of their places on the device */
    uint32_t entry_count;
    uint32_t *entry_of; /* entry of each geometry of the scene; BVH_NONE: without primitives */
    uint32_t geometry_count;
    bool deforms_in_shutter; /* some move while the shutter is open */
    uint32_t top_capacity;   /* room before the first entry, in elements of the entries' form */
    bool top_lost;           /* the top tree must be written again; its writer clears this */
    struct gpu_buffer elements, primitives;
    struct gpu_buffer boxes, roots; /* buffers of refits */
    struct bvh_store_build build;
};

struct bvh_store_report {
    uint64_t built_elements, refitted_elements, uploaded_bytes;
};

void bvh_store_init(struct bvh_store *store, struct gpu_device *device, const struct bvh_form *settings);
void bvh_store_finish(struct bvh_store *store);
/* Updates the trees of all geometries of the scene: begins to build new and changed ones, then continues in
 * steps that end at about step_end_ns. The scene's arrays must not change meanwhile. Trees that are kept are
 * not uploaded again, though the device may move them. Trees of geometries whose vertices have moved are
 * refitted on the device, and rebuilt from the current vertices where refits have worn one beyond
 * BVH_REFIT_WEAR_MAX; their leaf_extent and grid_cost stay those of the mesh at rest, so that choices by them
 * do not depend on earlier poses. `all`: ignore deformed_revision and refit all. After a failure the store is
 * empty. */
bool bvh_store_begin(struct bvh_store *store, const struct gpu_scene *scene, bool all, struct error *error);
enum tracer_progress bvh_store_step(struct bvh_store *store, struct gpu_scene *scene, uint64_t step_end_ns,
                                    struct bvh_store_report *report, struct stage_times *times,
                                    struct error *error);
/* Whether the next step would only wait for the builder's threads. */
bool bvh_store_waits(struct bvh_store *store);
/* Second half of the update: refits or rebuilds trees of geometries whose vertices have changed since. */
bool bvh_store_deform(struct bvh_store *store, struct gpu_scene *scene, struct bvh_store_report *report,
                      struct stage_times *times, struct error *error);
/* Rebuilds trees over the shapes of jobs[i] for the geometries which[i], in place of their present ones, all at
 * once. The store owns both arrays from here on, in any case. */
bool bvh_store_rebuild(struct bvh_store *store, const struct gpu_scene *scene, struct bvh_job *jobs,
                       uint32_t *which, uint32_t count, struct bvh_store_report *report, struct stage_times *times,
                       struct error *error);
/* Reserves a top tree of `element_count` elements of the top tree's form. */
bool bvh_store_reserve_top(struct bvh_store *store, uint32_t element_count, struct error *error);
/* Writes elements of the top tree: all, or those marked in `moved`. Returns the bytes written. */
uint64_t bvh_store_write_top(struct bvh_store *store, const struct bvh_top *top, bool all);
/* The tree of a geometry, NULL if it has no primitives. */
const struct bvh_entry *bvh_store_entry(const struct bvh_store *store, uint32_t geometry);
uint64_t bvh_store_bytes(const struct bvh_store *store);

#endif
