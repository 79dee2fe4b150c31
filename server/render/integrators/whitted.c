/* SPDX-License-Identifier: MIT */
/* Whitted. An Improved Illumination Model for Shaded Display. 1980: at each hit the light of every lamp that a
 * shadow ray reaches, and a ray each for what is mirrored and what is refracted. What a hit sends out is in
 * shaders/render/whitted.comp. */
#include "render/wave_passes.h"

#include "shared/path.h"

static uint32_t shadow_rays_a_hit(const struct render_context *context)
{
    return context->uniforms.light_count;
}

static bool shade(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error)
{
    return wave_passes_run(passes, context, "render/whitted.comp", NULL, first, count, error);
}

static struct integrator *create(struct gpu_device *device, struct error *error)
{
    static const struct wave_passes_kind kind = {
        .impl = &integrator_whitted_impl,
        .children_a_hit = CHILDREN_MAX,
        .shadow_waves = 1,
        .shadow_rays_a_hit = shadow_rays_a_hit,
        .shade = shade,
        .straight_waves = STRAIGHT_WAVES,
    };
    return wave_passes_create(&kind, device, error);
}

const struct integrator_impl integrator_whitted_impl = {
    .name = "whitted",
    .create = create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = wave_passes_shade,
};
