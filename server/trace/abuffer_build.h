/* SPDX-License-Identifier: MIT */
/* Builds A-buffers by rasterising the scene along three axes, once: paper, section 3.1. */
#ifndef FARLIGHT_TRACE_ABUFFER_BUILD_H
#define FARLIGHT_TRACE_ABUFFER_BUILD_H

#include "base/error.h"
#include "trace/abuffer_store.h"
#include "trace/scene_gpu.h"
#include "trace/tracer.h"

#include <stdbool.h>

struct abuffer_builder;

struct abuffer_builder *abuffer_builder_create(struct gpu_device *device, struct error *error);
void abuffer_builder_destroy(struct abuffer_builder *builder); /* accepts NULL */
uint64_t abuffer_builder_bytes(const struct abuffer_builder *builder);

/* For tests: gives back what lists have room for; the next build begins with as many fragments. */
void abuffer_builder_start_with(struct abuffer_builder *builder, uint32_t fragments);
/* Over the scene, that the last build took: 1, or 2 where there was no room for the lists at first. */
uint32_t abuffer_builder_passes(const struct abuffer_builder *builder);

/* Fills all of the store but `voxels`; the caller has set lower_world, cell_world (metres), resolution and
 * voxels_along. Waits for the device. Where the lists' buffer is too small it is made larger, and the pass is
 * repeated; where options->abuffer_mebibytes_max or the device forbid that, it fails with ERROR_LIMIT or
 * ERROR_OUT_OF_MEMORY and the store is empty. It is empty, too, where the scene has nothing to draw. */
bool abuffer_build(struct abuffer_builder *builder, struct abuffer_store *store, struct scene_gpu *scene,
                   const struct tracer_options *options, struct error *error);

#endif
