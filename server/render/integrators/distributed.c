/* SPDX-License-Identifier: MIT */
/* Cook, Porter, Carpenter. Distributed Ray Tracing. 1984, one random choice of each kind a sample, as in section 7
 * of the stackless sphere tree's paper: at each hit one shadow ray and at most one ray more. What a hit sends out
 * is in shaders/render/distributed.comp. */
#include "render/wave_passes.h"

static uint32_t shadow_rays_a_hit(const struct render_context *context)
{
    return context->uniforms.light_count > 0 ? 1 : 0;
}

static bool shade(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error)
{
    return wave_passes_run(passes, context, "render/distributed.comp", NULL, first, count, error);
}

static struct integrator *create(struct gpu_device *device, struct error *error)
{
    static const struct wave_passes_kind kind = {
        .impl = &integrator_distributed_impl,
        .children_a_hit = 1,
        .shadow_waves = 1,
        .shadow_rays_a_hit = shadow_rays_a_hit,
        .shade = shade,
        .straight_waves = STRAIGHT_WAVES,
    };
    return wave_passes_create(&kind, device, error);
}

const struct integrator_impl integrator_distributed_impl = {
    .name = "distributed",
    .create = create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = wave_passes_shade,
};
