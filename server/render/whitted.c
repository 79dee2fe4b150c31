/* SPDX-License-Identifier: MIT */
/* Whitted. An Improved Illumination Model for Shaded Display. 1980: at each hit the light of every lamp that a
 * shadow ray reaches, and a ray each for what is mirrored and what is refracted. What a hit sends out is in
 * shaders/render/whitted.comp. */
#include "render/compact.h"
#include "render/integrator.h"
#include "render/wave_trace.h"

#include "shared/bindings.h"
#include "shared/hit.h"
#include "shared/path.h"
#include "shared/ray.h"
#include "shared/wave.h"

#include <epoxy/gl.h>
#include <stdlib.h>

/* Waves beyond the depth that are left to rays which go straight on through blended surfaces: those do not
 * count as bounces. */
#define BLEND_LAYERS_MAX 16
/* Shadow rays traced at once, in waves. */
#define SHADOW_WAVES 2

struct whitted {
    struct integrator base;
    struct gpu_buffer radiance, children, child_counts;
    struct gpu_buffer shadow_rays, visibility, light_samples;
};

/* What the scan over the blocks leaves in the wave state's free words. */
#define WAVE_STATE_SHADOW_RAYS pad0

static void whitted_destroy(struct integrator *integrator)
{
    struct whitted *whitted = (struct whitted *)integrator;
    if (!whitted)
        return;
    struct gpu_device *device = integrator->device;
    gpu_buffer_finish(device, &whitted->radiance);
    gpu_buffer_finish(device, &whitted->children);
    gpu_buffer_finish(device, &whitted->child_counts);
    gpu_buffer_finish(device, &whitted->shadow_rays);
    gpu_buffer_finish(device, &whitted->visibility);
    gpu_buffer_finish(device, &whitted->light_samples);
    free(whitted);
}

static struct integrator *whitted_create(struct gpu_device *device, struct error *error)
{
    struct whitted *whitted = calloc(1, sizeof(*whitted));
    if (!whitted) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the integrator");
        return NULL;
    }
    whitted->base = (struct integrator){&integrator_whitted_impl, device};
    return &whitted->base;
}

static bool whitted_reserve(struct integrator *integrator, struct render_context *context, struct error *error)
{
    struct whitted *whitted = (struct whitted *)integrator;
    struct gpu_device *device = integrator->device;
    size_t waves = context->wave_capacity;
    size_t shadows = context->uniforms.light_count > 0 ? waves * SHADOW_WAVES : 0;
    return gpu_buffer_reserve(device, &whitted->radiance, waves * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &whitted->children, waves * CHILDREN_MAX * sizeof(struct child), error) &&
           gpu_buffer_reserve(device, &whitted->child_counts, waves * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &whitted->shadow_rays, shadows * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &whitted->visibility, shadows * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &whitted->light_samples, shadows * sizeof(vec4), error);
}

static uint64_t whitted_device_bytes(const struct integrator *integrator)
{
    const struct whitted *whitted = (const struct whitted *)integrator;
    return whitted->radiance.capacity_bytes + whitted->children.capacity_bytes +
           whitted->child_counts.capacity_bytes + whitted->shadow_rays.capacity_bytes +
           whitted->visibility.capacity_bytes + whitted->light_samples.capacity_bytes;
}

static const struct gpu_program *use_environment_program(struct render_context *context, const char *compute,
                                                         struct error *error)
{
    static const struct gpu_define image[] = {{"HAS_ENVIRONMENT_IMAGE", "1"}, {NULL, NULL}};
    const struct gpu_program_source source = {
        .compute = compute, .defines = context->environment.kind == ENVIRONMENT_IMAGE ? image : NULL};
    const struct gpu_program *program = gpu_program_get(context->device, &source, error);
    if (program)
        glUseProgram(program->name);
    return program;
}

/* The paths that left the scene. */
static bool left_scene_pass(struct whitted *whitted, struct render_context *context, struct error *error)
{
    if (context->hit_count == context->ray_count)
        return true;
    context_bind(context);
    const struct gpu_program *program = use_environment_program(context, "render/left_scene.comp", error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "ray_count", context->ray_count);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    gpu_buffer_bind_storage(&context->hit_places, BIND_HIT_PLACES);
    gpu_buffer_bind_storage(&whitted->radiance, BIND_RADIANCE);
    context_span_begin(context, STAGE_SHADE);
    gpu_dispatch(context->device, program, context->ray_count);
    context_span_end(context);
    return true;
}

static const struct gpu_program *shade_program(const struct render_context *context, struct error *error)
{
    struct gpu_define defines[4] = {0};
    size_t n = 0;
    if (context->features.textures)
        defines[n++] = (struct gpu_define){"HAS_TEXTURES", "1"};
    if (context->features.bump)
        defines[n++] = (struct gpu_define){"HAS_BUMP", "1"};
    if (context->features.area_lights)
        defines[n++] = (struct gpu_define){"HAS_AREA_LIGHTS", "1"};
    const struct gpu_program_source source = {.compute = "render/whitted.comp", .defines = defines};
    const struct gpu_program *program = gpu_program_get(context->device, &source, error);
    if (program)
        glUseProgram(program->name);
    return program;
}

/* Surfaces, children and the shadow rays to lights first .. first + count - 1. */
static bool shade_pass(struct whitted *whitted, struct render_context *context, uint32_t first_light,
                       uint32_t light_count, struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    context_bind(context);
    const struct gpu_program *program = shade_program(context, error);
    if (!program) {
        context_span_end(context);
        return false;
    }
    bool last = context->wave_number >= context->request.depth + BLEND_LAYERS_MAX;
    gpu_uniform_uint(program, "hit_count", context->hit_count);
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    gpu_uniform_uint(program, "first_light", first_light);
    gpu_uniform_uint(program, "batch_lights", light_count);
    gpu_uniform_uint(program, "wave_number", context->wave_number);
    gpu_uniform_uint(program, "last_wave", last);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->hits, BIND_HITS);
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    gpu_buffer_bind_storage(&whitted->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&whitted->children, BIND_CHILDREN);
    gpu_buffer_bind_storage(&whitted->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&whitted->light_samples, BIND_LIGHT_SAMPLES);
    gpu_buffer_bind_storage(&whitted->shadow_rays, BIND_SHADOW_RAYS);
    gpu_dispatch(context->device, program, context->hit_count);
    context_span_end(context);
    return true;
}

static bool trace_shadows(struct whitted *whitted, struct render_context *context, uint32_t light_count,
                          struct error *error)
{
    struct wave wave = {
        .kind = WAVE_ANY,
        .ray_count = context->hit_count * light_count,
        .rays = &whitted->shadow_rays,
        .visibility = &whitted->visibility,
    };
    return wave_trace(context, RAY_SHADOW, &wave, error);
}

static bool gather_pass(struct whitted *whitted, struct render_context *context, bool first, uint32_t light_count,
                        struct error *error)
{
    const struct gpu_program *program = context_use(context, "render/gather.comp", error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "ray_count", context->ray_count);
    gpu_uniform_uint(program, "hit_count", context->hit_count);
    gpu_uniform_uint(program, "batch_lights", light_count);
    gpu_uniform_uint(program, "first_batch", first);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    gpu_buffer_bind_storage(&whitted->radiance, BIND_RADIANCE);
    gpu_buffer_bind_storage(&context->hit_places, BIND_HIT_PLACES);
    gpu_buffer_bind_storage(&whitted->visibility, BIND_VISIBILITY);
    gpu_buffer_bind_storage(&whitted->light_samples, BIND_LIGHT_SAMPLES);
    gpu_buffer_bind_storage(&context->slice_pixels, BIND_SLICE_PIXELS);
    context_span_begin(context, STAGE_SHADE);
    gpu_dispatch(context->device, program, context->ray_count);
    context_span_end(context);
    return true;
}

static bool move_children(struct whitted *whitted, struct render_context *context, struct error *error)
{
    const struct gpu_program *program = context_use(context, "render/compact_move.comp", error);
    if (!program)
        return false;
    gpu_uniform_uint(program, "hit_count", context->hit_count);
    gpu_buffer_bind_storage(&whitted->child_counts, BIND_CHILD_COUNTS);
    gpu_buffer_bind_storage(&context->block_offsets, BIND_BLOCK_OFFSETS);
    gpu_buffer_bind_storage(&whitted->children, BIND_CHILDREN);
    gpu_buffer_bind_storage(&context->rays, BIND_RAYS);
    gpu_buffer_bind_storage(&context->paths, BIND_PATHS);
    gpu_dispatch(context->device, program, context->hit_count);
    return true;
}

/* Light by light, as many at once as there is room for shadow rays. */
static bool direct_light(struct whitted *whitted, struct render_context *context, struct error *error)
{
    uint32_t lights = context->uniforms.light_count, together = lights, first = 0;
    if (context->hit_count > 0)
        together = context->wave_capacity * SHADOW_WAVES / context->hit_count;
    do {
        uint32_t count = lights - first < together ? lights - first : together;
        if (context->hit_count > 0 && (!shade_pass(whitted, context, first, count, error) ||
                                       (count > 0 && !trace_shadows(whitted, context, count, error))))
            return false;
        if (!gather_pass(whitted, context, first == 0, count, error))
            return false;
        first += count;
    } while (first < lights);
    return true;
}

static enum integrator_progress next_wave(struct whitted *whitted, struct render_context *context,
                                          struct error *error)
{
    struct wave_state state = {0};
    if (context->hit_count == 0)
        return INTEGRATOR_DONE;
    const struct gpu_program *count = context_use(context, "render/compact_count.comp", error);
    if (!count)
        return INTEGRATOR_FAILED;
    gpu_buffer_bind_storage(&whitted->child_counts, BIND_CHILD_COUNTS);
    gpu_uniform_uint(count, "hit_count", context->hit_count);
    if (!compact_scan(context, count, context->hit_count, &state, error))
        return INTEGRATOR_FAILED;
    context->shadow_rays += state.WAVE_STATE_SHADOW_RAYS;
    if (state.ray_count == 0)
        return INTEGRATOR_DONE;
    if (state.ray_count > context->wave_capacity)
        return INTEGRATOR_OVERFLOW;
    if (!move_children(whitted, context, error))
        return INTEGRATOR_FAILED;
    context->ray_count = state.ray_count;
    context->secondary_rays += state.ray_count;
    return INTEGRATOR_MORE;
}

static enum integrator_progress whitted_shade(struct integrator *integrator, struct render_context *context,
                                              struct error *error)
{
    struct whitted *whitted = (struct whitted *)integrator;
    if (!left_scene_pass(whitted, context, error) || !direct_light(whitted, context, error))
        return INTEGRATOR_FAILED;
    context_span_begin(context, STAGE_SHADE);
    enum integrator_progress progress = next_wave(whitted, context, error);
    context_span_end(context);
    context->wave_number++;
    return progress;
}

const struct integrator_impl integrator_whitted_impl = {
    .name = "whitted",
    .create = whitted_create,
    .destroy = whitted_destroy,
    .reserve = whitted_reserve,
    .device_bytes = whitted_device_bytes,
    .shade = whitted_shade,
};

const struct integrator_impl *integrator_impl_by_number(unsigned number)
{
    static const struct integrator_impl *const impls[] = {[INTEGRATOR_WHITTED] = &integrator_whitted_impl};
    return number < sizeof(impls) / sizeof(impls[0]) ? impls[number] : NULL;
}
