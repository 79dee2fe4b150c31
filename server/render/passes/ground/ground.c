/* SPDX-License-Identifier: MIT */
/* Finds and shades the ground's hits. */
#include "render/passes/ground/ground.h"

#include "render/light/environment_choice.h"
#include "render/waves/compact.h"
#include "render/waves/integrator.h"
#include "render/waves/notes.h"

#include "shared/bindings.h"

#include <epoxy/gl.h>
#include <string.h>

/* Shadow rays of each hit, where each is chosen by its light: a ray brings its part or none, so one would make
 * much noise. */
#define SHADOW_RAYS 4u
/* Defines of emitters, of surfaces, and the rest. */
#define DEFINES_MAX (4 + CONTEXT_SURFACE_DEFINES + 6 + NOTES_LIGHT_DEFINES)

bool ground_is_shown(const struct render_frame *frame)
{
    return frame->request.ground.radius > 0.0f && frame->integrator->ground && frame->request.hidden_layer == 0;
}

static uint32_t shadow_rays_of(const struct render_frame *frame)
{
    const struct integrator *integrator = frame->integrator;
    const uint32_t own = integrator->shadow_rays_a_hit(frame);
    const bool chosen = ground_is_shown(frame) && strcmp(integrator->ground, "ONE_LIGHT") == 0;
    return chosen && own < SHADOW_RAYS ? SHADOW_RAYS : own;
}

/* Directions of an image about the scene are looked up in its table; of a smooth sky those by the cosine do. */
static bool uses_table(const struct render_frame *frame)
{
    return frame->integrator->random && frame->environment->kind == ENVIRONMENT_IMAGE;
}

static bool prepare(const struct render_frame *frame, struct error *error)
{
    return !ground_is_shown(frame) || !uses_table(frame) ||
           environment_choice_update(frame->environment_choice, frame->device->gpu, frame->environment,
                                     &frame->scene->scene->environment, error);
}

static bool make_hits(struct render_wave *wave, struct error *error)
{
    if (!ground_is_shown(wave->frame))
        return true;
    const struct gpu_program *program = context_use(wave->device, "render/ground_hits.comp", error);
    if (!program)
        return false;
    const struct frame_ground *ground = &wave->frame->request.ground;
    float centre_radius[4] = {0.0f, 0.0f, 0.0f, ground->radius}, normal[4] = {0.0f};
    memcpy(centre_radius, ground->centre_world, sizeof(ground->centre_world));
    memcpy(normal, ground->normal_world, sizeof(ground->normal_world));
    context_bind_hits(wave);
    gpu_buffer_bind_storage(&wave->hits, BIND_HITS);
    gpu_uniform_vec(program, "ground_centre_radius", 4, centre_radius);
    gpu_uniform_vec(program, "ground_normal", 4, normal);
    compact_dispatch(wave, program, WAVE_RAYS);
    return true;
}

static const struct gpu_program *shade_program(struct render_wave *wave, struct error *error)
{
    const struct integrator *integrator = wave->frame->integrator;
    struct gpu_define defines[DEFINES_MAX] = {{integrator->ground, "1"}};
    size_t n = 1;
    if (integrator->lit_by_surfaces)
        n += integrator_emitter_defines(wave->frame, defines + n);
    n += context_surface_defines(wave, defines + n);
    if (wave->frame->features.area_lights)
        defines[n++] = (struct gpu_define){"HAS_AREA_LIGHTS", "1"};
    if (wave->frame->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    if (wave->frame->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (uses_table(wave->frame) && wave->frame->environment_choice->rows > 0)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_TABLE", "1"};
    (void)notes_light_defines(wave->notes, defines + n);
    return context_use_with(wave->device, "render/ground.comp", defines, error);
}

static bool shade(struct render_wave *wave, uint32_t first, uint32_t count, struct error *error)
{
    if (!ground_is_shown(wave->frame))
        return true;
    const struct gpu_program *program = shade_program(wave, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    gpu_uniform_uint(program, "wave_number", wave->number);
    gpu_uniform_uint(program, "shadow_rays_a_hit", shadow_rays_of(wave->frame));
    gpu_uniform_uint(program, "first_ray", first);
    gpu_uniform_uint(program, "batch_rays", count);
    gpu_uniform_uint(program, "own_rays", wave->frame->integrator->shadow_rays_a_hit(wave->frame));
    gpu_uniform_float(program, "reach", context_ao_distance(wave->frame));
    gpu_uniform_float(program, "falloff", wave->frame->request.light.ao_falloff);
    environment_choice_bind(wave->frame->environment_choice, wave->device->gpu, program);
    notes_bind_light(wave->notes, program);
    compact_dispatch(wave, program, WAVE_HITS);
    return true;
}

const struct shading_extra ground_shading = {
    .is_shown = ground_is_shown,
    .shadow_rays = shadow_rays_of,
    .prepare = prepare,
    .make_hits = make_hits,
    .shade = shade,
};

/* First hits are listed when they are found: where they were rasterised, only listed hits are filled in. */
static bool wants(const void *self, const struct render_wave *wave)
{
    (void)self;
    return wave->number == 0 && wave->frame->request.picture.view_source != VIEW_SOURCE_LAYERS &&
           ground_is_shown(wave->frame);
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    (void)self;
    context_span_begin(wave->device, STAGE_SHADE);
    const bool listed = make_hits(wave, error) && compact_hits(wave, error);
    context_span_end(wave->device);
    return listed ? PASS_DONE : PASS_FAILED;
}

const struct pass ground_pass = {.name = "ground", .wants = wants, .run = run};
