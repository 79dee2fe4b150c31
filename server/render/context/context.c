/* SPDX-License-Identifier: MIT */
#include "render/context/context.h"

#include "base/clock.h"
#include "render/passes/key_view/key_view.h"
#include "shared/bindings.h"
#include "shared/hit.h"
#include "shared/key_view.h"
#include "shared/path.h"
#include "shared/ray.h"
#include "shared/wave.h"

#include <epoxy/gl.h>

/* A little below what the timer's ring holds: spans beyond it would lose their GPU time. */
#define SPANS_MAX 240

#define AO_RAYS_DEFAULT 8               /* lambda of the paper on voxels and A-buffers */
#define AO_DISTANCE_DEFAULT (1 / 10.0f) /* of the scene's diagonal */

void context_span_begin(struct render_context *context, enum stage stage)
{
    gpu_timer_begin(context->timer, stage, context->wave_number);
    context->span_count++;
}

void context_span_end(struct render_context *context)
{
    gpu_timer_end(context->timer);
    if (context->span_count >= SPANS_MAX && context->counts_on_host)
        context_collect(context);
    else if (context->span_count >= SPANS_MAX)
        context_collect_done(context);
}

/* A frame of many slices and samples has more spans than a record holds; what is of one stage, clock and wave
 * becomes one, which begins where the first of them did. */
static void add_span(struct stage_times *times, uint64_t origin_ns, const struct stage_span *span)
{
    for (uint32_t i = 0; i < times->count; i++) {
        struct stage_span *own = &times->spans[i];
        if (own->stage == span->stage && own->clock == span->clock && own->wave == span->wave) {
            own->duration_ns += span->duration_ns;
            return;
        }
    }
    stage_times_add(times, span->stage, span->clock, span->wave, origin_ns + span->start_ns, span->duration_ns);
}

void context_add_times(struct render_context *context, const struct stage_times *spans)
{
    for (uint32_t i = 0; i < spans->count; i++)
        add_span(&context->times, spans->origin_ns, &spans->spans[i]);
}

static struct stage_times *no_spans(struct render_context *context)
{
    struct stage_times *spans = &context->collected;
    spans->origin_ns = context->times.origin_ns;
    spans->count = 0;
    return spans;
}

void context_collect(struct render_context *context)
{
    struct stage_times *spans = no_spans(context);
    gpu_timer_collect(context->timer, spans);
    context_add_times(context, spans);
    context->span_count = 0;
}

void context_collect_done(struct render_context *context)
{
    struct stage_times *spans = no_spans(context);
    context->span_count = (uint32_t)gpu_timer_collect_done(context->timer, spans);
    context_add_times(context, spans);
}

void context_add_cpu_time(struct render_context *context, enum stage stage, uint64_t start_ns)
{
    const struct stage_span span = {
        .stage = stage,
        .clock = CLOCK_CPU,
        .wave = context->wave_number,
        .start_ns = start_ns - context->times.origin_ns,
        .duration_ns = clock_now_ns() - start_ns,
    };
    add_span(&context->times, context->times.origin_ns, &span);
}

const struct gpu_program *context_use_with(struct render_context *context, const char *compute,
                                           const struct gpu_define *defines, struct error *error)
{
    const struct gpu_program_source source = {.compute = compute, .defines = defines};
    return gpu_program_get(context->device, &source, error);
}

const struct gpu_program *context_use(struct render_context *context, const char *compute, struct error *error)
{
    return context_use_with(context, compute, NULL, error);
}

void context_bind_tiles(const struct render_context *context, const struct gpu_program *program)
{
    struct key_view *key = context->marked_key;
    if (!key)
        return;
    gpu_buffer_bind_texels(context->device, &key->tiles, UNIT_KEY_TILES, GL_R32UI);
    gpu_uniform_uint(program, "first_tile", key->first_tile[context->layer]);
}

void context_bind(struct render_context *context)
{
    gpu_scene_bind(context->scene);
    gpu_buffer_bind_uniform(&context->uniform_buffer, UNIFORM_FRAME);
    gpu_buffer_bind_uniform(&context->wave_state, UNIFORM_WAVE);
}

size_t context_surface_defines(const struct render_context *context, struct gpu_define *defines)
{
    /* Only discs have textures that are not applied already. */
    bool exact = !context->sampled_hits || context->scene->disc_count > 0;
    const struct scene_features *features = &context->features;
    const struct {
        bool has;
        const char *define;
    } rows[CONTEXT_SURFACE_DEFINES] = {
        {context->sampled_hits, "HAS_SAMPLED"},
        {features->textures && exact, "HAS_TEXTURES"},
        {features->bump && exact, "HAS_BUMP"},
        {features->textures && exact && context->scene->has_spheres, "HAS_SPHERES"},
        {!features->glass, "NO_GLASS"},
        {!features->blend, "NO_BLEND"},
        {features->volume, "HAS_VOLUME"},
        {features->specular, "HAS_SPECULAR"},
        {features->clearcoat, "HAS_CLEARCOAT"},
        {features->iridescence, "HAS_IRIDESCENCE"},
        {features->sheen, "HAS_SHEEN"},
        {features->diffuse_transmission, "HAS_DIFFUSE_TRANSMISSION"},
        {features->dispersion, "HAS_DISPERSION"},
        {features->thin_walls, "HAS_THIN_WALLS"},
        {features->anisotropy, "HAS_ANISOTROPY"},
        {features->anisotropy_map, "HAS_ANISOTROPY_MAP"},
    };
    size_t n = 0;
    for (size_t i = 0; i < CONTEXT_SURFACE_DEFINES; i++)
        if (rows[i].has)
            defines[n++] = (struct gpu_define){rows[i].define, "1"};
    return n;
}

void context_bind_sums(const struct render_context *context)
{
    const size_t samples = (size_t)context->slice.slot_count << context->uniforms.sample_shift;
    gpu_buffer_bind_storage_part(context->sums, samples * sizeof(vec4), BIND_SLICE_SUMS);
}

void context_bind_hits(struct render_context *context)
{
    context_bind(context);
    gpu_buffer_bind_texels(context->device, &context->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(context->device, &context->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
    gpu_buffer_bind_texels(context->device, &context->paths, UNIT_SHADE_PATHS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&context->hit_list, BIND_HIT_LIST);
}

/* Numbers of lights share a word with what paths know of emitters. */
bool context_samples_emitters(const struct render_context *context)
{
    return context->scene->has_emitters && context->scene->light_count < PATH_LIGHT_MASK &&
           !(context->tracer->impl->sampled && context->scene->has_emissive_spheres);
}

uint32_t context_ao_rays(const struct render_context *context)
{
    return context->request.ao_rays > 0 ? context->request.ao_rays : AO_RAYS_DEFAULT;
}

float context_ao_distance(const struct render_context *context)
{
    float asked = context->request.ao_distance;
    return asked > 0.0f ? asked : context->scene->diagonal * AO_DISTANCE_DEFAULT;
}

bool context_upload_uniforms(struct render_context *context, struct error *error)
{
    return gpu_buffer_upload(context->device, &context->uniform_buffer, &context->uniforms,
                             sizeof(context->uniforms), error);
}

bool context_reserve(struct render_context *context, uint32_t slice_samples, struct error *error)
{
    struct gpu_device *device = context->device;
    size_t capacity = context->wave_capacity;
    size_t times = context->scene->has_motion ? capacity : 0;
    size_t blocks = (capacity + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
    return gpu_buffer_reserve(device, &context->rays, capacity * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &context->ray_times, times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &context->paths, capacity * sizeof(struct path), error) &&
           gpu_buffer_reserve(device, &context->hits, capacity * sizeof(struct hit), error) &&
           gpu_buffer_reserve(device, &context->hit_list, capacity * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &context->hit_places, capacity * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &context->block_offsets, blocks * OCTANTS * 2 * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &context->wave_state, sizeof(struct wave_state), error) &&
           gpu_buffer_reserve(device, &context->slice_sums, slice_samples * sizeof(vec4), error);
}

struct gpu_buffer *context_ray_times(struct render_context *context)
{
    return context->scene->has_motion ? &context->ray_times : NULL;
}

uint64_t context_device_bytes(const struct render_context *context)
{
    return context->rays.capacity_bytes + context->ray_times.capacity_bytes + context->paths.capacity_bytes +
           context->hits.capacity_bytes + context->hit_list.capacity_bytes + context->hit_places.capacity_bytes +
           context->block_offsets.capacity_bytes + context->wave_state.capacity_bytes +
           context->slice_sums.capacity_bytes;
}

void context_finish(struct render_context *context)
{
    struct gpu_device *device = context->device;
    gpu_buffer_finish(device, &context->rays);
    gpu_buffer_finish(device, &context->ray_times);
    gpu_buffer_finish(device, &context->paths);
    gpu_buffer_finish(device, &context->hits);
    gpu_buffer_finish(device, &context->hit_list);
    gpu_buffer_finish(device, &context->hit_places);
    gpu_buffer_finish(device, &context->block_offsets);
    gpu_buffer_finish(device, &context->wave_state);
    gpu_buffer_finish(device, &context->slice_sums);
    gpu_buffer_finish(device, &context->uniform_buffer);
}
