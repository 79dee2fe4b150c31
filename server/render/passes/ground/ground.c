/* SPDX-License-Identifier: MIT */
#include "render/passes/ground/ground.h"

#include "render/waves/compact.h"
#include "render/waves/integrator.h"
#include "render/passes/layers/layers.h"

#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <string.h>

/* Of each hit, where each is chosen by its light: a ray brings its part or none, so one would make much noise. */
#define SHADOW_RAYS 4u
/* Those of emitters, of surfaces, and the rest. */
#define DEFINES_MAX (4 + CONTEXT_SURFACE_DEFINES + 6 + LAYERS_LIGHT_DEFINES)

bool ground_is_shown(const struct render_context *context, const struct integrator *integrator)
{
    return context->request.ground.radius > 0.0f && integrator->ground && context->request.hidden_layer == 0;
}

uint32_t ground_shadow_rays(const struct render_context *context, const struct integrator *integrator)
{
    const uint32_t own = integrator->shadow_rays_a_hit(context);
    const bool chosen = ground_is_shown(context, integrator) && strcmp(integrator->ground, "ONE_LIGHT") == 0;
    return chosen && own < SHADOW_RAYS ? SHADOW_RAYS : own;
}

/* Directions of an image about the scene are looked up in its table; of a smooth sky those by the cosine do. */
static bool uses_table(const struct render_context *context, const struct integrator *integrator)
{
    return integrator->random && context->environment->kind == ENVIRONMENT_IMAGE;
}

bool ground_prepare(struct render_context *context, const struct integrator *integrator, struct error *error)
{
    return !ground_is_shown(context, integrator) || !uses_table(context, integrator) ||
           environment_choice_update(context->environment_choice, context->device, context->environment,
                                     &context->scene->scene->environment, error);
}

bool ground_hit(struct render_context *context, const struct integrator *integrator, struct error *error)
{
    if (!ground_is_shown(context, integrator))
        return true;
    const struct gpu_program *program = context_use(context, "render/ground_hits.comp", error);
    if (!program)
        return false;
    const struct frame_ground *ground = &context->request.ground;
    float centre_radius[4] = {0.0f, 0.0f, 0.0f, ground->radius}, normal[4] = {0.0f};
    memcpy(centre_radius, ground->centre_world, sizeof(ground->centre_world));
    memcpy(normal, ground->normal_world, sizeof(ground->normal_world));
    context_bind_hits(context);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_uniform_vec(program, "ground_centre_radius", 4, centre_radius);
    gpu_uniform_vec(program, "ground_normal", 4, normal);
    compact_dispatch(context, program, WAVE_RAYS);
    return true;
}

static const struct gpu_program *shade_program(struct render_context *context, const struct integrator *integrator,
                                               struct error *error)
{
    struct gpu_define defines[DEFINES_MAX] = {{integrator->ground, "1"}};
    size_t n = 1;
    if (integrator->lit_by_surfaces)
        n += integrator_emitter_defines(context, defines + n);
    n += context_surface_defines(context, defines + n);
    if (context->features.area_lights)
        defines[n++] = (struct gpu_define){"HAS_AREA_LIGHTS", "1"};
    if (context->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    if (context->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (uses_table(context, integrator) && context->environment_choice->rows > 0)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_TABLE", "1"};
    (void)layers_light_defines(context->layers, defines + n);
    return context_use_with(context, "render/ground.comp", defines, error);
}

bool ground_shade(struct render_context *context, const struct integrator *integrator, uint32_t first,
                  uint32_t count, struct error *error)
{
    if (!ground_is_shown(context, integrator))
        return true;
    const struct gpu_program *program = shade_program(context, integrator, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    gpu_uniform_uint(program, "wave_number", context->wave_number);
    gpu_uniform_uint(program, "shadow_rays_a_hit", ground_shadow_rays(context, integrator));
    gpu_uniform_uint(program, "first_ray", first);
    gpu_uniform_uint(program, "batch_rays", count);
    gpu_uniform_uint(program, "own_rays", integrator->shadow_rays_a_hit(context));
    gpu_uniform_float(program, "reach", context_ao_distance(context));
    gpu_uniform_float(program, "falloff", context->request.ao_falloff);
    environment_choice_bind(context->environment_choice, context->device, program);
    layers_bind_light(context->layers, program);
    compact_dispatch(context, program, WAVE_HITS);
    return true;
}
