/* SPDX-License-Identifier: MIT */
/* Ambient occlusion: of each first hit the share of the directions above it that nothing is in within a distance.
 * Some any-hit rays a sample, and no light. What a hit asks for is in shaders/render/ao.comp. */
#include "render/wave_passes.h"

static bool shade(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = wave_passes_shade_program(passes, context, "render/ao.comp", NULL, error);
    if (program) {
        gpu_uniform_uint(program, "first_ray", first);
        gpu_uniform_uint(program, "batch_rays", count);
        gpu_uniform_float(program, "reach", context_ao_distance(context));
        gpu_uniform_float(program, "falloff", context->request.ao_falloff);
        gpu_dispatch(context->device, program, context->hit_count);
    }
    context_span_end(context);
    return program != NULL;
}

static struct integrator *create(struct gpu_device *device, struct error *error)
{
    static const struct wave_passes_kind kind = {
        .impl = &integrator_ao_impl,
        .children_a_hit = 1,
        .shadow_waves = 1,
        .shadow_rays_a_hit = context_ao_rays,
        .shade = shade,
        .straight_waves = STRAIGHT_WAVES,
        .left_scene = "OPEN",
        .gather = "GREY",
    };
    return wave_passes_create(&kind, device, error);
}

const struct integrator_impl integrator_ao_impl = {
    .name = "ao",
    .create = create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = wave_passes_shade,
};
