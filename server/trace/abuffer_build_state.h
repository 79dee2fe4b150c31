/* SPDX-License-Identifier: MIT */
/* Private to abuffer_build*.c: what they keep between builds, and what one build is about. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H

#include "shared/abuffer_build.h"
#include "trace/abuffer_build.h"
#include "trace/axes_draw.h"

struct abuffer_builder {
    struct gpu_device *device;
    struct axes_draw draw;
    struct gpu_buffer heads, nodes, occupied, longer, deep, build; /* shared/abuffer_build.h */
    uint32_t nodes_max;                                            /* for which there is room in `nodes` */
    uint32_t nodes_first; /* so many at first; 0: chosen from the number of texels */
    uint32_t passes;      /* over the scene, of the last build */
};

/* One call of abuffer_build(). */
struct abuffer_task {
    struct abuffer_builder *builder;
    struct abuffer_store *store;
    struct scene_gpu *scene;
    const struct tracer_options *options;
    uint32_t texel_count;               /* with what pads tiles */
    struct abuffer_build_counts counts; /* as last read back */
};

#define ABUFFER_TEXEL_BYTES 8
#define ABUFFER_SAMPLE_BYTES 8
#define ABUFFER_ID_BYTES 4
#define ABUFFER_NODE_BYTES 16
#define ABUFFER_SUM_BYTES 16
#define ABUFFER_SUBVOXELS_BYTES 24 /* a voxel */

/* abuffer_build_lists.c. Draws the scene into `heads`, `nodes` and the store's sums, and lists the texels that
 * have any. */
bool abuffer_lists(struct abuffer_task *task, struct error *error);
/* abuffer_build_lists.c. Whether the options allow as many texels, empty ones too. */
bool abuffer_texels_allowed(const struct abuffer_task *task, struct error *error);
/* abuffer_build_runs.c. From lists to the store's texels, samples and ids. */
bool abuffer_runs(struct abuffer_task *task, struct error *error);
/* abuffer_build_deep.c. Those of texels that have more than the device's passes sort. */
bool abuffer_runs_deep(struct abuffer_task *task, struct error *error);

/* abuffer_build.c. Reads task->counts back. */
void abuffer_read_counts(struct abuffer_task *task);

#endif
