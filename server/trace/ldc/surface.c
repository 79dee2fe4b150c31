/* SPDX-License-Identifier: MIT */
/* The pass that turns samples which rays have hit into hits. */
#include "trace/ldc/surface.h"

#include "gpu/program.h"
#include "shared/bindings.h"
#include "trace/program.h"

#include <epoxy/gl.h>

bool ldc_surfaces(struct ldc_store *store, const struct gpu_scene *scene, const struct ray_range *rays,
                  struct error *error)
{
    struct gpu_define defines[TRACE_SURFACE_DEFINES + 2] = {0};
    size_t n = trace_surface_defines(scene, defines);
    if (scene->disc_count > 0)
        defines[n++] = (struct gpu_define){"HAS_DISCS", "1"};
    const struct gpu_program *program =
        trace_surface_program_get(scene, rays->wave, "ldc/surface.comp", defines, error);
    if (!program)
        return false;
    gpu_buffer_bind_texels(scene->device, &store->surface, UNIT_TRACER_0, GL_RGBA32UI);
    gpu_buffer_bind_texels(scene->device, &store->primitives, UNIT_TRACER_1, GL_RG32UI);
    trace_surface_program_run(program, scene, rays);
    return true;
}
