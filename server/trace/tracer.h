/* SPDX-License-Identifier: MIT */
/* One interface for every acceleration structure. The wrappers below check, time and call. */
#ifndef FARLIGHT_TRACE_TRACER_H
#define FARLIGHT_TRACE_TRACER_H

#include "base/error.h"
#include "base/stage_times.h"
#include "gpu/device.h"
#include "trace/step.h"
#include "gpu_scene/scene.h"
#include "trace/wave.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum tracer_dependency { /* bits: what a structure is built from */
                         TRACER_NEEDS_SCENE = 1,
                         TRACER_NEEDS_VIEW = 2,
                         TRACER_NEEDS_RAYS = 4,
};

/* Options of all tracers; zero is the default of each. Compared byte by byte (render/tracer_set.c), so there is no
 * member that leaves a gap. */
struct tracer_options {
    enum { BVH_BOUNDS_AUTO, BVH_BOUNDS_BOX, BVH_BOUNDS_SPHERE } bvh_bounds; /* protocol's numbers */
    /* plain: sphere links in a storage buffer, for the benchmark */
    enum { BVH_LAYOUT_FAST, BVH_LAYOUT_PLAIN } bvh_layout;
    uint32_t bvh_rays_together;     /* 0: chosen; 1, 2, 3, 4, 8 */
    uint32_t reference_rays_a_call; /* 0: chosen; 1, 4, 8, 16 */
    uint32_t ldc_resolution;        /* cells along the longest side of a cube; 0: 1024; 16 to 4096 */
    uint32_t ldc_block;             /* texels along a side of a min/max block: 2, 4, 8, 16, 32; 0: 8 */
    enum { LDC_BUILD_AUTO, LDC_BUILD_PEEL, LDC_BUILD_LISTS } ldc_build; /* protocol's numbers */
    /* protocol's numbers; auto: cells, or with a tolerance, which these know nothing of, or where they do not fit,
     * a pyramid */
    enum { LDC_LEVELS_AUTO, LDC_LEVELS_BLOCKS, LDC_LEVELS_PYRAMID, LDC_LEVELS_CELLS } ldc_levels;
    /* Which images a triangle is in: those that its normal leans to almost as much as to one, or that one alone.
     */
    enum { LDC_IMAGES_OVERLAP, LDC_IMAGES_ONE } ldc_images; /* protocol's numbers */
    /* 0: a hit is where the ray crosses a sample's plane; else where it comes as near to the sample: metres */
    float ldc_tolerance;
    uint32_t ldc_rays_together;   /* 0: chosen; 1, 4 */
    uint32_t ldc_layers_together; /* of a texel, tested at once; 0: chosen; 1, 4; for the benchmark */
    uint32_t ldc_count_steps;   /* 1: crossings say what the walk did (shaders/ldc/cube.glsl); for the benchmark */
    uint32_t ldc_layers_max;    /* 0: 255, more cannot be kept; of more the nearest are kept */
    uint32_t ldc_mebibytes_max; /* device memory of one cube's samples; 0: no limit but the device's */
    uint32_t abuffer_resolution; /* texels along a side of an A-buffer; 0: 1280; 16 to 4096 */
    uint32_t abuffer_voxels; /* along a side of the grid: 16, 32, 64, 128, 256; 0: chosen from the resolution */
    enum {
        ABUFFER_SEARCH_AUTO,
        ABUFFER_SEARCH_DDA,
        ABUFFER_SEARCH_LINEAR3,
        ABUFFER_SEARCH_LINEAR1
    } abuffer_search;
    uint32_t abuffer_count_steps;   /* 1: crossings say what the walk did; for the benchmark */
    uint32_t abuffer_mebibytes_max; /* device memory of the lists and samples; 0: no limit but the device's */
    /* Words only, without bytes between them: tracer_options_same() compares all. */
};

/* Whether one tracer serves both, and a picture by either goes on from one by the other. */
bool tracer_options_same(const struct tracer_options *a, const struct tracer_options *b);

enum { TRACER_CUBE_STATIC, TRACER_CUBE_DYNAMIC, TRACER_CUBES_MAX };

/* A sampled structure: what of the scene is in it, and how finely. */
struct tracer_cube {
    uint32_t resolution;    /* cells along the longest side; 0: there is no such cube */
    float cell_metres;      /* size of a cell, world space */
    uint32_t layers_needed; /* greatest depth complexity of an image's texels */
    uint32_t layers_kept; /* fewer than are needed: there was no room for more, and the farther ones are missing */
    uint64_t samples;
    uint64_t samples_lost; /* of those that are missing; at most, as it is not known which coincide */
    bool rebuilt;          /* by the last update */
};

struct tracer_stats {
    uint64_t device_bytes;   /* of the structure */
    uint64_t uploaded_bytes; /* by the last update */
    uint64_t nodes;          /* elements of the structure */
    uint64_t nodes_rebuilt;  /* by the last update */
    uint64_t nodes_refitted;
    struct tracer_cube cubes[TRACER_CUBES_MAX]; /* `ldc` */
    uint64_t walk_ns; /* `reference`: of the last wave or part, in Embree alone, without the copies from and to the
                         device */
};

struct tracer {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    struct tracer_stats stats;
    /* by the wrappers: */
    bool updated;         /* the structure is that of some revision */
    bool updating;        /* an update has begun and has not come to its end */
    uint64_t step_end_ns; /* when its step in hand is to end: for step_is_over() */
};

struct tracer_impl {
    const char *name;
    unsigned depends_on; /* tracer_dependency bits */
    bool sampled;        /* hits of meshes and spheres are stored samples (HIT_SAMPLED) */
    /* The structure knows the scene as the shutter opens: rays of a scene in which something moves meanwhile must
     * have no times. */
    bool still;
    struct tracer *(*create)(struct gpu_device *device, const struct tracer_options *options, struct error *error);
    void (*destroy)(struct tracer *tracer);
    /* Does a step of bringing the structure to the scene, until about tracer->step_end_ns; `changes` is what
     * changed since the last update of this tracer. Everything is marked changed on the first. After TRACER_MORE
     * it is called again with the same scene, which stays as it is, but for scene->motion, which only the first
     * step may look at. What it has found so far the tracer keeps in its own struct: buffers of others may be
     * bound between two steps. Reports what the step took as STAGE_BUILD and STAGE_UPLOAD, and keeps the stats'
     * device_bytes true. */
    enum tracer_progress (*update)(struct tracer *tracer, struct gpu_scene *scene,
                                   const struct scene_changes *changes, struct stage_times *times,
                                   struct error *error);
    /* Lets go of an update that is not done, and of all that was built; the next one is a first one. NULL: there
     * is never more than one step. */
    void (*abandon)(struct tracer *tracer);
    /* Whether the next step would only wait, for threads of the tracer's own. NULL: never. */
    bool (*waits)(struct tracer *tracer);
    /* Buffers of the scene are bound. Queues the work; does not wait, unless it is done on the CPU. Rays
     * wave->first_ray .. wave->end_ray - 1, of which there are some. */
    bool (*trace)(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);
};

extern const struct tracer_impl tracer_bvh_impl, tracer_naive_impl, tracer_reference_impl, tracer_ldc_impl,
    tracer_abuffer_impl;

/* The table of what this build has; index is the protocol's tracer number, NULL where it is left out. */
const struct tracer_impl *tracer_impl_by_number(unsigned number);
/* The same for who asked for it: where there is none, ERROR_UNSUPPORTED says why and what can be done. */
const struct tracer_impl *tracer_find(unsigned number, const char *field, struct error *error);

/* Whether the tracer can show what moves while the shutter is open, if something does; else ERROR_UNSUPPORTED. */
bool tracer_check_motion(const struct tracer_impl *impl, const struct gpu_scene *scene, struct error *error);

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error);
void tracer_destroy(struct tracer *tracer); /* accepts NULL */
/* An update is made of steps of about `step_ns` each (STEP_NS), of which this does one. The scene and what its
 * arrays hold must not change until it is done or abandoned. The first update, and the first one after a failure
 * or one that was abandoned, takes everything to be changed. */
enum tracer_progress tracer_update_step(struct tracer *tracer, struct gpu_scene *scene,
                                        const struct scene_changes *changes, uint64_t step_ns,
                                        struct stage_times *times, struct error *error);
/* Whether the next step would do nothing but wait. */
bool tracer_update_waits(struct tracer *tracer);
/* Nothing happens where no update has begun. */
void tracer_update_abandon(struct tracer *tracer);
/* All of it at once. */
bool tracer_update(struct tracer *tracer, struct gpu_scene *scene, const struct scene_changes *changes,
                   struct stage_times *times, struct error *error);
/* So does the next one: it is not known what changed. */
void tracer_outdate(struct tracer *tracer);
/* Traces rays 0 .. wave->ray_count - 1 (at least 1 and at most what the buffers hold, which is checked), or the
 * part of them that the wave names. */
bool tracer_trace(struct tracer *tracer, struct gpu_scene *scene, const struct wave *wave, struct error *error);

#endif
