/* SPDX-License-Identifier: MIT */
#include "trace/ldc/surface.h"

#include "gpu/program.h"
#include "shared/bindings.h"

#include <epoxy/gl.h>

bool ldc_surfaces(struct ldc_store *store, const struct gpu_scene *scene, const struct wave *wave,
                  struct error *error)
{
    static const struct gpu_define discs[] = {{"HAS_DISCS", "1"}, {0}};
    if (wave->kind == WAVE_ANY || wave->crossings_only)
        return true;
    const struct gpu_program_source source = {.compute = "ldc/surface.comp",
                                              .defines = scene->disc_count > 0 ? discs : NULL};
    const struct gpu_program *program = gpu_program_get(scene->device, &source, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "first_ray", wave->first_ray);
    gpu_uniform_uint(program, "ray_count", wave->end_ray);
    gpu_buffer_bind_texels(scene->device, wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(scene->device, &store->geometry, UNIT_TRACER_0, GL_RG32UI);
    gpu_buffer_bind_texels(scene->device, &store->surface, UNIT_TRACER_1, GL_RGBA32UI);
    gpu_buffer_bind_image(scene->device, wave->hits, IMAGE_HITS, GL_RGBA32UI);
    gpu_dispatch(scene->device, program, wave->end_ray - wave->first_ray);
    return true;
}
