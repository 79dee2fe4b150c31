/* SPDX-License-Identifier: MIT */
/* Whitted. An Improved Illumination Model for Shaded Display. 1980: at each hit the light of every lamp that a
 * shadow ray reaches, and a ray each for what is mirrored and what is refracted. What a hit sends out is in
 * shaders/render/whitted.comp. */
#include "render/wave_passes.h"

#include "shared/path.h"

/* Shadow rays traced at once, in waves. */
#define SHADOW_WAVES 2

static struct integrator *whitted_create(struct gpu_device *device, struct error *error)
{
    return wave_passes_create(&integrator_whitted_impl, device, CHILDREN_MAX, SHADOW_WAVES, error);
}

/* Surfaces, children and the shadow rays to lights first .. first + count - 1. */
static bool shade_pass(struct wave_passes *passes, struct render_context *context, uint32_t first_light,
                       uint32_t light_count, struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program =
        wave_passes_shade_program(passes, context, "render/whitted.comp", NULL, error);
    if (program) {
        gpu_uniform_uint(program, "first_light", first_light);
        gpu_uniform_uint(program, "batch_lights", light_count);
        gpu_dispatch(context->device, program, context->hit_count);
    }
    context_span_end(context);
    return program != NULL;
}

/* Light by light, as many at once as there is room for shadow rays. */
static bool direct_light(struct wave_passes *passes, struct render_context *context, struct error *error)
{
    uint32_t lights = context->uniforms.light_count, together = lights, first = 0;
    if (context->hit_count > 0)
        together = context->wave_capacity * SHADOW_WAVES / context->hit_count;
    do {
        uint32_t count = lights - first < together ? lights - first : together;
        if (context->hit_count > 0 && (!shade_pass(passes, context, first, count, error) ||
                                       (count > 0 && !wave_passes_trace_shadows(passes, context, count, error))))
            return false;
        if (!wave_passes_gather(passes, context, first == 0, count, error))
            return false;
        first += count;
    } while (first < lights);
    return true;
}

static enum integrator_progress whitted_shade(struct integrator *integrator, struct render_context *context,
                                              struct error *error)
{
    struct wave_passes *passes = (struct wave_passes *)integrator;
    if (!wave_passes_left_scene(passes, context, error) || !direct_light(passes, context, error))
        return INTEGRATOR_FAILED;
    return wave_passes_next_wave(passes, context, error);
}

const struct integrator_impl integrator_whitted_impl = {
    .name = "whitted",
    .create = whitted_create,
    .destroy = wave_passes_destroy,
    .reserve = wave_passes_reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = whitted_shade,
};
