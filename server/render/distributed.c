/* SPDX-License-Identifier: MIT */
/* Cook, Porter, Carpenter. Distributed Ray Tracing. 1984, one random choice of each kind a sample, as in section 7
 * of the stackless sphere tree's paper: at each hit one shadow ray and at most one ray more. What a hit sends out
 * is in shaders/render/distributed.comp. */
#include "render/wave_passes.h"

static struct integrator *distributed_create(struct gpu_device *device, struct error *error)
{
    return wave_passes_create(&integrator_distributed_impl, device, 1, 1, error);
}

static bool shade_pass(struct wave_passes *passes, struct render_context *context, struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program =
        wave_passes_shade_program(passes, context, "render/distributed.comp", NULL, error);
    if (program)
        gpu_dispatch(context->device, program, context->hit_count);
    context_span_end(context);
    return program != NULL;
}

static enum integrator_progress distributed_shade(struct integrator *integrator, struct render_context *context,
                                                  struct error *error)
{
    struct wave_passes *passes = (struct wave_passes *)integrator;
    uint32_t rays_a_hit = context->uniforms.light_count > 0 ? 1 : 0;
    if (!wave_passes_left_scene(passes, context, error))
        return INTEGRATOR_FAILED;
    if (context->hit_count > 0 &&
        (!shade_pass(passes, context, error) ||
         (rays_a_hit > 0 && !wave_passes_trace_shadows(passes, context, rays_a_hit, error))))
        return INTEGRATOR_FAILED;
    if (!wave_passes_gather(passes, context, true, rays_a_hit, error))
        return INTEGRATOR_FAILED;
    return wave_passes_next_wave(passes, context, error);
}

const struct integrator_impl integrator_distributed_impl = {
    .name = "distributed",
    .create = distributed_create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = distributed_shade,
};
