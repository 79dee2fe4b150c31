/* SPDX-License-Identifier: MIT */
/* Builds A-buffers by rasterising the scene along three axes, once: paper, section 3.1. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_H

#include "base/error.h"
#include "trace/abuffer/store.h"
#include "trace/step.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

struct abuffer_builder;

struct abuffer_builder *abuffer_builder_create(struct gpu_device *device, struct error *error);
void abuffer_builder_destroy(struct abuffer_builder *builder); /* accepts NULL */
/* Frees the buffers that it keeps between builds. No build may be in progress. */
void abuffer_builder_clear(struct abuffer_builder *builder);
uint64_t abuffer_builder_bytes(const struct abuffer_builder *builder);

/* Begins to fill the store with instances[0 .. instance_count - 1] (gpu_scene's, which need not ascend); the
 * caller has set lower_world, cell_world (metres), resolution and voxels_along. The list is read before this
 * returns, and stays the caller's; store, scene and options must stay until the build is done or abandoned.
 * Failures leave an empty store, and so does a list of nothing. */
bool abuffer_build_begin(struct abuffer_builder *builder, struct abuffer_store *store, struct gpu_scene *scene,
                         const uint32_t *instances, uint32_t instance_count, const struct tracer_options *options,
                         struct error *error);
/* Continues the build until about step_end_ns; waits for the device. Where the lists' buffer is too small it is
 * enlarged and the pass repeated; where options->limits.abuffer_mebibytes or the device forbid that, it fails
 * with ERROR_LIMIT or ERROR_OUT_OF_MEMORY. */
enum tracer_progress abuffer_build_step(struct abuffer_builder *builder, uint64_t step_end_ns,
                                        struct error *error);
/* Leaves an empty store where a build has begun; memory for lists stays reserved. */
void abuffer_build_abandon(struct abuffer_builder *builder);
bool abuffer_build_is_on(const struct abuffer_builder *builder);

#endif
