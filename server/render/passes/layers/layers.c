/* SPDX-License-Identifier: MIT */
#include "render/passes/layers/layers.h"

#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/integrator.h"
#include "render/waves/trace.h"
#include "shared/layers.h"
#include "shared/light.h"
#include "shared/ray.h"

#include <epoxy/gl.h>

_Static_assert(LAYER_BIT_BEAUTY == 1 << LAYER_BEAUTY && LAYER_BIT_ALBEDO == 1 << LAYER_ALBEDO &&
                   LAYER_BIT_NORMAL == 1 << LAYER_NORMAL && LAYER_BIT_DEPTH == 1 << LAYER_DEPTH &&
                   LAYER_BIT_POSITION == 1 << LAYER_POSITION && LAYER_BIT_AO == 1 << LAYER_AO &&
                   LAYER_BIT_ID == 1 << LAYER_ID && LAYER_BIT_UNKNOWN == 1 << LAYER_UNKNOWN &&
                   LAYER_BITS_CRYPTO_OBJECT == 7 << LAYER_CRYPTO_OBJECT0 &&
                   LAYER_BITS_CRYPTO_MATERIAL == 7 << LAYER_CRYPTO_MATERIAL0 &&
                   LAYER_BIT_MOTION == 1 << LAYER_MOTION && LAYER_BITS_ALL >> LAYER_COUNT == 0 &&
                   LAYER_BITS_ALL >> (LAYER_COUNT - 1) == 1 && LAYER_BIT_STICKING == 1u << LAYER_STICKING &&
                   LAYER_COUNT <= LAYER_STICKING,
               "shaders know the layers by other numbers");
_Static_assert(LAYER_BIT_DIFFUSE_DIRECT == 1u << LAYER_DIFFUSE_DIRECT &&
                   LAYER_BIT_DIFFUSE_INDIRECT == 1u << LAYER_DIFFUSE_INDIRECT &&
                   LAYER_BIT_SPECULAR_DIRECT == 1u << LAYER_SPECULAR_DIRECT &&
                   LAYER_BIT_SPECULAR_INDIRECT == 1u << LAYER_SPECULAR_INDIRECT &&
                   LAYER_BIT_TRANSMISSION == 1u << LAYER_TRANSMISSION &&
                   LAYER_BIT_EMISSION == 1u << LAYER_EMISSION && LAYER_BIT_BACKGROUND == 1u << LAYER_BACKGROUND &&
                   LAYER_BIT_LIGHT_REST == 1u << LAYER_LIGHT_REST &&
                   LAYER_BITS_LIGHT_GROUPS == 0xffu << LAYER_LIGHT_REST &&
                   LAYER_LIGHT_REST + (int)LIGHT_GROUPS_MAX - 1 == LAYER_LIGHT_GROUP7,
               "shaders know the layers by other numbers");

bool layers_of_first_sample(enum layer layer)
{
    return layer == LAYER_DEPTH || layer == LAYER_POSITION || layer == LAYER_ID || layer == LAYER_MOTION;
}

bool layers_are_of_light(enum layer layer)
{
    return 1u << layer & LAYER_BITS_LIGHT;
}

void layers_begin(struct layers *layers, struct render_context *context, bool is_shaded)
{
    const struct frame_request *request = &context->request;
    layers->wanted = frame_request_planes(request) & ~LAYER_BIT_BEAUTY;
    layers->environment_group = context->scene->scene->environment.light_group;
    layers->covers_by_shading = layers->wanted & LAYER_BITS_CRYPTO && is_shaded &&
                                (context->features.blend || request->integrator == INTEGRATOR_RAYCAST);
    context->covers = layers->covers_by_shading ? &layers->covers : NULL;
}

/* Planes of BIND_COVERS. */
static uint32_t cover_waves(const struct layers *layers)
{
    if (!(layers->wanted & LAYER_BITS_CRYPTO))
        return 0;
    return layers->covers_by_shading ? COVERS_MAX : 1;
}

bool layers_reserve(struct layers *layers, struct render_context *context, uint32_t slice_samples,
                    struct error *error)
{
    struct gpu_device *device = context->device;
    if (!layers->wanted) {
        layers_finish(layers, device);
        return true;
    }
    size_t planes = (size_t)__builtin_popcount(layers->wanted & ~LAYER_BITS_CRYPTO) + layers_have_light(layers);
    size_t covers = (size_t)cover_waves(layers) * slice_samples;
    size_t rays = layers->wanted & LAYER_BIT_AO ? context->wave_capacity : 0;
    size_t times = context->scene->has_motion ? rays : 0;
    return gpu_buffer_reserve(device, &layers->sums, planes * slice_samples * sizeof(vec4), error) &&
           gpu_buffer_reserve(device, &layers->covers, covers * sizeof(uvec4), error) &&
           gpu_buffer_reserve(device, &layers->ao_rays, rays * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &layers->ao_times, times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &layers->ao_visibility, rays * sizeof(uint), error);
}

bool layers_are_shaded(const struct layers *layers)
{
    return layers->covers_by_shading || layers_have_light(layers);
}

void layers_begin_slice(struct layers *layers, const struct render_context *context)
{
    layers->noted = false;
    layers->noting = layers->wanted;
    layers->asked = layers->asking = 0;
    layers->plane_samples = context->slice.slot_count << context->uniforms.sample_shift;
}

/* The layer's plane in the sums. */
static uint32_t plane_of(const struct layers *layers, uint32_t layer_bit)
{
    return (uint32_t)__builtin_popcount(layers->wanted & ~LAYER_BITS_CRYPTO & (layer_bit - 1));
}

bool layers_have_light(const struct layers *layers)
{
    return layers->wanted & LAYER_BITS_LIGHT;
}

size_t layers_light_defines(const struct layers *layers, struct gpu_define defines[LAYERS_LIGHT_DEFINES])
{
    size_t n = 0;
    if (layers_have_light(layers))
        defines[n++] = (struct gpu_define){"LIGHT_LAYERS", "1"};
    if (layers->wanted & LAYER_BITS_LIGHT_GROUPS)
        defines[n++] = (struct gpu_define){"LIGHT_GROUPS", "1"};
    return n;
}

void layers_bind_light(struct layers *layers, const struct gpu_program *program)
{
    if (!layers_have_light(layers))
        return;
    gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
    gpu_uniform_uint(program, "light_layers", layers->wanted & ~LAYER_BITS_CRYPTO);
    gpu_uniform_uint(program, "plane_samples", layers->plane_samples);
    if (layers->wanted & LAYER_BITS_LIGHT_GROUPS)
        gpu_uniform_uint(program, "environment_group", layers->environment_group);
}

uint32_t layers_take_unknown(struct layers *layers)
{
    layers->noting = layers->wanted & ~LAYER_BIT_UNKNOWN;
    return layers->noting == layers->wanted ? UINT32_MAX
                                            : plane_of(layers, LAYER_BIT_UNKNOWN) * layers->plane_samples;
}

/* A program that reads hits, in use, with all that these have bound; each of `own`: a define of its own, or NULL.
 */
static const struct gpu_program *use(struct render_context *context, const char *compute, const char *const own[2],
                                     struct error *error)
{
    struct gpu_define defines[CONTEXT_SURFACE_DEFINES + 4] = {0};
    size_t n = context_surface_defines(context, defines);
    for (int i = 0; i < 2; i++)
        if (own[i])
            defines[n++] = (struct gpu_define){own[i], "1"};
    if (context->scene->has_motion)
        defines[n++] = (struct gpu_define){"HAS_TIMES", "1"};
    const struct gpu_program *program = context_use_with(context, compute, defines, error);
    if (!program)
        return NULL;
    context_bind_hits(context);
    gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
    return program;
}

static bool note_sticking(struct layers *layers, struct render_context *context, struct error *error)
{
    const bool sticks = integrator_by_number(context->request.integrator)->follows_eye;
    const char *const own[2] = {sticks ? "STICKS" : NULL,
                                context->features.area_lights ? "HAS_AREA_LIGHTS" : NULL};
    const uint32_t first = context->slice.first_slot, end = first + context->slice.slot_count;
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = use(context, "render/sticking.comp", own, error);
    if (program) {
        gpu_buffer_bind_texels(context->device, environment_lights(context->environment, context->scene),
                               UNIT_SHADE_LIGHTS, GL_RGBA32F);
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "slot_count", context->slice.slot_count);
        gpu_uniform_uint(program, "first_sum", plane_of(layers, LAYER_BIT_STICKING) * layers->plane_samples);
        gpu_dispatch(context->device, program, ((end + 3) / 4 - first / 4) << context->uniforms.sample_shift);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "what sticks", error);
}

/* The plane of what first surfaces do comes behind those of light, of which it is one. */
static uint32_t light_planes_end(const struct layers *layers)
{
    const uint32_t planes = (uint32_t)__builtin_popcount(layers->wanted & ~LAYER_BITS_CRYPTO);
    return layers_have_light(layers) ? planes + 1 : 0;
}

/* All but how open a place is, which begins with 0. */
static bool note_hits(struct layers *layers, struct render_context *context, struct error *error)
{
    bool needs_surface = layers->noting & (LAYER_BIT_ALBEDO | LAYER_BIT_NORMAL);
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program =
        use(context, "render/layers.comp", (const char *const[2]){needs_surface ? "NEEDS_SURFACE" : NULL}, error);
    if (program) {
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "ray_count", context->ray_count);
        gpu_uniform_uint(program, "layers", layers->wanted);
        gpu_uniform_uint(program, "noting", layers->noting);
        gpu_uniform_uint(program, "first_light_plane", plane_of(layers, LAYER_BIT_DIFFUSE_DIRECT));
        gpu_uniform_uint(program, "end_light_plane", light_planes_end(layers));
        gpu_dispatch(context->device, program, context->ray_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "layers", error);
}

static bool begin_covers(struct layers *layers, struct render_context *context, struct error *error)
{
    if (!(layers->noting & LAYER_BITS_CRYPTO))
        return true;
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use(context, "render/layers_covers.comp", error);
    if (program) {
        gpu_buffer_bind_texels(context->device, &context->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
        gpu_buffer_bind_storage(&layers->covers, BIND_COVERS);
        gpu_uniform_uint(program, "ray_count", context->ray_count);
        gpu_uniform_uint(program, "cover_waves", cover_waves(layers));
        gpu_uniform_uint(program, "are_known", !layers->covers_by_shading);
        gpu_dispatch(context->device, program, context->ray_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "what covers samples", error);
}

/* Whether the current slice has anything to add: for some layers, samples after the first are zero. */
static bool adds(const struct render_context *context, enum layer layer)
{
    return context->uniforms.sample_index == 0 || !layers_of_first_sample(layer);
}

static bool note_motion(struct layers *layers, struct render_context *context, struct error *error)
{
    if (!(layers->noting & LAYER_BIT_MOTION) || !adds(context, LAYER_MOTION))
        return true;
    const struct gpu_define defines[] = {{context->scene->has_motion ? "HAS_MOTION" : NULL, "1"}, {0}};
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use_with(context, "render/layers_motion.comp", defines, error);
    if (program) {
        context_bind_hits(context);
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        moves_bind(&layers->moves, &context->request, program);
        gpu_uniform_uint(program, "first_slot", context->slice.first_slot);
        gpu_uniform_uint(program, "ray_count", context->ray_count);
        gpu_uniform_uint(program, "first_sum", plane_of(layers, LAYER_BIT_MOTION) * layers->plane_samples);
        gpu_dispatch(context->device, program, context->ray_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "motion", error);
}

static bool make_ao_rays(struct layers *layers, struct render_context *context, uint32_t count,
                         struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = use(context, "render/layers_ao.comp", (const char *const[2]){NULL}, error);
    if (program) {
        gpu_buffer_bind_storage(&layers->ao_rays, BIND_SHADOW_RAYS);
        if (context->scene->has_motion)
            gpu_buffer_bind_storage(&layers->ao_times, BIND_RAY_TIMES);
        gpu_uniform_uint(program, "first_ray", layers->asked);
        gpu_uniform_uint(program, "batch_rays", count);
        gpu_uniform_uint(program, "all_rays", context_ao_rays(context));
        gpu_uniform_float(program, "reach", context_ao_distance(context));
        gpu_uniform_float(program, "falloff", context->request.ao_falloff);
        compact_dispatch(context, program, WAVE_HITS);
    }
    context_span_end(context);
    return program != NULL;
}

/* A part of those that were made. */
static bool trace_ao_rays(struct layers *layers, struct render_context *context, bool *done, struct error *error)
{
    struct wave wave = {
        .kind = WAVE_ANY,
        .rays = &layers->ao_rays,
        .visibility = &layers->ao_visibility,
        .times = context->scene->has_motion ? &layers->ao_times : NULL,
    };
    const bool begins = !context->trace_state->in_progress; /* its rays are counted once */
    return compact_shadow_rays(context, layers->asking, begins, &wave, error) &&
           wave_trace(context, RAY_SHADOW, &wave, done, error);
}

static bool gather_ao(struct layers *layers, struct render_context *context, uint32_t count, struct error *error)
{
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use(context, "render/layers_gather.comp", error);
    if (program) {
        gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
        gpu_buffer_bind_storage(&layers->ao_visibility, BIND_VISIBILITY);
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "ray_count", context->ray_count);
        gpu_uniform_uint(program, "batch_rays", count);
        gpu_uniform_uint(program, "all_rays", context_ao_rays(context));
        gpu_uniform_uint(program, "plane", plane_of(layers, LAYER_BIT_AO));
        compact_dispatch(context, program, WAVE_HITS);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "ambient occlusion", error);
}

bool layers_mark_unknown(struct layers *layers, struct render_context *context, struct error *error)
{
    const bool may_be_unknown = context->tracer->impl->depends_on & CHANGED_VIEW;
    if (!(layers->wanted & LAYER_BIT_UNKNOWN) || !may_be_unknown)
        return true;
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use(context, "render/layers_unknown.comp", error);
    if (program) {
        context_bind_hits(context);
        gpu_buffer_bind_storage(&layers->sums, BIND_LAYER_SUMS);
        gpu_uniform_uint(program, "first_sum", plane_of(layers, LAYER_BIT_UNKNOWN) * layers->plane_samples);
        compact_dispatch(context, program, WAVE_RAYS);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "unknown rays", error);
}

static bool any_adds(const struct layers *layers, const struct render_context *context)
{
    for (enum layer layer = LAYER_ALBEDO; layer <= LAYER_STICKING; layer++)
        if (layers->noting & ~(LAYER_BITS_CRYPTO | LAYER_BIT_MOTION) & 1u << layer && adds(context, layer))
            return true;
    return false;
}

bool layers_step(struct layers *layers, struct render_context *context, bool *done, struct error *error)
{
    uint32_t all = layers->wanted & LAYER_BIT_AO && context->hit_count > 0 ? context_ao_rays(context) : 0;
    if (!layers->noted) {
        layers->noted = true;
        *done = all == 0;
        return (!any_adds(layers, context) || note_hits(layers, context, error)) &&
               begin_covers(layers, context, error) && note_motion(layers, context, error) &&
               (!(layers->noting & LAYER_BIT_STICKING) || note_sticking(layers, context, error));
    }
    if (layers->asking == 0) {
        uint32_t left = all - layers->asked, together = context->wave_capacity / context->hit_count;
        layers->asking = left < together ? left : together;
        return make_ao_rays(layers, context, layers->asking, error);
    }
    bool traced = false;
    if (!trace_ao_rays(layers, context, &traced, error))
        return false;
    if (!traced)
        return true;
    const uint32_t count = layers->asking;
    layers->asking = 0;
    layers->asked += count;
    *done = layers->asked == all;
    return gather_ao(layers, context, count, error);
}

/* Adds what covers the slice to the ranks of one kind, objects or materials: its planes are those in `bits`. */
static bool rank_covers(struct layers *layers, struct picture *picture, struct render_context *context,
                        uint32_t bits, struct error *error)
{
    static const unsigned points[CRYPTO_PLANES] = {BIND_ACCUMULATION, BIND_PASS_1, BIND_PASS_2};
    static const char *const counts[] = {"1", "2", "3"};
    const uint32_t wanted = layers->wanted & bits;
    const uint32_t first = (uint32_t)__builtin_popcount(picture->layers & ((wanted & -wanted) - 1));
    const uint32_t count = (uint32_t)__builtin_popcount(wanted);
    if (!wanted)
        return true;
    struct gpu_define defines[4] = {{"PLANES", counts[count - 1]}};
    size_t n = 1;
    if (bits == LAYER_BITS_CRYPTO_MATERIAL)
        defines[n++] = (struct gpu_define){"MATERIALS", "1"};
    if (context->tile_samples)
        defines[n++] = (struct gpu_define){"HAS_TILE_SAMPLES", "1"};
    context_span_begin(context, STAGE_SHADE);
    const struct gpu_program *program = context_use_with(context, "render/layers_rank.comp", defines, error);
    if (program) {
        uint32_t first_slot;
        const uint32_t band = picture_slice_band_number(picture, &context->slice, &first_slot);
        context_bind(context);
        if (context->tile_samples)
            gpu_buffer_bind_texels(context->device, context->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
        for (uint32_t i = 0; i < count; i++)
            gpu_buffer_bind_storage(picture_band(picture, first + i, band), points[i]);
        gpu_buffer_bind_storage(&layers->covers, BIND_COVERS);
        gpu_uniform_uint(program, "first_picture_slot", context->slice.first_slot);
        gpu_uniform_uint(program, "first_slot", first_slot);
        gpu_uniform_uint(program, "slot_count", context->slice.slot_count);
        gpu_uniform_uint(program, "sample_shift", context->uniforms.sample_shift);
        gpu_uniform_uint(program, "cover_waves", cover_waves(layers));
        gpu_dispatch(context->device, program, context->slice.slot_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "ranks of what covers pixels", error);
}

bool layers_accumulate(struct layers *layers, struct picture *picture, struct render_context *context,
                       struct error *error)
{
    for (uint32_t plane = 0; plane < picture->plane_count; plane++) {
        enum layer layer = picture_plane_layer(picture, plane);
        if (layer == LAYER_BEAUTY || LAYER_BITS_CRYPTO >> layer & 1 || !adds(context, layer))
            continue;
        uint32_t first_sum = plane_of(layers, 1u << layer) * layers->plane_samples;
        if (!picture_accumulate(picture, context, plane, &layers->sums, first_sum, error))
            return false;
    }
    return rank_covers(layers, picture, context, LAYER_BITS_CRYPTO_OBJECT, error) &&
           rank_covers(layers, picture, context, LAYER_BITS_CRYPTO_MATERIAL, error);
}

uint64_t layers_device_bytes(const struct layers *layers)
{
    return layers->sums.capacity_bytes + layers->covers.capacity_bytes + moves_device_bytes(&layers->moves) +
           layers->ao_rays.capacity_bytes + layers->ao_times.capacity_bytes + layers->ao_visibility.capacity_bytes;
}

void layers_finish(struct layers *layers, struct gpu_device *device)
{
    gpu_buffer_finish(device, &layers->sums);
    gpu_buffer_finish(device, &layers->covers);
    moves_finish(&layers->moves, device);
    gpu_buffer_finish(device, &layers->ao_rays);
    gpu_buffer_finish(device, &layers->ao_times);
    gpu_buffer_finish(device, &layers->ao_visibility);
    *layers = (struct layers){0};
}
