/* SPDX-License-Identifier: MIT */
/* private to build*.c: what they keep between builds, and what one build is about. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H

#include "abuffer/layout.h"
#include "trace/abuffer/build.h"
#include "trace/raster/draw.h"

/* The stages of a build in order, each cut into ranges of equal items. */
enum abuffer_stage {
    ABUFFER_CLEAR,    /* chunks of buffers */
    ABUFFER_DRAW,     /* primitives */
    ABUFFER_OCCUPIED, /* groups of texels; where there was no room for the lists, it begins again */
    ABUFFER_RESOLVE,  /* texels with lists, of which longer ones are left to the next three */
    ABUFFER_UP_TO_EIGHT,
    ABUFFER_BEYOND_EIGHT,
    ABUFFER_DEEP,
    ABUFFER_VOXELS_JUDGE, /* blocks of voxels, as in the three that follow */
    ABUFFER_VOXELS_REACH_X,
    ABUFFER_VOXELS_REACH_Y,
    ABUFFER_VOXELS_REACH_Z,
    ABUFFER_STAGES
};

struct abuffer_builder;
struct abuffer_deep; /* build_deep.c */

/* A build that has begun; what it works with is the caller's. */
struct abuffer_task {
    struct abuffer_builder *builder;
    struct abuffer_store *store; /* NULL: none has begun */
    struct gpu_scene *scene;
    const struct tracer_options *options;
    uint32_t texel_count;     /* with what pads tiles */
    uint32_t nodes_before;    /* counted where there was no room for them */
    enum abuffer_stage stage; /* ABUFFER_STAGES: all is done */
    bool stage_begun;
    uint32_t next_item, end_item; /* of the stage */
    /* A primitive that covers much is drawn to so many bands of rows, one after the other; 0: there is none. */
    uint32_t band, band_count;
    struct abuffer_build_counts counts; /* as last read back */
    struct abuffer_deep *deep;
};

struct abuffer_builder {
    struct gpu_device *device;
    struct axes_draw draw;
    struct gpu_buffer heads, nodes, occupied, longer, deep, build; /* abuffer/layout.h */
    uint32_t nodes_max;                                            /* for which there is room in `nodes` */
    uint32_t passes;                                               /* over the scene, of the last build */
    uint32_t unit_items[ABUFFER_STAGES];                           /* that are done together; 0: not known yet */
    struct abuffer_task task;
};

#define ABUFFER_TEXEL_BYTES 8
#define ABUFFER_SAMPLE_BYTES 8
#define ABUFFER_ID_BYTES 4
#define ABUFFER_NODE_BYTES 16
#define ABUFFER_SUM_BYTES 16
#define ABUFFER_SUBVOXELS_BYTES (8 * ABUFFER_SUBVOXELS_TEXELS) /* a voxel */

/* Of a stage: says how many items it has, with room for what it leaves; does some of them, from all bindings on;
 * looks at what there is when all are done. */
typedef bool abuffer_stage_begin(struct abuffer_task *task, uint32_t *items, struct error *error);
typedef bool abuffer_stage_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error);
/* How many of the next items make a unit that is no longer than others, at least one. */
typedef uint32_t abuffer_stage_fit(struct abuffer_task *task, uint32_t first, uint32_t items);
typedef bool abuffer_stage_end(struct abuffer_task *task, struct error *error);

/* build_lists.c. Draws the scene into `heads`, `nodes` and the store's sums, and lists the texels that have
 * any. */
abuffer_stage_begin abuffer_clear_begin, abuffer_draw_begin, abuffer_occupied_begin;
abuffer_stage_run abuffer_clear_run, abuffer_draw_run, abuffer_occupied_run;
abuffer_stage_fit abuffer_draw_fit;
abuffer_stage_end abuffer_occupied_end;
/* build_lists.c. Whether the options allow as many texels, empty ones too. */
bool abuffer_texels_allowed(const struct abuffer_task *task, struct error *error);
/* build_lists.c. Room for the lists of a first pass. */
bool abuffer_lists_reserve(struct abuffer_task *task, struct error *error);
/* build_runs.c. From lists to the store's texels, samples and ids. */
abuffer_stage_begin abuffer_resolve_begin, abuffer_up_to_eight_begin, abuffer_beyond_eight_begin;
abuffer_stage_run abuffer_resolve_run, abuffer_up_to_eight_run, abuffer_beyond_eight_run;
abuffer_stage_end abuffer_resolve_end;
/* build_deep.c. Those of texels that have more than the device's passes sort. */
abuffer_stage_begin abuffer_deep_begin;
abuffer_stage_run abuffer_deep_run;
void abuffer_deep_end(struct abuffer_task *task); /* also where it has not begun */

/* build.c. Reads task->counts back. */
void abuffer_read_counts(struct abuffer_task *task);

#endif
