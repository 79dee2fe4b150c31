/* SPDX-License-Identifier: MIT */
/* State of builders and of one build. Private to build*.c. */
#ifndef FARLIGHT_TRACE_LDC_BUILD_STATE_H
#define FARLIGHT_TRACE_LDC_BUILD_STATE_H

#include "gpu/program.h"
#include "gpu/texture.h"
#include "ldc/layout.h"
#include "trace/raster/draw.h"
#include "trace/ldc/build.h"

struct ldc_task;
/* Runs a unit of a build and sets task->next to the one after it. Makes all its bindings except the scene's:
 * other work may have come between two units. */
typedef bool ldc_unit(struct ldc_task *task, struct error *error);

/* State of one build. */
struct ldc_task {
    struct ldc_builder *builder;
    struct ldc_store *store;
    struct ldc_cube *cube;
    struct gpu_scene *scene;
    const struct tracer_options *options;
    ldc_unit *next; /* NULL: the build is complete */
    bool at_once;   /* a pass over the scene is one unit, however long it takes */
    uint32_t drawn; /* listed primitives that the current pass has drawn */
    uint32_t texel_count;
    uint32_t layers_max;
    bool drawn_again;               /* lists: second pass, with memory for all */
    bool peeled;                    /* `ordered` is sorted, and `found` says how many each texel has */
    uint32_t layer, layers;         /* peeling: the current one, and their number */
    uint32_t slots;                 /* slots of a texel in `ordered` */
    struct ldc_build_counts counts; /* last values read back */
};

struct ldc_builder {
    struct gpu_device *device;
    struct ldc_task task;
    struct axes_draw draw;
    /* ldc/layout.h */
    struct gpu_buffer counts, occupied, ordered, places, fragments, found, build, histogram;
    struct gpu_buffer peeled;
    /* Geometry of the current layer and of the one before it, by turns, for peeling. */
    struct gpu_texture layers[2], layer_surface, depth;
    struct gpu_framebuffer layer_framebuffers[2];
    uint32_t slots;             /* slots of a texel that the last build in one pass suggests */
    uint32_t slots_texels;      /* number of texels of that build */
    uint32_t primitives_a_unit; /* primitives drawn by a unit; 0: unknown yet */
    uint32_t fragments_max;     /* capacity of `fragments` */
};

enum ldc_pass { LDC_PASS_LISTS, LDC_PASS_COUNT, LDC_PASS_PEEL };

/* build_draw.c: draws listed primitives from task->drawn on, which is 0 as a pass begins. The next unit is
 * `then` once all are drawn, otherwise this one again. The framebuffer and the pass's own images are bound
 * already; `set` (may be NULL) gets the task and sets its uniforms. */
bool ldc_draw(struct ldc_task *task, enum ldc_pass pass,
              void (*set)(const void *task, const struct gpu_program *program), ldc_unit *then,
              struct error *error);

/* build_lists.c: this unit and its successors leave the fragments in `ordered` and their counts in
 * task->counts, and end with ldc_pack; or with ldc_peel, where there are more than lists can hold. */
bool ldc_lists(struct ldc_task *task, struct error *error);
/* build_peel.c: the same result, by depth peeling. */
bool ldc_peel(struct ldc_task *task, struct error *error);
/* Derives from `counts` the occupied texels, the places of fragments without slots, and sums; reads
 * task->counts back. At most `kept` fragments of a texel are in `ordered`. */
bool ldc_give_places(struct ldc_task *task, uint32_t kept, struct error *error);

/* build_limit.c: lowers task->layers_max to what fits the options, the layout and the device;
 * counts.samples_max and .quads_max follow. Fails where not even one layer fits. */
bool ldc_limit(struct ldc_task *task, struct error *error);

/* build_pack.c: this unit and its successors copy `ordered` into the cube's buffers. */
bool ldc_pack(struct ldc_task *task, struct error *error);

/* Defines of a program that includes ldc/sample.glsl; they end with {0}. */
#define LDC_SAMPLE_DEFINES_MAX 5
void ldc_sample_defines(const struct ldc_task *task, struct gpu_define defines[LDC_SAMPLE_DEFINES_MAX]);

#define LDC_TEXEL_BYTES 16
#define LDC_QUAD_BYTES 16
#define LDC_GEOMETRY_BYTES 8
#define LDC_SURFACE_BYTES 16
#define LDC_PRIMITIVE_BYTES 8
#define LDC_PEELED_BYTES 32
#define LDC_ORDERED_BYTES 8

/* build.c: gets the compute program, without defines, and makes it current. */
const struct gpu_program *ldc_use(struct gpu_device *device, const char *path, struct error *error);
/* Binds what ldc/run.glsl reads, and sets its uniforms. */
void ldc_bind_runs(struct ldc_task *task, const struct gpu_program *program);
/* Reads task->counts back. */
void ldc_read_counts(struct ldc_task *task);

#endif
