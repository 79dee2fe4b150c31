/* SPDX-License-Identifier: MIT */
#include "render/waves/shading.h"

#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/passes/ground/ground.h"
#include "render/passes/layers/layers.h"
#include "render/waves/trace.h"

#include "shared/bindings.h"
#include "shared/hit.h"
#include "shared/layers.h"
#include "shared/path.h"
#include "shared/ray.h"

#include <epoxy/gl.h>

#define DEFINES_MAX                                                                                               \
    (INTEGRATOR_DEFINES_MAX + CONTEXT_SURFACE_DEFINES + LAYERS_LIGHT_DEFINES + 3) /* and what ends them */

bool wave_passes_reserve(struct wave_passes *passes, struct render_context *context, struct error *error)
{
    const struct integrator *integrator = passes->integrator;
    struct gpu_device *device = context->device;
    size_t waves = context->wave_capacity, children = waves * integrator->children_a_hit;
    size_t shadows = ground_shadow_rays(context, passes->integrator) > 0 ? waves * integrator->shadow_waves : 0;
    size_t samples = layers_have_light(context->layers) ? 2 * shadows : shadows;
    size_t shadow_times = context->scene->has_motion ? shadows : 0;
    if ((integrator->prepare && !integrator->prepare(context, error)) ||
        !ground_prepare(context, integrator, error))
        return false;
    return gpu_buffer_reserve(device, &passes->radiance, waves * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &passes->children, children * sizeof(struct child), error) &&
           gpu_buffer_reserve(device, &passes->child_counts, waves * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &passes->shadow_rays, shadows * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &passes->shadow_times, shadow_times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &passes->visibility, shadows * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &passes->light_samples, samples * sizeof(vec4), error);
}

void wave_passes_finish(struct wave_passes *passes, struct gpu_device *device)
{
    gpu_buffer_finish(device, &passes->radiance);
    gpu_buffer_finish(device, &passes->children);
    gpu_buffer_finish(device, &passes->child_counts);
    gpu_buffer_finish(device, &passes->shadow_rays);
    gpu_buffer_finish(device, &passes->shadow_times);
    gpu_buffer_finish(device, &passes->visibility);
    gpu_buffer_finish(device, &passes->light_samples);
    *passes = (struct wave_passes){0};
}

uint64_t wave_passes_device_bytes(const struct wave_passes *passes)
{
    return passes->radiance.capacity_bytes + passes->children.capacity_bytes +
           passes->child_counts.capacity_bytes + passes->shadow_rays.capacity_bytes +
           passes->shadow_times.capacity_bytes + passes->visibility.capacity_bytes +
           passes->light_samples.capacity_bytes;
}

static void bind_shading(struct wave_passes *passes, struct render_context *context)
{
    context_bind_hits(context);
    gpu_buffer_bind_texels(context->device, environment_lights(context->environment, context->scene),
                           UNIT_SHADE_LIGHTS, GL_RGBA32F);
    gpu_buffer_bind_storage(&passes->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&passes->children, BIND_CHILDREN);
    gpu_buffer_bind_storage(&passes->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&passes->light_samples, BIND_LIGHT_SAMPLES);
    gpu_buffer_bind_storage(&passes->shadow_rays, BIND_SHADOW_RAYS);
    if (context->scene->has_motion)
        gpu_buffer_bind_storage(&passes->shadow_times, BIND_RAY_TIMES);
}

/* The integrator's program, in use, with the scene and everything that shade.glsl names bound and set. */
static const struct gpu_program *shade_program(struct wave_passes *passes, struct render_context *context,
                                               struct error *error)
{
    const struct integrator *integrator = passes->integrator;
    struct gpu_define defines[DEFINES_MAX] = {0};
    size_t n = integrator->defines ? integrator->defines(context, defines) : 0;
    n += context_surface_defines(context, defines + n);
    if (context->features.area_lights)
        defines[n++] = (struct gpu_define){"HAS_AREA_LIGHTS", "1"};
    if (context->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    n += layers_light_defines(context->layers, defines + n);
    const struct gpu_program *program = context_use_with(context, integrator->shader, defines, error);
    if (!program)
        return NULL;
    bool last = context->wave_number >= context->request.depth + integrator->straight_waves;
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    gpu_uniform_uint(program, "wave_number", context->wave_number);
    gpu_uniform_uint(program, "last_wave", last);
    gpu_uniform_uint(program, "children_a_hit", integrator->children_a_hit);
    gpu_uniform_uint(program, "shadow_rays_a_hit", integrator->shadow_rays_a_hit(context));
    gpu_uniform_float(program, "radiance_limit", frame_request_radiance_limit(&context->request));
    bind_shading(passes, context);
    layers_bind_light(context->layers, program);
    return program;
}

/* Over the hits, of which there are some: shadow rays first .. first + count - 1 of each; where first is 0 also
 * what the hit sends out, and its children. */
static bool shade_hits(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                       struct error *error)
{
    const uint32_t own = passes->integrator->shadow_rays_a_hit(context);
    const bool is_own = first == 0 || first < own; /* the rest are the ground's */
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = shade_program(passes, context, error);
    if (program && is_own) {
        gpu_uniform_uint(program, "first_ray", first);
        gpu_uniform_uint(program, "batch_rays", count < own - first ? count : own - first);
        if (passes->integrator->set)
            passes->integrator->set(context, program);
        compact_dispatch(context, program, WAVE_HITS);
    }
    const bool shaded = program && ground_shade(context, passes->integrator, first, count, error);
    context_span_end(context);
    return shaded;
}

/* The shadow rays that were made, a part of them. */
static bool trace_shadows(struct wave_passes *passes, struct render_context *context, bool *done,
                          struct error *error)
{
    struct wave wave = {
        .kind = WAVE_ANY,
        .rays = &passes->shadow_rays,
        .visibility = &passes->visibility,
        .times = context->scene->has_motion ? &passes->shadow_times : NULL,
    };
    return compact_shadow_rays(context, context->asking, false, &wave, error) &&
           wave_trace(context, RAY_SHADOW, &wave, done, error);
}

static const struct gpu_program *gather_program(const struct wave_passes *passes, struct render_context *context,
                                                struct error *error)
{
    const struct integrator *integrator = passes->integrator;
    const bool meets_lights = integrator->meets_lights && context->features.area_lights;
    const char *const names[] = {
        integrator->gather,
        ground_is_shown(context, integrator) ? "GROUND" : NULL,
        context->environment->kind == ENVIRONMENT_IMAGE ? "HAS_ENVIRONMENT_IMAGE" : NULL,
        integrator->left_scene,
        meets_lights ? "HAS_AREA_LIGHTS" : NULL,
        meets_lights && context_samples_emitters(context) ? "HAS_EMITTERS" : NULL,
        context->covers ? "COVERS" : NULL,
    };
    struct gpu_define defines[sizeof(names) / sizeof(names[0]) + LAYERS_LIGHT_DEFINES + 1] = {0};
    size_t n = 0;
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
        if (names[i])
            defines[n++] = (struct gpu_define){names[i], "1"};
    (void)layers_light_defines(context->layers, defines + n);
    return context_use_with(context, "render/gather.comp", defines, error);
}

/* Adds the light that they let through to the wave's radiance, and after the last batch that to the samples, with
 * what the paths that left the scene bring home. */
static bool gather(struct wave_passes *passes, struct render_context *context, bool last, uint32_t rays_a_hit,
                   struct error *error)
{
    const struct gpu_program *program = gather_program(passes, context, error);
    if (!program)
        return false;
    context_bind(context);
    gpu_uniform_uint(program, "batch_rays", rays_a_hit);
    gpu_uniform_uint(program, "last_batch", last);
    gpu_uniform_float(program, "radiance_limit", frame_request_radiance_limit(&context->request));
    gpu_buffer_bind_texels(context->device, environment_lights(context->environment, context->scene),
                           UNIT_SHADE_LIGHTS, GL_RGBA32F);
    gpu_buffer_bind_texels(context->device, &context->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(context->device, &context->paths, UNIT_SHADE_PATHS, GL_RGBA32UI);
    gpu_buffer_bind_texels(context->device, &passes->light_samples, UNIT_PASS_0, GL_RGBA32F);
    gpu_buffer_bind_storage(&passes->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&context->hit_places, BIND_HIT_PLACES);
    gpu_buffer_bind_storage(&passes->visibility, BIND_VISIBILITY);
    if (context->covers) {
        gpu_buffer_bind_texels(context->device, &context->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
        gpu_buffer_bind_storage(context->covers, BIND_COVERS);
        gpu_uniform_uint(program, "wave_number", context->wave_number);
        gpu_uniform_uint(program, "sample_count", context->slice.slot_count << context->uniforms.sample_shift);
    }
    context_bind_sums(context);
    layers_bind_light(context->layers, program);
    context_span_begin(context, STAGE_SHADE);
    compact_dispatch(context, program, WAVE_RAYS);
    context_span_end(context);
    return true;
}

static const struct gpu_program *move_program(struct render_context *context, struct error *error)
{
    static const struct gpu_define times[] = {{"HAS_TIMES", "1"}, {NULL, NULL}};
    return context_use_with(context, "render/compact_move.comp", context->scene->has_motion ? times : NULL, error);
}

static bool move_children(struct wave_passes *passes, struct render_context *context, struct error *error)
{
    const struct gpu_program *program = move_program(context, error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "children_a_hit", passes->integrator->children_a_hit);
    gpu_buffer_bind_storage(&passes->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_buffer_bind_texels(context->device, &passes->children, UNIT_MOVE_CHILDREN, GL_RGBA32UI);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    if (context->scene->has_motion)
        gpu_buffer_bind_storage(&context->ray_times, BIND_RAY_TIMES);
    compact_dispatch(context, program, WAVE_HITS);
    return true;
}

static enum wave_progress make_wave(struct wave_passes *passes, struct render_context *context,
                                    struct error *error)
{
    const bool last_queued = !context->counts_on_host && context->wave_number + 1 == context->waves_queued;
    if (context->hit_count == 0)
        return WAVE_DONE;
    const struct compact_order order = {.children_a_hit = passes->integrator->children_a_hit,
                                        .last_queued = last_queued,
                                        .sorts = passes->integrator->scatters};
    if (!compact_children(context, &order, &passes->child_counts, error))
        return WAVE_FAILED;
    if (context->counts_on_host && context->known_state.stopped)
        return WAVE_OVERFLOW;
    if (last_queued || context->ray_count == 0)
        return WAVE_DONE;
    return move_children(passes, context, error) ? WAVE_MORE : WAVE_FAILED;
}

/* The children become the context's rays and paths; counts the wave. */
static enum wave_progress next_wave(struct wave_passes *passes, struct render_context *context,
                                    struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    enum wave_progress progress = make_wave(passes, context, error);
    context_span_end(context);
    context->asked = 0;
    context->wave_number++;
    return progress;
}

/* How many shadow rays of each hit are made and traced together. */
static uint32_t batch_of(const struct wave_passes *passes, const struct render_context *context)
{
    if (context->hit_count == 0)
        return 0;
    uint32_t left = ground_shadow_rays(context, passes->integrator) - context->asked;
    uint32_t together = context->wave_capacity * passes->integrator->shadow_waves / context->hit_count;
    return left < together ? left : together;
}

/* Shades, and makes a batch of shadow rays. */
static bool shade_batch(struct wave_passes *passes, struct render_context *context, struct error *error)
{
    context->asking = batch_of(passes, context);
    return context->hit_count == 0 || shade_hits(passes, context, context->asked, context->asking, error);
}

static enum wave_progress finish_batch(struct wave_passes *passes, struct render_context *context,
                                       struct error *error)
{
    const uint32_t count = context->asking;
    context->asking = 0;
    context->asked += count;
    bool last = context->hit_count == 0 || context->asked == ground_shadow_rays(context, passes->integrator);
    if (!gather(passes, context, last, count, error))
        return WAVE_FAILED;
    return last ? next_wave(passes, context, error) : WAVE_AGAIN;
}

enum wave_progress wave_passes_shade(struct wave_passes *passes, struct render_context *context,
                                     struct error *error)
{
    if (context->asking == 0) {
        if (!shade_batch(passes, context, error))
            return WAVE_FAILED;
        return context->asking > 0 ? WAVE_AGAIN : finish_batch(passes, context, error);
    }
    bool done = false;
    if (!trace_shadows(passes, context, &done, error))
        return WAVE_FAILED;
    return done ? finish_batch(passes, context, error) : WAVE_AGAIN;
}

void wave_passes_announce_hits(struct wave_passes *passes, struct render_context *context)
{
    (void)shade_program(passes, context, NULL);
}

void wave_passes_announce_long(struct wave_passes *passes, struct render_context *context)
{
    const struct wave shadows = {.kind = WAVE_ANY,
                                 .times = context->scene->has_motion ? &passes->shadow_times : NULL};
    if (ground_shadow_rays(context, passes->integrator) > 0)
        wave_announce(context, &shadows);
    if (context->scene->instance_count > 0)
        (void)shade_program(passes, context, NULL);
}

void wave_passes_announce_shading(struct wave_passes *passes, struct render_context *context)
{
    if (context->scene->instance_count > 0)
        (void)shade_program(passes, context, NULL);
    (void)gather_program(passes, context, NULL);
}

static void announce_bounces(struct wave_passes *passes, struct render_context *context)
{
    const struct wave bounces = {.kind = WAVE_CLOSEST, .times = context_ray_times(context)};
    context->sampled_hits = context->tracer->impl->sampled;
    (void)move_program(context, NULL);
    wave_announce(context, &bounces);
    (void)shade_program(passes, context, NULL);
}

bool wave_passes_expect_bounces(const struct wave_passes *passes, const struct render_context *context)
{
    const struct integrator *integrator = passes->integrator;
    return context->scene->instance_count > 0 && context->request.depth > 0 &&
           (integrator->always_bounces || (integrator->mirrors && context->features.mirrors));
}

void wave_passes_announce(struct wave_passes *passes, struct render_context *context)
{
    const struct integrator *integrator = passes->integrator;
    compact_announce_hits(context);
    (void)gather_program(passes, context, NULL);
    compact_announce_children(context, integrator->scatters);
    if (wave_passes_expect_bounces(passes, context))
        announce_bounces(passes, context);
}
