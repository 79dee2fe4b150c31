/* SPDX-License-Identifier: MIT */
/* Kajiya. The Rendering Equation. 1986: paths from the eye, which ask for light at each hit. What a hit sends out
 * is in shaders/render/path.comp; here, how the environment's directions are chosen. */
#include "render/environment_choice.h"
#include "render/wave_passes.h"

#include "shared/bindings.h"

#include <epoxy/gl.h>

static bool asks_lights(const struct render_context *context)
{
    return context->uniforms.light_count > 0;
}

static bool asks_environment(const struct render_context *context)
{
    return context->environment->kind != ENVIRONMENT_NONE;
}

static uint32_t shadow_rays_a_hit(const struct render_context *context)
{
    return asks_lights(context) + asks_environment(context);
}

static bool shade(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error)
{
    struct environment_choice *choice = context->environment_choice;
    struct gpu_define defines[5] = {0};
    size_t n = 0;
    (void)first; /* 0: there is room for all shadow rays at once */
    (void)count;
    if (context->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (choice->rows > 0)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_TABLE", "1"};
    if (context->features.anisotropy)
        defines[n++] = (struct gpu_define){"HAS_ANISOTROPY", "1"};
    if (context->request.brdf == FRAME_BRDF_WARD)
        defines[n++] = (struct gpu_define){"WARD", "1"};
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program =
        wave_passes_shade_program(passes, context, "render/path.comp", defines, error);
    if (program) {
        gpu_uniform_uint(program, "asks_lights", asks_lights(context));
        gpu_uniform_uint(program, "asks_environment", asks_environment(context));
        gpu_uniform_uint(program, "environment_rows", choice->rows);
        gpu_uniform_uint(program, "environment_columns", choice->columns);
        gpu_buffer_bind_texels(context->device, &choice->table, UNIT_SHADE_ENVIRONMENT, GL_R32F);
        gpu_dispatch(context->device, program, context->hit_count);
    }
    context_span_end(context);
    return program != NULL;
}

static struct integrator *create(struct gpu_device *device, struct error *error)
{
    static const struct wave_passes_kind kind = {
        .impl = &integrator_path_impl,
        .children_a_hit = 1,
        .shadow_waves = 2,
        .shadow_rays_a_hit = shadow_rays_a_hit,
        .shade = shade,
        .straight_waves = STRAIGHT_WAVES,
        .left_scene = "SHARES",
    };
    return wave_passes_create(&kind, device, error);
}

static bool reserve(struct integrator *integrator, struct render_context *context, struct error *error)
{
    return environment_choice_update(context->environment_choice, context->device, context->environment,
                                     &context->scene->scene->environment, error) &&
           wave_passes_reserve(integrator, context, error);
}

const struct integrator_impl integrator_path_impl = {
    .name = "path",
    .create = create,
    .destroy = wave_passes_destroy,
    .reserve = reserve,
    .device_bytes = wave_passes_device_bytes,
    .shade = wave_passes_shade,
};
