/* SPDX-License-Identifier: MIT */
/* Builds a cube by rasterising instances along three axes: by depth peeling, as the paper does it (section 1.2),
 * or in one pass with a list for each texel ("layered buffers", section 1.2.1). Both give the same samples. */
#ifndef FARLIGHT_TRACE_LDC_BUILD_H
#define FARLIGHT_TRACE_LDC_BUILD_H

#include "base/error.h"
#include "trace/ldc/store.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"

#include <stdbool.h>
#include <stdint.h>

/* Maximum of fragments in a list. A texel with more is peeled, once for each layer that is kept, which takes
 * minutes. Software GL ends the loops of an invocation after 65,535 rounds: a heap of 2048 takes about 50,000,
 * and pack.comp passes eight texels three times. */
#define LDC_LISTED_LAYERS_MAX 2048u

/* Private buffers and images of the build, kept between builds; all-zero is empty. */
struct ldc_builder;

struct ldc_builder *ldc_builder_create(struct gpu_device *device, struct error *error);
void ldc_builder_destroy(struct ldc_builder *builder); /* accepts NULL */
uint64_t ldc_builder_bytes(const struct ldc_builder *builder);
/* Drops a build in progress and frees everything: the builder is as new. */
void ldc_builder_clear(struct ldc_builder *builder);

/* Begins to fill cube `which` of the store, whose lower_world, cell_world and resolution are set, with the
 * triangles and spheres of instances[0 .. count - 1] as they are when the shutter opens (gpu_scene's); texels,
 * quads, geometry and surface are written, nodes are not. The other cube stays as it is, except that everything
 * behind the static cube is lost when that one is built. Discs are left out. Where there are more layers than
 * options->limits.ldc_layers or than fit options->limits.ldc_mebibytes, the nearest (minimum depth) of each texel
 * are kept, and the cube says how many were needed. Never TRACER_DONE; store, scene and options must stay until
 * the build is done. */
enum tracer_progress ldc_build_begin(struct ldc_builder *builder, struct ldc_store *store, unsigned which,
                                     struct gpu_scene *scene, const uint32_t *instances, uint32_t instance_count,
                                     const struct tracer_options *options, struct error *error);
/* Runs the next unit after TRACER_MORE, with the scene bound: some of a pass over the scene (all of it with
 * at_once), or a pass over its result. Queues the work; some units wait for it. On failure the cube is empty. */
enum tracer_progress ldc_build_step(struct ldc_builder *builder, bool at_once, struct error *error);

#endif
