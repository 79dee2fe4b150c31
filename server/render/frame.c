/* SPDX-License-Identifier: MIT */
/* The order of a frame: update; for each sample, or for some together, the raster pass, then slice by slice
 * primary hits, layers and waves; at last band by band resolve and readback. */
#include "render/frame.h"

#include "base/clock.h"
#include "render/camera.h"
#include "render/compact.h"
#include "render/comparison.h"
#include "render/context.h"
#include "render/frame_request.h"
#include "render/integrator.h"
#include "render/layers.h"
#include "render/picture.h"
#include "render/pixel_filter.h"
#include "render/primary.h"
#include "render/sequence.h"
#include "render/slices.h"
#include "render/tracer_set.h"
#include "render/wave_trace.h"
#include "shared/path.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* Rays of a slice. Software GL has no latency to hide, and its caches are the CPU's; a GPU wants enough rays to
 * fill itself. Waves have room for twice as many: mirrors and glass rarely fill a slice. A step traces no more
 * than that: on software GL, where incoherent rays take about half a microsecond each, a few milliseconds. */
#define SLICE_RAYS_SOFTWARE (1u << 14)
#define SLICE_RAYS_HARDWARE (1u << 18)
#define WAVE_PER_SLICE 2
/* Textures of a picture that goes on and on are taken as if it had so many samples. */
#define SAMPLES_GOING_ON 16

enum frame_phase {
    PHASE_IDLE,
    PHASE_SAMPLE,
    PHASE_RASTER,
    PHASE_SLICE,
    PHASE_LAYERS,
    PHASE_SHADE,
    PHASE_TRACE,
    PHASE_RESOLVE
};

struct frame_renderer {
    struct gpu_device *device;
    struct scene_gpu scene;
    struct tracer_set tracers;
    struct integrator *integrator;
    struct render_context context;
    struct primary primary;
    struct picture picture;
    struct layers layers;
    struct comparison *comparison; /* NULL: no frame has asked for one */
    const struct tracer_impl *stand_in;
    unsigned stand_in_number;
    uint32_t wanted_slice_pixels, wanted_wave_rays; /* 0: chosen */
    /* the frame in hand */
    enum frame_phase phase;
    bool rasterise;
    uint32_t samples_before; /* that the picture holds of the frames that this one goes on from */
    uint32_t sample;         /* samples of this frame that are done */
    uint32_t plane, band;    /* of the picture that is handed out next */
    struct slices slices;
    /* the last frame that was finished, whose sum the picture holds */
    struct frame_request kept_request;
    uint32_t kept_samples;      /* 0: there is none */
    struct frame_result result; /* counts, until the last step hands it out */
};

void frame_result_finish(struct frame_result *result)
{
    free(result->pixels);
    free(result->comparisons);
    *result = (struct frame_result){0};
}

struct frame_renderer *frame_renderer_create(struct gpu_device *device, struct error *error)
{
    struct frame_renderer *renderer = calloc(1, sizeof(*renderer));
    if (!renderer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a renderer");
        return NULL;
    }
    renderer->device = device;
    scene_gpu_init(&renderer->scene, device);
    renderer->context.device = device;
    renderer->context.scene = &renderer->scene;
    renderer->context.timer = gpu_timer_create(device);
    if (!renderer->context.timer) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the frame's timer");
        frame_renderer_destroy(renderer);
        return NULL;
    }
    return renderer;
}

static void destroy_integrator(struct frame_renderer *renderer)
{
    if (renderer->integrator)
        renderer->integrator->impl->destroy(renderer->integrator);
    renderer->integrator = NULL;
}

void frame_renderer_destroy(struct frame_renderer *renderer)
{
    if (!renderer)
        return;
    destroy_integrator(renderer);
    comparison_destroy(renderer->comparison);
    tracer_set_finish(&renderer->tracers);
    primary_finish(&renderer->primary, renderer->device);
    picture_finish(&renderer->picture, renderer->device);
    layers_finish(&renderer->layers, renderer->device);
    context_finish(&renderer->context);
    gpu_timer_destroy(renderer->context.timer);
    scene_gpu_finish(&renderer->scene);
    free(renderer);
}

void frame_renderer_set_capacity(struct frame_renderer *renderer, uint32_t slice_pixels, uint32_t wave_rays)
{
    renderer->wanted_slice_pixels = slice_pixels;
    renderer->wanted_wave_rays = wave_rays;
}

void frame_renderer_stand_in(struct frame_renderer *renderer, unsigned number, const struct tracer_impl *impl)
{
    renderer->stand_in = impl;
    renderer->stand_in_number = number;
}

static const struct tracer_impl *find_tracer(const struct frame_renderer *renderer, unsigned number,
                                             const char *field, struct error *error)
{
    bool stands_in = renderer->stand_in && renderer->stand_in_number == number;
    return stands_in ? renderer->stand_in : tracer_find(number, field, error);
}

uint64_t frame_renderer_device_bytes(const struct frame_renderer *renderer)
{
    uint64_t sum = scene_gpu_device_bytes(&renderer->scene) + tracer_set_device_bytes(&renderer->tracers) +
                   context_device_bytes(&renderer->context) + renderer->primary.visible.size_bytes +
                   renderer->primary.depth.size_bytes + picture_device_bytes(&renderer->picture) +
                   layers_device_bytes(&renderer->layers);
    if (renderer->integrator)
        sum += renderer->integrator->impl->device_bytes(renderer->integrator);
    if (renderer->comparison)
        sum += comparison_device_bytes(renderer->comparison);
    return sum;
}

static bool check_request(const struct frame_renderer *renderer, const struct frame_request *request,
                          struct error *error)
{
    return frame_request_check(request, error) && find_tracer(renderer, request->tracer, "tracer", error) &&
           (!request->compare || find_tracer(renderer, request->compare_with, "compare_with", error));
}

/* Whether the picture that is kept shows what this frame will, once the scene has been updated. */
static bool may_go_on(const struct frame_renderer *renderer, const struct frame_request *request)
{
    return renderer->kept_samples > 0 && request->samples <= UINT32_MAX - renderer->kept_samples &&
           frame_request_adds_to(&renderer->kept_request, request);
}

static bool update_scene(struct frame_renderer *renderer, const struct scene *scene,
                         const struct scene_motion *motion, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct frame_request *request = &context->request;
    struct scene_changes changes = {0};
    uint64_t revision_before = renderer->scene.revision;
    bool updated = scene_gpu_update(&renderer->scene, scene, motion, &changes, &context->times, error);
    tracer_set_note(&renderer->tracers, updated ? &changes : NULL);
    if (!updated)
        return false;
    if (renderer->scene.revision != revision_before || changes.geometry || changes.deformed || changes.instances ||
        changes.shading || changes.lights)
        renderer->samples_before = 0;
    renderer->result.uploaded_bytes = changes.uploaded_bytes;
    const struct tracer_impl *impl = find_tracer(renderer, request->tracer, "tracer", error);
    context->tracer = tracer_check_motion(impl, &renderer->scene, error)
                          ? tracer_set_get(&renderer->tracers, &renderer->scene, impl, &request->tracer_options,
                                           &context->times, error)
                          : NULL;
    if (!context->tracer)
        return false;
    renderer->result.uploaded_bytes += context->tracer->stats.uploaded_bytes;
    renderer->result.structure_bytes = context->tracer->stats.device_bytes;
    memcpy(renderer->result.cubes, context->tracer->stats.cubes, sizeof(renderer->result.cubes));
    context->features = scene_features_of(scene);
    uint64_t start_ns = clock_now_ns();
    updated = environment_update(&context->environment, renderer->device, scene, &renderer->scene, error);
    stage_times_add(&context->times, STAGE_BUILD, STAGE_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return updated;
}

/* The second tracer's structure is no part of what the frame's own tracer cost. */
static bool begin_comparison(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct frame_request *request = &context->request;
    context->comparison = NULL;
    if (!request->compare) {
        comparison_destroy(renderer->comparison);
        renderer->comparison = NULL;
        return true;
    }
    uint64_t start_ns = clock_now_ns();
    const struct tracer_impl *impl = find_tracer(renderer, request->compare_with, "compare_with", error);
    if (!tracer_check_motion(impl, &renderer->scene, error))
        return false;
    struct tracer *second =
        tracer_set_get(&renderer->tracers, &renderer->scene, impl, &request->tracer_options, NULL, error);
    if (!renderer->comparison)
        renderer->comparison = comparison_create(renderer->device, error);
    if (!second || !renderer->comparison)
        return false;
    comparison_begin(renderer->comparison, &renderer->scene, context->tracer, second, request->compare_far_share);
    context->comparison = renderer->comparison;
    stage_times_add(&context->times, STAGE_COMPARE, STAGE_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return true;
}

static uint32_t at_least(uint32_t value, uint32_t least)
{
    return value > least ? value : least;
}

static bool reserve_waves(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    return context_reserve(context, renderer->slices.slice_rays, error) &&
           layers_reserve(&renderer->layers, context, renderer->slices.slice_rays, error) &&
           renderer->integrator->impl->reserve(renderer->integrator, context, error);
}

static bool reserve_frame(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct integrator_impl *impl = integrator_impl_by_number(context->request.integrator);
    if (!renderer->integrator || renderer->integrator->impl != impl) {
        destroy_integrator(renderer);
        renderer->integrator = impl->create(renderer->device, error);
        if (!renderer->integrator)
            return false;
    }
    if (!picture_begin(&renderer->picture, context, renderer->samples_before, error))
        return false;
    const struct frame_request *request = &context->request;
    bool flat = !(request->aperture > 0.0f) && !renderer->scene.has_motion;
    /* A picture too large for the visibility buffer is traced from the first ray: the same hits, another way. */
    renderer->rasterise = flat && request->primary == PRIMARY_RASTER && !request->compare &&
                          primary_reserve(&renderer->primary, context, NULL);
    uint32_t rays = renderer->device->facts.software ? SLICE_RAYS_SOFTWARE : SLICE_RAYS_HARDWARE;
    if (renderer->wanted_slice_pixels)
        rays = renderer->wanted_slice_pixels;
    uint64_t all = picture_slot_count(&renderer->picture);
    all *= renderer->rasterise ? 1 : SLICES_SAMPLES_TOGETHER;
    renderer->slices.slice_rays = rays < all ? rays : (uint32_t)all;
    uint32_t wave_rays = renderer->slices.slice_rays * WAVE_PER_SLICE;
    if (renderer->wanted_wave_rays)
        wave_rays = renderer->wanted_wave_rays;
    context->wave_capacity = at_least(wave_rays, renderer->slices.slice_rays);
    return reserve_waves(renderer, error);
}

/* They take a third of a millisecond, and stay from frame to frame. */
static void fill_filter(struct render_context *context)
{
    _Static_assert(sizeof(context->uniforms.filter_places) / sizeof(float) > PIXEL_FILTER_INTERVALS,
                   "room for all places");
    if (!context->spread || (context->has_filter && context->filter == context->request.filter))
        return;
    pixel_filter_places((float *)context->uniforms.filter_places, context->request.filter);
    context->filter = context->request.filter;
    context->has_filter = true;
}

bool frame_begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                 const struct frame_request *request, struct error *error)
{
    struct render_context *context = &renderer->context;
    frame_abandon(renderer);
    if (!check_request(renderer, request, error))
        return false;
    context->request = *request;
    renderer->result = (struct frame_result){0};
    renderer->samples_before = may_go_on(renderer, request) ? renderer->kept_samples : 0;
    renderer->kept_samples = 0; /* until this one is finished */
    stage_times_begin(&context->times);
    if (!update_scene(renderer, scene, motion, error) || !begin_comparison(renderer, error))
        return false;
    camera_fill_uniforms(&context->uniforms, request, &renderer->scene);
    environment_fill_uniforms(&context->environment, &context->uniforms, &renderer->scene);
    context->uniforms.depth = request->depth;
    context->uniforms.jitter_pixel[3] =
        1.0f / sqrtf(request->accumulate ? SAMPLES_GOING_ON : (float)request->samples);
    context->spread = request->samples > 1 || request->accumulate;
    fill_filter(context);
    context->uniforms.seed = (uint32_t)(request->seed ^ request->seed >> 32);
    if (!reserve_frame(renderer, error) || !gpu_check(renderer->device, "beginning a frame", error))
        return false;
    renderer->result.revision = renderer->scene.revision;
    renderer->sample = renderer->plane = renderer->band = 0;
    renderer->phase = PHASE_SAMPLE;
    return true;
}

void frame_abandon(struct frame_renderer *renderer)
{
    if (renderer->phase != PHASE_IDLE)
        gpu_timer_collect(renderer->context.timer, NULL);
    renderer->context.span_count = 0;
    picture_drop_pixels(&renderer->picture);
    renderer->phase = PHASE_IDLE;
}

/* Where all pixels have the sample in hand, if each does not have a place of its own. */
static void place_sample(struct frame_renderer *renderer)
{
    struct frame_uniforms *uniforms = &renderer->context.uniforms;
    uniforms->jitter_pixel[0] = uniforms->jitter_pixel[1] = 0.5f;
    if (!renderer->context.spread)
        return;
    float numbers[2];
    sequence_pair(numbers, sequence_seed(UINT32_MAX, uniforms->seed), SEQUENCE_PIXEL, uniforms->sample_index);
    for (int i = 0; i < 2; i++)
        uniforms->jitter_pixel[i] += pixel_filter_offset((const float *)uniforms->filter_places, numbers[i]);
}

static bool begin_sample(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    uint32_t left = context->request.samples - renderer->sample;
    context->uniforms.sample_index = renderer->samples_before + renderer->sample;
    context->uniforms.sample_shift = renderer->rasterise ? 0 : slices_sample_shift(&renderer->slices, left);
    /* One that is added to others has no group of its own. */
    context->uniforms.group_shift =
        context->request.accumulate ? 0 : slices_group_shift(context->request.samples, renderer->sample);
    place_sample(renderer);
    context->wave_number = 0;
    slices_restart(&renderer->slices);
    renderer->phase = renderer->rasterise ? PHASE_RASTER : PHASE_SLICE;
    primary_rasterise_begin(&renderer->primary);
    return context_upload_uniforms(context, error);
}

static bool rasterise(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!primary_rasterise(&renderer->primary, &renderer->context, &done, error))
        return false;
    renderer->phase = done ? PHASE_SLICE : PHASE_RASTER;
    return true;
}

static bool begin_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    uint32_t sample_shift = context->uniforms.sample_shift;
    if (!slices_take(&renderer->slices, &renderer->picture, sample_shift, &context->slice)) {
        renderer->sample += 1u << sample_shift;
        renderer->phase = renderer->sample < context->request.samples ? PHASE_SAMPLE : PHASE_RESOLVE;
        return true;
    }
    layers_begin_slice(&renderer->layers);
    renderer->phase = renderer->layers.wanted ? PHASE_LAYERS : PHASE_SHADE;
    return primary_slice(renderer->rasterise ? &renderer->primary : NULL, context, error) &&
           gpu_check(renderer->device, "primary hits", error);
}

/* A wave did not fit. Nothing of the slice has reached the picture, so it is done again: as two halves, or, where
 * one pixel's rays alone are too many, with more room. */
static bool split_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    renderer->result.splits++;
    if (context->comparison)
        comparison_drop_slice(context->comparison);
    renderer->phase = PHASE_SLICE;
    if (slices_split(&renderer->slices, &context->slice))
        return true;
    if (context->wave_capacity > renderer->device->facts.storage_block_bytes_max / sizeof(struct child) / 8)
        return error_set(error, ERROR_LIMIT, "depth", "the rays of one pixel are more than the device holds");
    context->wave_capacity *= 2;
    slices_put_back(&renderer->slices, &context->slice);
    return reserve_waves(renderer, error);
}

static bool trace_wave(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct wave wave = {
        .kind = WAVE_CLOSEST,
        .ray_count = context->ray_count,
        .rays = &context->rays,
        .hits = &context->hits,
        .times = context_ray_times(context),
    };
    renderer->phase = PHASE_SHADE;
    if (!wave_trace(context, RAY_SECONDARY, &wave, error))
        return false;
    context->sampled_hits = context->tracer->impl->sampled;
    context_span_begin(context, STAGE_SHADE);
    bool listed = compact_hits(context, error);
    context_span_end(context);
    return listed;
}

static bool finish_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    renderer->result.shadow_rays += context->shadow_rays;
    renderer->result.secondary_rays += context->secondary_rays;
    renderer->phase = PHASE_SLICE;
    bool has_beauty = renderer->picture.layers & 1u << LAYER_BEAUTY; /* then it is the first plane */
    return (!context->comparison || comparison_keep_slice(context->comparison, error)) &&
           (!has_beauty || picture_accumulate(&renderer->picture, context, 0, &context->slice_sums, 0, error)) &&
           layers_accumulate(&renderer->layers, &renderer->picture, context, error);
}

static bool note_layers(struct frame_renderer *renderer, struct error *error)
{
    bool done = false;
    if (!layers_step(&renderer->layers, &renderer->context, &done, error))
        return false;
    if (!done)
        return true;
    if (!(renderer->picture.layers & 1u << LAYER_BEAUTY))
        return finish_slice(renderer, error);
    renderer->phase = PHASE_SHADE;
    return true;
}

static bool shade_wave(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    switch (renderer->integrator->impl->shade(renderer->integrator, context, error)) {
    case INTEGRATOR_AGAIN:
        return true;
    case INTEGRATOR_MORE:
        renderer->phase = PHASE_TRACE;
        return true;
    case INTEGRATOR_OVERFLOW:
        return split_slice(renderer, error);
    case INTEGRATOR_DONE:
        return finish_slice(renderer, error);
    case INTEGRATOR_FAILED:
        break;
    }
    return false;
}

/* One band of one plane; the last one is followed by none. */
static bool read_band(struct frame_renderer *renderer, struct error *error)
{
    struct picture *picture = &renderer->picture;
    renderer->context.wave_number = 0;
    bool good = picture_resolve_band(picture, &renderer->context, renderer->plane, renderer->band, error) &&
                picture_read_band(picture, &renderer->context, renderer->plane, renderer->band, error);
    if (++renderer->band == picture->band_count) {
        renderer->band = 0;
        renderer->plane++;
    }
    return good;
}

static bool hand_out(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct frame_request *request = &context->request;
    if (context->comparison && !comparison_take(context->comparison, &renderer->result.comparisons,
                                                &renderer->result.comparison_count, error))
        return false;
    context_collect(context);
    stage_times_add(&context->times, STAGE_FRAME, STAGE_CPU, 0, context->times.origin_ns,
                    clock_now_ns() - context->times.origin_ns);
    *result = renderer->result;
    result->pixels = renderer->picture.pixels;
    result->size_bytes = renderer->picture.size_bytes;
    renderer->picture.pixels = NULL;
    result->width = request->width;
    result->height = request->height;
    result->format = request->format;
    result->samples = renderer->picture.samples;
    result->layers = renderer->picture.layers;
    result->primary_rays = (uint64_t)request->width * request->height * request->samples;
    result->times = context->times;
    renderer->kept_request = *request;
    renderer->kept_samples = result->samples;
    renderer->phase = PHASE_IDLE;
    return true;
}

enum frame_progress frame_step(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    bool good = false;
    switch (renderer->phase) {
    case PHASE_IDLE:
        error_set(error, ERROR_INTERNAL, NULL, "a step of no frame");
        return FRAME_FAILED;
    case PHASE_SAMPLE:
        good = begin_sample(renderer, error);
        break;
    case PHASE_RASTER:
        good = rasterise(renderer, error);
        break;
    case PHASE_SLICE:
        good = begin_slice(renderer, error);
        break;
    case PHASE_LAYERS:
        good = note_layers(renderer, error);
        break;
    case PHASE_SHADE:
        good = shade_wave(renderer, error);
        break;
    case PHASE_TRACE:
        good = trace_wave(renderer, error);
        break;
    case PHASE_RESOLVE:
        good = read_band(renderer, error);
        break;
    }
    if (!good) {
        frame_abandon(renderer);
        return FRAME_FAILED;
    }
    if (renderer->phase != PHASE_RESOLVE || renderer->plane < renderer->picture.plane_count)
        return FRAME_MORE;
    if (hand_out(renderer, result, error))
        return FRAME_DONE;
    frame_abandon(renderer);
    return FRAME_FAILED;
}
