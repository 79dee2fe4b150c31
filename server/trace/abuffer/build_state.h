/* SPDX-License-Identifier: MIT */
/* State of builders and of one build. Private to build*.c. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_STATE_H

#include "abuffer/layout.h"
#include "trace/abuffer/build.h"
#include "trace/raster/draw.h"

/* The stages of a build in order, each cut into ranges of equal items. */
enum abuffer_stage {
    ABUFFER_CLEAR,    /* chunks of buffers */
    ABUFFER_DRAW,     /* primitives */
    ABUFFER_OCCUPIED, /* groups of texels; the pass begins again where the lists had too little memory */
    ABUFFER_RESOLVE,  /* texels with lists; the next three stages handle the longer ones */
    ABUFFER_UP_TO_EIGHT,
    ABUFFER_BEYOND_EIGHT,
    ABUFFER_DEEP,
    ABUFFER_VOXELS_JUDGE, /* blocks of voxels, as in the next three */
    ABUFFER_VOXELS_REACH_X,
    ABUFFER_VOXELS_REACH_Y,
    ABUFFER_VOXELS_REACH_Z,
    ABUFFER_STAGES
};

struct abuffer_builder;
struct abuffer_deep; /* build_deep.c */

/* State of one build. The caller owns the objects that it works with. */
struct abuffer_task {
    struct abuffer_builder *builder;
    struct abuffer_store *store; /* NULL: no build is in progress */
    struct gpu_scene *scene;
    const struct tracer_options *options;
    uint32_t texel_count;     /* includes the texels that pad tiles */
    uint32_t nodes_before;    /* fragments counted by a pass whose lists did not fit */
    enum abuffer_stage stage; /* ABUFFER_STAGES: the build is complete */
    bool stage_begun;
    uint32_t next_item, end_item; /* remaining items of the stage */
    /* A large primitive is drawn in `band_count` bands of rows, one after the other; 0: no primitive is being
     * drawn so. */
    uint32_t band, band_count;
    struct abuffer_build_counts counts; /* last values read back */
    struct abuffer_deep *deep;
};

struct abuffer_builder {
    struct gpu_device *device;
    struct axes_draw draw;
    struct gpu_buffer heads, nodes, occupied, longer, deep, build; /* abuffer/layout.h */
    uint32_t nodes_max;                                            /* capacity of `nodes` */
    uint32_t passes;                                               /* passes over the scene in the last build */
    uint32_t unit_items[ABUFFER_STAGES];                           /* items per unit; 0: unknown yet */
    struct abuffer_task task;
};

#define ABUFFER_TEXEL_BYTES 8
#define ABUFFER_SAMPLE_BYTES 8
#define ABUFFER_ID_BYTES 4
#define ABUFFER_NODE_BYTES 16
#define ABUFFER_SUM_BYTES 16
#define ABUFFER_SUBVOXELS_BYTES (8 * ABUFFER_SUBVOXELS_TEXELS) /* per voxel */

/* Functions of a stage. begin counts its items and reserves its output; run does some items, after it has
 * made all its bindings; end reads their results. */
typedef bool abuffer_stage_begin(struct abuffer_task *task, uint32_t *items, struct error *error);
typedef bool abuffer_stage_run(struct abuffer_task *task, uint32_t first, uint32_t end, struct error *error);
/* Returns how many of the next items make a unit no longer than others, at least one. */
typedef uint32_t abuffer_stage_fit(struct abuffer_task *task, uint32_t first, uint32_t items);
typedef bool abuffer_stage_end(struct abuffer_task *task, struct error *error);

/* build_lists.c: draws the scene into `heads`, `nodes` and the store's sums, and lists the texels that have
 * fragments. */
abuffer_stage_begin abuffer_clear_begin, abuffer_draw_begin, abuffer_occupied_begin;
abuffer_stage_run abuffer_clear_run, abuffer_draw_run, abuffer_occupied_run;
abuffer_stage_fit abuffer_draw_fit;
abuffer_stage_end abuffer_occupied_end;
/* build_lists.c: whether the options allow this number of texels, empty ones included. */
bool abuffer_texels_allowed(const struct abuffer_task *task, struct error *error);
/* build_lists.c: reserves lists for a first pass. */
bool abuffer_lists_reserve(struct abuffer_task *task, struct error *error);
/* build_runs.c: turns lists into the store's texels, samples and ids. */
abuffer_stage_begin abuffer_resolve_begin, abuffer_up_to_eight_begin, abuffer_beyond_eight_begin;
abuffer_stage_run abuffer_resolve_run, abuffer_up_to_eight_run, abuffer_beyond_eight_run;
abuffer_stage_end abuffer_resolve_end;
/* build_deep.c: sorts lists that are too long for the passes on the device. */
abuffer_stage_begin abuffer_deep_begin;
abuffer_stage_run abuffer_deep_run;
void abuffer_deep_end(struct abuffer_task *task); /* allowed before it has begun */

/* build.c: reads task->counts back. */
void abuffer_read_counts(struct abuffer_task *task);

#endif
