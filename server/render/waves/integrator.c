/* SPDX-License-Identifier: MIT */
/* The table of integrators, and the setup of each one's shader. */
#include "render/waves/integrator.h"

#include "render/light/environment_choice.h"

#include "shared/bindings.h"
#include "shared/path.h"

#include <epoxy/gl.h>

/* Rays that go straight on through blended surfaces do not count as bounces. */
#define STRAIGHT_WAVES 16
/* Layers of ray casting do not count either: the rest of the ray limits them, and where that never ends, as behind
 * perfectly clear panes, this many beyond the depth. */
#define LAYERS_MAX 256
#define OPACITY_DEFAULT 0.5f

/* ---- shadow rays of each hit ---- */

static uint32_t no_shadow_rays(const struct render_frame *frame)
{
    (void)frame;
    return 0;
}

static uint32_t one_for_each_light(const struct render_frame *frame)
{
    return frame->uniforms.light_count;
}

static uint32_t one_for_all_lights(const struct render_frame *frame)
{
    return frame->uniforms.light_count > 0 || context_samples_emitters(frame);
}

static uint32_t one_for_lights_and_image(const struct render_frame *frame)
{
    return one_for_all_lights(frame) || frame->environment->kind == ENVIRONMENT_IMAGE;
}

static uint32_t one_for_the_environment(const struct render_frame *frame)
{
    const uint32_t kind = frame->environment->kind;
    return kind != ENVIRONMENT_NONE && kind != ENVIRONMENT_BACKDROP;
}

static uint32_t one_each_for_lights_and_environment(const struct render_frame *frame)
{
    return one_for_all_lights(frame) + one_for_the_environment(frame);
}

/* ---- set-up ---- */

static void set_ao(const struct render_frame *frame, const struct gpu_program *program)
{
    gpu_uniform_float(program, "reach", context_ao_distance(frame));
    gpu_uniform_float(program, "falloff", frame->request.light.ao_falloff);
}

static void set_raycast(const struct render_frame *frame, const struct gpu_program *program)
{
    float opacity = frame->request.light.layer_opacity;
    gpu_uniform_float(program, "layer_opacity", opacity > 0.0f ? opacity : OPACITY_DEFAULT);
}

size_t integrator_emitter_defines(const struct render_frame *frame, struct gpu_define *defines)
{
    size_t n = 0;
    if (!context_samples_emitters(frame))
        return 0;
    defines[n++] = (struct gpu_define){"HAS_EMITTERS", "1"};
    if (frame->tracer->impl->sampled)
        defines[n++] = (struct gpu_define){"EMITTERS_BY_DISTANCE", "1"};
    if (!frame->scene->has_motion)
        return n;
    defines[n++] = (struct gpu_define){"HAS_MOTION", "1"};
    defines[n++] =
        (struct gpu_define){"NO_COLOURS", "1"}; /* not read here, and there is no sampler left for them */
    return n;
}

static void set_environment_choice(const struct render_frame *frame, const struct gpu_program *program)
{
    struct environment_choice *choice = frame->environment_choice;
    gpu_uniform_float(program, "environment_extent", choice->extent);
    environment_choice_bind(choice, frame->device->gpu, program);
}

static bool prepare_environment_choice(const struct render_frame *frame, struct error *error)
{
    return environment_choice_update(frame->environment_choice, frame->device->gpu, frame->environment,
                                     &frame->scene->scene->environment, error);
}

/* The table is an image's; a mirror's own rays find other environments as well. */
static size_t distributed_defines(const struct render_wave *wave, struct gpu_define *defines)
{
    size_t n = integrator_emitter_defines(wave->frame, defines);
    if (wave->frame->environment->kind != ENVIRONMENT_IMAGE || wave->frame->environment_choice->rows == 0)
        return n;
    defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_TABLE", "1"};
    return n;
}

static void set_distributed(const struct render_frame *frame, const struct gpu_program *program)
{
    if (frame->environment->kind == ENVIRONMENT_IMAGE)
        set_environment_choice(frame, program);
}

static bool prepare_distributed(const struct render_frame *frame, struct error *error)
{
    return frame->environment->kind != ENVIRONMENT_IMAGE || prepare_environment_choice(frame, error);
}

static size_t path_defines(const struct render_wave *wave, struct gpu_define *defines)
{
    size_t n = integrator_emitter_defines(wave->frame, defines);
    if (wave->frame->environment->kind == ENVIRONMENT_IMAGE)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_IMAGE", "1"};
    if (wave->frame->environment_choice->rows > 0)
        defines[n++] = (struct gpu_define){"HAS_ENVIRONMENT_TABLE", "1"};
    if (wave->frame->request.light.brdf == BRDF_WARD)
        defines[n++] = (struct gpu_define){"WARD", "1"};
    return n;
}

static void set_path(const struct render_frame *frame, const struct gpu_program *program)
{
    gpu_uniform_uint(program, "asks_lights", one_for_all_lights(frame));
    gpu_uniform_uint(program, "asks_environment", one_for_the_environment(frame));
    set_environment_choice(frame, program);
}

/* scene_features.mirrors leaves nothing out, but stored samples are rounded, and a grain narrows a lobe. */
static size_t whitted_defines(const struct render_wave *wave, struct gpu_define *defines)
{
    if (wave->frame->features.mirrors || wave->frame->features.anisotropy || wave->sampled_hits ||
        wave->frame->tracer->impl->sampled)
        return 0;
    defines[0] = (struct gpu_define){"SENDS_NOTHING", "1"};
    return 1;
}

/* ---- the table ---- */

static const struct integrator integrators[] = {
    /* Whitted. An Improved Illumination Model for Shaded Display. 1980: at each hit the light of every light
     * that a shadow ray reaches, a mirrored ray and a refracted one. */
    [INTEGRATOR_WHITTED] =
        {
            .name = "whitted",
            .shader = "render/whitted.comp",
            .ground = "EVERY_LIGHT",
            .children_a_hit = CHILDREN_MAX,
            .follows_eye = true,
            .mirrors = true,
            .shadow_waves = 1,
            .straight_waves = STRAIGHT_WAVES,
            .shadow_rays_a_hit = one_for_each_light,
            .defines = whitted_defines,
        },
    /* Cook, Porter, Carpenter. Distributed Ray Tracing. 1984, one random choice of each kind a sample, as in
     * section 7 of the stackless sphere tree's paper: at each hit one shadow ray and at most one ray more. */
    [INTEGRATOR_DISTRIBUTED] =
        {
            .name = "distributed",
            .shader = "render/distributed.comp",
            .ground = "ONE_LIGHT",
            .children_a_hit = 1,
            .lit_by_surfaces = true,
            .follows_eye = true,
            .random = true,
            .scatters = true,
            .mirrors = true,
            .shadow_waves = 1,
            .straight_waves = STRAIGHT_WAVES,
            .shadow_rays_a_hit = one_for_lights_and_image,
            .left_scene = "SHARES",
            .defines = distributed_defines,
            .set = set_distributed,
            .prepare = prepare_distributed,
        },
    /* Ray casting through all layers: each is lit without shadows and blended over those behind it. */
    [INTEGRATOR_RAYCAST] =
        {
            .name = "raycast",
            .shader = "render/raycast.comp",
            .children_a_hit = 1,
            .shadow_waves = 1,
            .straight_waves = LAYERS_MAX,
            .shadow_rays_a_hit = no_shadow_rays,
            .set = set_raycast,
        },
    /* Ambient occlusion: for each first hit the share of the directions above it without a surface within a
     * distance. Some any-hit rays a sample, and no light. */
    [INTEGRATOR_AO] =
        {
            .name = "ao",
            .shader = "render/ao.comp",
            .ground = "OPEN",
            .children_a_hit = 1,
            .random = true,
            .shadow_waves = 1,
            .straight_waves = STRAIGHT_WAVES,
            .shadow_rays_a_hit = context_ao_rays,
            .left_scene = "OPEN",
            .gather = "GREY",
            .set = set_ao,
        },
    /* Kajiya. The Rendering Equation. 1986: paths from the eye, which ask for light at each hit. The buffers hold
     * all its shadow rays at once, which its shader counts on. */
    [INTEGRATOR_PATH] =
        {
            .name = "path",
            .shader = "render/path.comp",
            .ground = "ONE_LIGHT",
            .children_a_hit = 1,
            .lit_by_surfaces = true,
            .follows_eye = true,
            .random = true,
            .scatters = true,
            .always_bounces = true,
            .shadow_waves = 2,
            .straight_waves = STRAIGHT_WAVES,
            .shadow_rays_a_hit = one_each_for_lights_and_environment,
            .left_scene = "SHARES",
            .meets_lights = true,
            .defines = path_defines,
            .set = set_path,
            .prepare = prepare_environment_choice,
        },
};

const struct integrator *integrator_by_number(unsigned number)
{
    return number < sizeof(integrators) / sizeof(integrators[0]) ? &integrators[number] : NULL;
}
