/* SPDX-License-Identifier: MIT */
/* One interface for every acceleration structure. The wrappers below check, time and call. */
#ifndef FARLIGHT_TRACE_TRACER_H
#define FARLIGHT_TRACE_TRACER_H

#include "base/error.h"
#include "base/stage_times.h"
#include "gpu/device.h"
#include "trace/scene_gpu.h"
#include "trace/wave.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

enum tracer_dependency { /* bits: what a structure is built from */
                         TRACER_NEEDS_SCENE = 1,
                         TRACER_NEEDS_VIEW = 2,
                         TRACER_NEEDS_RAYS = 4,
};

/* Options of all tracers; zero is the default of each. */
struct tracer_options {
    enum { BVH_BOUNDS_AUTO, BVH_BOUNDS_BOX, BVH_BOUNDS_SPHERE } bvh_bounds; /* protocol's numbers */
    /* plain: sphere links in a storage buffer, for the benchmark */
    enum { BVH_LAYOUT_FAST, BVH_LAYOUT_PLAIN } bvh_layout;
    uint32_t bvh_rays_together;     /* 0: chosen; 1, 2, 3, 4, 8 */
    uint32_t reference_rays_a_call; /* 0: chosen; 1, 4, 8, 16 */
};

struct tracer_stats {
    uint64_t device_bytes;   /* of the structure */
    uint64_t uploaded_bytes; /* by the last update */
    uint64_t nodes;          /* elements of the structure */
    uint64_t nodes_rebuilt;  /* by the last update */
    uint64_t nodes_refitted;
    uint64_t
        walk_ns; /* `reference`: of the last wave, in Embree alone, without the copies from and to the device */
};

struct tracer {
    const struct tracer_impl *impl;
    struct gpu_device *device;
    struct tracer_options options;
    struct tracer_stats stats;
    bool updated; /* by the wrappers: the structure is that of some revision */
};

struct tracer_impl {
    const char *name;
    unsigned depends_on; /* tracer_dependency bits */
    struct tracer *(*create)(struct gpu_device *device, const struct tracer_options *options, struct error *error);
    void (*destroy)(struct tracer *tracer);
    /* Brings the structure to the scene; `changes` is what changed since the last update of this tracer.
     * Everything is marked changed on the first. Reports STAGE_BUILD and STAGE_UPLOAD. */
    bool (*update)(struct tracer *tracer, struct scene_gpu *scene, const struct scene_changes *changes,
                   struct stage_times *times, struct error *error);
    /* Buffers of the scene are bound. Queues the work; does not wait, unless it is done on the CPU. */
    bool (*trace)(struct tracer *tracer, struct scene_gpu *scene, const struct wave *wave, struct error *error);
};

extern const struct tracer_impl tracer_bvh_impl, tracer_naive_impl, tracer_reference_impl;

/* The table of what this build has; index is the protocol's tracer number, NULL where it is left out. */
const struct tracer_impl *tracer_impl_by_number(unsigned number);
/* The same for who asked for it: where there is none, ERROR_UNSUPPORTED says why and what can be done. */
const struct tracer_impl *tracer_find(unsigned number, const char *field, struct error *error);

struct tracer *tracer_create(const struct tracer_impl *impl, struct gpu_device *device,
                             const struct tracer_options *options, struct error *error);
void tracer_destroy(struct tracer *tracer); /* accepts NULL */
/* The first update, and the first one after a failure, takes everything to be changed. */
bool tracer_update(struct tracer *tracer, struct scene_gpu *scene, const struct scene_changes *changes,
                   struct stage_times *times, struct error *error);
/* So does the next one: it is not known what changed. */
void tracer_outdate(struct tracer *tracer);
/* Traces rays 0 .. wave->ray_count - 1 (at least 1 and at most what the buffers hold, which is checked). */
bool tracer_trace(struct tracer *tracer, struct scene_gpu *scene, const struct wave *wave, struct error *error);

#endif
