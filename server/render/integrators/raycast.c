/* SPDX-License-Identifier: MIT */
/* Ray casting through all layers: each is lit without shadows and blended over those behind it. What a hit sends
 * out is in shaders/render/raycast.comp.
 *
 * Going straight on is no bounce, here as everywhere, so the request's depth does not limit the layers: what is
 * left of the ray does. Where that never ends, as behind perfectly clear panes, LAYERS_MAX layers beyond the depth
 * do. */
#include "render/wave_passes.h"

#define OPACITY_DEFAULT 0.5f
#define LAYERS_MAX 256

static uint32_t shadow_rays_a_hit(const struct render_context *context)
{
    (void)context;
    return 0;
}

static bool shade(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error)
{
    float opacity = context->request.layer_opacity;
    (void)first;
    (void)count;
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program =
        wave_passes_shade_program(passes, context, "render/raycast.comp", NULL, error);
    if (program) {
        gpu_uniform_float(program, "layer_opacity", opacity > 0.0f ? opacity : OPACITY_DEFAULT);
        gpu_dispatch(context->device, program, context->hit_count);
    }
    context_span_end(context);
    return program != NULL;
}

static struct integrator *create(struct gpu_device *device, struct error *error)
{
    static const struct wave_passes_kind kind = {
        .impl = &integrator_raycast_impl,
        .children_a_hit = 1,
        .shadow_waves = 1,
        .shadow_rays_a_hit = shadow_rays_a_hit,
        .shade = shade,
        .straight_waves = LAYERS_MAX,
    };
    return wave_passes_create(&kind, device, error);
}

const struct integrator_impl integrator_raycast_impl = {
    .name = "raycast",
    .create = create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = wave_passes_shade,
};
