/* SPDX-License-Identifier: MIT */
/* The order of a frame: update; for each sample the raster pass, then slice by slice primary hits and waves; at
 * last band by band resolve and readback. */
#include "render/frame.h"

#include "base/clock.h"
#include "render/camera.h"
#include "render/compact.h"
#include "render/comparison.h"
#include "render/context.h"
#include "render/integrator.h"
#include "render/picture.h"
#include "render/primary.h"
#include "render/tracer_set.h"
#include "render/wave_trace.h"
#include "shared/path.h"

#include <math.h>
#include <stdlib.h>

/* Pixels of a slice. Software GL has no latency to hide, and its caches are the CPU's; a GPU wants enough rays to
 * fill itself. Waves have room for twice as many: mirrors and glass rarely fill a slice. */
#define SLICE_PIXELS_SOFTWARE (1u << 16)
#define SLICE_PIXELS_HARDWARE (1u << 18)
#define WAVE_PER_SLICE 2
#define SIZE_MAX_PIXELS 16384u /* width and height; keeps the number of a pixel in 32 bits */
#define SPLITS_WAITING_MAX 32  /* halves of halves of at most 2^32 pixels */

enum frame_phase { PHASE_IDLE, PHASE_SAMPLE, PHASE_SLICE, PHASE_WAVE, PHASE_RESOLVE };

struct frame_renderer {
    struct gpu_device *device;
    struct scene_gpu scene;
    struct tracer_set tracers;
    struct integrator *integrator;
    struct render_context context;
    struct primary primary;
    struct picture picture;
    struct comparison *comparison; /* NULL: no frame has asked for one */
    const struct tracer_impl *stand_in;
    unsigned stand_in_number;
    uint32_t wanted_slice_pixels, wanted_wave_rays; /* 0: chosen */
    /* the frame in hand */
    enum frame_phase phase;
    bool rasterise;
    uint32_t slice_pixels;
    uint32_t sample, band;
    uint32_t next_slot;
    struct slice waiting[SPLITS_WAITING_MAX]; /* halves of a slice that overflowed */
    uint32_t waiting_count;
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
                   renderer->primary.depth.size_bytes + renderer->picture.resolved.capacity_bytes;
    for (uint32_t i = 0; i < renderer->picture.band_count; i++)
        sum += renderer->picture.bands[i].capacity_bytes;
    if (renderer->integrator)
        sum += renderer->integrator->impl->device_bytes(renderer->integrator);
    if (renderer->comparison)
        sum += comparison_device_bytes(renderer->comparison);
    return sum;
}

/* The session has checked what a client sent; this is what would go wrong here all the same. */
static bool check_request(const struct frame_renderer *renderer, const struct frame_request *request,
                          struct error *error)
{
    if (request->width == 0 || request->height == 0 || request->width > SIZE_MAX_PIXELS ||
        request->height > SIZE_MAX_PIXELS)
        return error_set(error, ERROR_INVALID, "width", "a picture of %ux%u pixels; 1 to %u are possible",
                         request->width, request->height, SIZE_MAX_PIXELS);
    if (request->samples == 0)
        return error_set(error, ERROR_INVALID, "samples", "a picture of no samples");
    if (!find_tracer(renderer, request->tracer, "tracer", error) ||
        (request->compare && !find_tracer(renderer, request->compare_with, "compare_with", error)))
        return false;
    if (!integrator_impl_by_number(request->integrator))
        return error_set(error, ERROR_UNSUPPORTED, "integrator", "there is no integrator number %u",
                         (unsigned)request->integrator);
    if (picture_pixel_bytes(request->format) == 0)
        return error_set(error, ERROR_UNSUPPORTED, "format", "there is no pixel format number %u",
                         (unsigned)request->format);
    for (int i = 0; i < 12; i++)
        if (!isfinite(request->camera.world_from_view[i]))
            return error_set(error, ERROR_INVALID, "camera", "its transform is not finite");
    if (!(request->camera.fov_y >= 0.0f && request->camera.fov_y < 3.14159f))
        return error_set(error, ERROR_INVALID, "camera.fov_y", "%g radians; 0 to below pi are possible",
                         (double)request->camera.fov_y);
    if (request->camera.fov_y == 0.0f &&
        !(request->camera.ortho_height > 0.0f && isfinite(request->camera.ortho_height)))
        return error_set(error, ERROR_INVALID, "camera.height", "an orthographic camera of height %g",
                         (double)request->camera.ortho_height);
    return true;
}

static bool update_scene(struct frame_renderer *renderer, const struct scene *scene,
                         const struct scene_motion *motion, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct frame_request *request = &context->request;
    struct scene_changes changes = {0};
    bool updated = scene_gpu_update(&renderer->scene, scene, motion, &changes, &context->times, error);
    tracer_set_note(&renderer->tracers, updated ? &changes : NULL);
    if (!updated)
        return false;
    renderer->result.uploaded_bytes = changes.uploaded_bytes;
    context->tracer = tracer_set_get(&renderer->tracers, &renderer->scene,
                                     find_tracer(renderer, request->tracer, "tracer", error),
                                     &request->tracer_options, &context->times, error);
    if (!context->tracer)
        return false;
    renderer->result.uploaded_bytes += context->tracer->stats.uploaded_bytes;
    renderer->result.structure_bytes = context->tracer->stats.device_bytes;
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
    struct tracer *second = tracer_set_get(&renderer->tracers, &renderer->scene,
                                           find_tracer(renderer, request->compare_with, "compare_with", error),
                                           &request->tracer_options, NULL, error);
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
    return context_reserve(context, renderer->slice_pixels, error) &&
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
    if (!picture_begin(&renderer->picture, context, error))
        return false;
    uint32_t slice = renderer->device->facts.software ? SLICE_PIXELS_SOFTWARE : SLICE_PIXELS_HARDWARE;
    if (renderer->wanted_slice_pixels)
        slice = renderer->wanted_slice_pixels;
    uint32_t slots = picture_slot_count(&renderer->picture);
    renderer->slice_pixels = slice < slots ? slice : slots;
    context->wave_capacity =
        at_least(renderer->wanted_wave_rays ? renderer->wanted_wave_rays : renderer->slice_pixels * WAVE_PER_SLICE,
                 renderer->slice_pixels);
    if (!reserve_waves(renderer, error))
        return false;
    /* A picture too large for the visibility buffer is traced from the first ray: the same hits, another way. */
    renderer->rasterise = context->request.primary == PRIMARY_RASTER && !context->request.compare &&
                          primary_reserve(&renderer->primary, context, NULL);
    return true;
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
    stage_times_begin(&context->times);
    if (!update_scene(renderer, scene, motion, error) || !begin_comparison(renderer, error))
        return false;
    camera_fill_uniforms(&context->uniforms, request, &renderer->scene);
    environment_fill_uniforms(&context->environment, &context->uniforms, &renderer->scene);
    context->uniforms.depth = request->depth;
    context->uniforms.seed = (uint32_t)(request->seed ^ request->seed >> 32);
    if (!reserve_frame(renderer, error) || !gpu_check(renderer->device, "beginning a frame", error))
        return false;
    renderer->result.revision = renderer->scene.revision;
    renderer->sample = renderer->band = 0;
    renderer->phase = PHASE_SAMPLE;
    return true;
}

void frame_abandon(struct frame_renderer *renderer)
{
    if (renderer->phase != PHASE_IDLE)
        gpu_timer_collect(renderer->context.timer, NULL);
    renderer->context.span_count = 0;
    renderer->waiting_count = 0;
    picture_drop_pixels(&renderer->picture);
    renderer->phase = PHASE_IDLE;
}

static bool begin_sample(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    const struct frame_request *request = &context->request;
    camera_jitter(context->uniforms.jitter_pixel, request->seed, renderer->sample, request->samples);
    context->uniforms.jitter_pixel[3] = 1.0f / sqrtf((float)request->samples);
    context->uniforms.sample_index = renderer->sample;
    context->wave_number = 0;
    renderer->next_slot = 0;
    renderer->phase = PHASE_SLICE;
    return context_upload_uniforms(context, error) &&
           (!renderer->rasterise || primary_rasterise(&renderer->primary, context, error));
}

/* The next slice of this sample; false: there is none. */
static bool take_slice(struct frame_renderer *renderer)
{
    struct slice *slice = &renderer->context.slice;
    if (renderer->waiting_count > 0) {
        *slice = renderer->waiting[--renderer->waiting_count];
        return true;
    }
    if (renderer->next_slot >= picture_slot_count(&renderer->picture))
        return false;
    uint32_t band_left = picture_band_end(&renderer->picture, renderer->next_slot) - renderer->next_slot;
    slice->first_slot = renderer->next_slot;
    slice->slot_count = band_left < renderer->slice_pixels ? band_left : renderer->slice_pixels;
    renderer->next_slot += slice->slot_count;
    return true;
}

static bool begin_slice(struct frame_renderer *renderer, struct error *error)
{
    if (!take_slice(renderer)) {
        renderer->sample++;
        renderer->phase = renderer->sample < renderer->context.request.samples ? PHASE_SAMPLE : PHASE_RESOLVE;
        return true;
    }
    renderer->phase = PHASE_WAVE;
    return primary_slice(renderer->rasterise ? &renderer->primary : NULL, &renderer->context, error) &&
           gpu_check(renderer->device, "primary hits", error);
}

/* A wave did not fit. Nothing of the slice has reached the picture, so it is done again: as two halves, or, where
 * one pixel's rays alone are too many, with more room. */
static bool split_slice(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    struct slice *slice = &context->slice;
    renderer->result.splits++;
    if (context->comparison)
        comparison_drop_slice(context->comparison);
    renderer->phase = PHASE_SLICE;
    if (slice->slot_count == 1) {
        if (context->wave_capacity > renderer->device->facts.storage_block_bytes_max / sizeof(struct child) / 8)
            return error_set(error, ERROR_LIMIT, "depth", "the rays of one pixel are more than the device holds");
        context->wave_capacity *= 2;
        renderer->waiting[renderer->waiting_count++] = *slice;
        return reserve_waves(renderer, error);
    }
    uint32_t half = slice->slot_count / 2;
    renderer->waiting[renderer->waiting_count++] =
        (struct slice){slice->first_slot + half, slice->slot_count - half};
    renderer->waiting[renderer->waiting_count++] = (struct slice){slice->first_slot, half};
    return true;
}

static bool trace_wave(struct render_context *context, struct error *error)
{
    const struct wave wave = {
        .kind = WAVE_CLOSEST,
        .ray_count = context->ray_count,
        .rays = &context->rays,
        .hits = &context->hits,
    };
    if (!wave_trace(context, RAY_SECONDARY, &wave, error))
        return false;
    context_span_begin(context, STAGE_SHADE);
    bool listed = compact_hits(context, error);
    context_span_end(context);
    return listed;
}

static bool shade_wave(struct frame_renderer *renderer, struct error *error)
{
    struct render_context *context = &renderer->context;
    switch (renderer->integrator->impl->shade(renderer->integrator, context, error)) {
    case INTEGRATOR_MORE:
        return trace_wave(context, error);
    case INTEGRATOR_OVERFLOW:
        return split_slice(renderer, error);
    case INTEGRATOR_DONE:
        renderer->result.shadow_rays += context->shadow_rays;
        renderer->result.secondary_rays += context->secondary_rays;
        renderer->phase = PHASE_SLICE;
        return (!context->comparison || comparison_keep_slice(context->comparison, error)) &&
               picture_accumulate(&renderer->picture, context, error);
    case INTEGRATOR_FAILED:
        break;
    }
    return false;
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
    result->samples = request->samples;
    result->primary_rays = (uint64_t)request->width * request->height * request->samples;
    result->times = context->times;
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
    case PHASE_SLICE:
        good = begin_slice(renderer, error);
        break;
    case PHASE_WAVE:
        good = shade_wave(renderer, error);
        break;
    case PHASE_RESOLVE:
        renderer->context.wave_number = 0;
        good = picture_resolve_band(&renderer->picture, &renderer->context, renderer->band, error) &&
               picture_read_band(&renderer->picture, &renderer->context, renderer->band, error);
        renderer->band++;
        break;
    }
    if (!good) {
        frame_abandon(renderer);
        return FRAME_FAILED;
    }
    if (renderer->phase != PHASE_RESOLVE || renderer->band < renderer->picture.band_count)
        return FRAME_MORE;
    if (hand_out(renderer, result, error))
        return FRAME_DONE;
    frame_abandon(renderer);
    return FRAME_FAILED;
}
