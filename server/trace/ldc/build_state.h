/* SPDX-License-Identifier: MIT */
/* private to build*.c: what they keep between builds, and what one build is about. */
#ifndef FARLIGHT_TRACE_LDC_BUILD_STATE_H
#define FARLIGHT_TRACE_LDC_BUILD_STATE_H

#include "gpu/program.h"
#include "gpu/texture.h"
#include "ldc/layout.h"
#include "trace/raster/draw.h"
#include "trace/ldc/build.h"

struct ldc_task;
/* Does a unit of a build and says in task->next what comes after it. Binds all that it needs but the scene's
 * buffers: others may have been at work since the unit before. */
typedef bool ldc_unit(struct ldc_task *task, struct error *error);

/* One build. */
struct ldc_task {
    struct ldc_builder *builder;
    struct ldc_store *store;
    struct ldc_cube *cube;
    struct gpu_scene *scene;
    const struct tracer_options *options;
    ldc_unit *next; /* NULL: it is done */
    bool at_once;   /* a pass over the scene is one unit, however long it takes */
    uint32_t drawn; /* of the listed primitives, by the pass in hand */
    uint32_t texel_count;
    uint32_t layers_max;
    bool drawn_again;               /* lists: with room for all */
    bool peeled;                    /* `ordered` is sorted, and `found` says how many each texel has */
    uint32_t layer, layers;         /* peeling: the one in hand, and how many there will be */
    uint32_t slots;                 /* in `ordered` */
    struct ldc_build_counts counts; /* as last read back */
};

struct ldc_builder {
    struct gpu_device *device;
    struct ldc_task task;
    struct axes_draw draw;
    /* ldc/layout.h */
    struct gpu_buffer counts, occupied, ordered, places, fragments, found, build, histogram;
    struct gpu_buffer peeled;
    /* Peeling: geometry of the layer that is drawn and of the one before it, by turns. */
    struct gpu_texture layers[2], layer_surface, depth;
    struct gpu_framebuffer layer_framebuffers[2];
    uint32_t slots;             /* of a texel: what the last build in one pass suggests */
    uint32_t slots_texels;      /* of how many texels that was */
    uint32_t primitives_a_unit; /* to be drawn; 0: not known yet */
    uint32_t fragments_max;     /* for which there is room in `fragments` */
};

enum ldc_pass { LDC_PASS_LISTS, LDC_PASS_COUNT, LDC_PASS_PEEL };

/* build_draw.c. Draws some of what is listed, from task->drawn on, which is 0 as a pass begins; when all is drawn,
 * the unit after this one is `then`, else it is this one again. The framebuffer and the pass's own images are
 * bound already; `set` (may be NULL) sets its uniforms, and is given the task. */
bool ldc_draw(struct ldc_task *task, enum ldc_pass pass,
              void (*set)(const void *task, const struct gpu_program *program), ldc_unit *then,
              struct error *error);

/* build_lists.c. This unit and those after it leave the fragments in `ordered`, and what was counted in
 * task->counts, and go on to ldc_pack; or to ldc_peel, where there are more than lists can hold. */
bool ldc_lists(struct ldc_task *task, struct error *error);
/* build_peel.c. Likewise. */
bool ldc_peel(struct ldc_task *task, struct error *error);
/* From `counts`: what is occupied, where fragments without slots lie, sums; reads task->counts back. Of a texel no
 * more than `kept` fragments are in `ordered`. */
bool ldc_give_places(struct ldc_task *task, uint32_t kept, struct error *error);

/* build_limit.c. Lowers task->layers_max to what fits the options, the layout and the device, if task->counts do
 * not; counts.samples_max and .quads_max follow. Fails where not even one layer fits. */
bool ldc_limit(struct ldc_task *task, struct error *error);

/* build_pack.c. This unit and those after it: from `ordered` to the cube's buffers. */
bool ldc_pack(struct ldc_task *task, struct error *error);

/* What a program that has ldc/sample.glsl needs to know of the scene; ends with {0}. */
#define LDC_SAMPLE_DEFINES_MAX 5
void ldc_sample_defines(const struct ldc_task *task, struct gpu_define defines[LDC_SAMPLE_DEFINES_MAX]);

#define LDC_TEXEL_BYTES 16
#define LDC_QUAD_BYTES 16
#define LDC_GEOMETRY_BYTES 8
#define LDC_SURFACE_BYTES 16
#define LDC_PRIMITIVE_BYTES 8
#define LDC_PEELED_BYTES 32
#define LDC_ORDERED_BYTES 8

/* build.c. The compute program, without defines, is made current. */
const struct gpu_program *ldc_use(struct gpu_device *device, const char *path, struct error *error);
/* Binds what ldc/run.glsl reads, and sets its uniforms. */
void ldc_bind_runs(struct ldc_task *task, const struct gpu_program *program);
/* Reads task->counts back. */
void ldc_read_counts(struct ldc_task *task);

#endif
