/* SPDX-License-Identifier: MIT */
/* Makes a frame ready for its samples: its light, its uniforms, its sizes, and all of its buffers. */
#include "render/frame/ready.h"

#include "base/clock.h"
#include "render/compare/waves.h"
#include "render/context/camera.h"
#include "render/frame/announce.h"
#include "render/frame/check.h"
#include "render/frame/choices.h"
#include "render/frame/key.h"
#include "render/frame/samples.h"
#include "render/picture/pixel_filter.h"
#include "render/waves/compact.h"

#include <math.h>

/* The time of a step that reserves memory. */
#define RESERVE_NS UINT64_C(3000000)
/* Waves queued for a slice at first: few paths are longer, and waves without rays cost some dispatches each. */
#define WAVES_QUEUED_MAX 16
/* The time of a step that uploads and integrates an environment. */
#define ENVIRONMENT_STEP_NS UINT64_C(6000000)
/* Pixels that are rasterised together: more take a while to reserve and to clear. */
#define STRIP_PIXELS_MAX (1u << 22)
/* Pixels of all samples that are rasterised together: 64 MiB. */
#define LAYERS_PIXELS_MAX (1u << 23)
/* The number of samples that texture filtering assumes for a picture that accumulates without an end. */
#define SAMPLES_GOING_ON 16

/* Does a step of uploading and integrating the environment. */
static bool update_environment(struct frame_renderer *renderer, bool *done, struct error *error)
{
    struct frame_work *work = renderer->work;
    struct gpu_scene *copy = &renderer->shared->copy;
    uint64_t start_ns = clock_now_ns(), end_ns = start_ns + ENVIRONMENT_STEP_NS;
    bool updated = gpu_scene_upload_environment(copy, end_ns, done, error);
    if (!updated || !*done)
        return updated;
    struct environment *environment = &renderer->shared->environment;
    updated = environment_update(environment, renderer->device, copy, end_ns, done, error);
    bool lamps = environment->default_light && copy->has_lamps && work->frame.integrator->lit_by_surfaces;
    work->frame.environment = lamps ? &renderer->shared->no_environment : environment;
    stage_times_add(&work->device.times, STAGE_BUILD, CLOCK_CPU, 0, start_ns, clock_now_ns() - start_ns);
    return updated;
}

static bool begin_comparison(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    const struct frame_request *request = &work->frame.request;
    work->frame.comparison = NULL;
    if (!request->comparison.compare) {
        comparison_destroy(work->comparison);
        work->comparison = NULL;
        return true;
    }
    uint64_t start_ns = clock_now_ns();
    if (!work->comparison)
        work->comparison = comparison_create(renderer->device, error);
    if (!work->comparison)
        return false;
    comparison_begin(work->comparison, &renderer->shared->copy, work->frame.tracer, renderer->second,
                     request->comparison.compare_far);
    work->frame.comparison = work->comparison;
    context_add_cpu_time(&work->device, STAGE_COMPARE, start_ns);
    return true;
}

static uint32_t at_least(uint32_t value, uint32_t minimum)
{
    return value > minimum ? value : minimum;
}

static uint32_t slice_rays(const struct frame_renderer *renderer)
{
    if (renderer->wanted_slice_pixels)
        return renderer->wanted_slice_pixels;
    const struct render_frame *frame = &renderer->work->frame;
    return choices_slice_rays(renderer->device, frame->request.comparison.compare, frame->uniforms.light_count);
}

/* Number of waves to queue: one for each bounce and one before them, or a single one if hits send no rays;
 * more if a slice has needed more. */
static uint32_t waves_queued(const struct frame_renderer *renderer)
{
    struct frame_work *work = renderer->work;
    const uint32_t depth = work->frame.request.light.depth < WAVES_QUEUED_MAX ? work->frame.request.light.depth + 1
                                                                              : WAVES_QUEUED_MAX;
    const bool bounces = wave_shading_expects_bounces(&work->frame);
    return at_least(renderer->waves_needed, bounces ? depth : 1);
}

/* Rasterised samples are together only if that needs no more strips: in each all of the scene is drawn. */
static uint32_t sample_shift_max(const struct frame_renderer *renderer)
{
    const struct frame_request *request = &renderer->work->frame.request;
    const uint64_t strip_pixels = (uint64_t)request->picture.width * renderer->work->primary.strip_rows;
    uint32_t shift = 0;
    while (2u << shift <= SAMPLES_TOGETHER_MAX && 2u << shift <= request->sampling.samples &&
           (!renderer->work->primary.rasterises || strip_pixels << (shift + 1) <= LAYERS_PIXELS_MAX))
        shift++;
    return shift;
}

/* Rays per path: children of hits, and several lights at once, need more space than first hits. Memory that
 * is touched for the first time takes longer than most passes of a picture. */
static uint32_t rays_a_path(const struct frame_renderer *renderer)
{
    struct frame_work *work = renderer->work;
    const bool once = !work->frame.request.comparison.compare && !wave_shading_expects_bounces(&work->frame) &&
                      work->shading.extra->shadow_rays(&work->frame) <= 1;
    return once ? 1 : CHOICES_WAVE_PER_SLICE;
}

/* Sizes the picture, its slices and waves, before any buffer is reserved. */
static bool size_frame(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    if (!picture_begin(renderer->target, &work->frame, renderer->samples_before, error))
        return false;
    work->primary.rasterises = !renderer->key_tracer && choices_rasterise(&work->frame);
    if (!frame_check_moves(renderer, error))
        return false;
    work->primary.strip_rows = picture_strip_rows(renderer->target, STRIP_PIXELS_MAX);
    work->primary.sample_shift_max = sample_shift_max(renderer);
    uint32_t rays = slice_rays(renderer);
    uint64_t all = (uint64_t)picture_slot_count(renderer->target) << work->primary.sample_shift_max;
    rays = rays < all ? rays : (uint32_t)all;
    renderer->slice_rays_max = renderer->slices.slice_rays = rays;
    uint32_t wave_rays = rays * rays_a_path(renderer);
    if (renderer->wanted_wave_rays)
        wave_rays = renderer->wanted_wave_rays;
    work->wave.capacity = at_least(wave_rays, rays);
    work->device.counts_on_host = !renderer->queues_ahead || work->frame.request.comparison.compare ||
                                  work->frame.tracer->impl->traces_on_host;
    work->wave.waves_queued = waves_queued(renderer);
    work->frame.sums_in_picture = work->device.counts_on_host && renderer->target->samples == 1 &&
                                  renderer->target->layers & 1u << LAYER_BEAUTY && !work->frame.comparison &&
                                  !renderer->key_tracer && !work->frame.tile_samples &&
                                  !denoise_is_wanted(&work->frame);
    layers_begin(&work->layers, &work->frame, !frame_is_eyes_pass(renderer));
    work->shading.is_wanted = renderer->target->layers & 1u << LAYER_BEAUTY || layers_are_shaded(&work->layers);
    return frame_check_groups(renderer, error);
}

static bool reserve_frame(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    if (!picture_reserve(renderer->target, &work->frame, renderer->samples_before, error) ||
        !denoise_sums_begin(&renderer->denoise, &work->frame, renderer->target, renderer->samples_before,
                            &renderer->history, error))
        return false;
    renderer->picture.denoised = NULL;
    if (!samples_reserve(renderer, error))
        return false;
    compact_repeat(&work->wave);
    return true;
}

/* Places of a filter take a third of a millisecond, and stay from frame to frame. */
static void fill_filter(struct render_frame *frame)
{
    _Static_assert(sizeof(frame->uniforms.filter_places) / sizeof(float) > PIXEL_FILTER_INTERVALS,
                   "room for all places");
    if (!frame->spread || (frame->has_filter && frame->filter == frame->request.sampling.pixel_filter))
        return;
    pixel_filter_places((float *)frame->uniforms.filter_places, frame->request.sampling.pixel_filter);
    frame->filter = frame->request.sampling.pixel_filter;
    frame->has_filter = true;
}

/* Limits the request's samples, once it is known which samples the picture holds. */
static void limit_samples(const struct frame_renderer *renderer, struct frame_request *request)
{
    uint32_t before = renderer->samples_before, maximum = request->samples_max;
    if (!request->sampling.accumulate || !before)
        return;
    uint32_t lacking = !maximum ? UINT32_MAX : maximum > before ? maximum - before : 0;
    if (request->sampling.noise > 0.0f && renderer->picture.noise.going_on == 0)
        lacking = 0;
    request->sampling.samples = request->sampling.samples < lacking ? request->sampling.samples : lacking;
}

/* Sets the members that need no memory of the device. */
static bool set_up(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    const struct frame_request *request = &work->frame.request;
    limit_samples(renderer, &work->frame.request);
    camera_fill_uniforms(&work->frame.uniforms, request, &renderer->shared->copy);
    frame_key_limit_rows(renderer, &work->frame.request); /* the camera is that of all of them */
    environment_fill_uniforms(work->frame.environment, &work->frame.uniforms, &renderer->shared->copy);
    work->frame.display_values = renderer->shared->copy.scene->environment.value.display_values;
    work->frame.uniforms.depth = request->light.depth;
    work->frame.uniforms.far_width[2] = frame_request_hides_environment(request) ? 1.0f : 0.0f;
    /* Samples of a layer's texel all pass through its middle. */
    work->frame.spread =
        !frame_is_layer_pass(renderer) && (request->sampling.samples > 1 || frame_request_is_open_ended(request));
    work->frame.uniforms.far_width[1] =
        work->frame.spread ? 1.0f / sqrtf(frame_request_is_open_ended(request) ? SAMPLES_GOING_ON
                                                                               : (float)request->sampling.samples)
                           : 1.0f;
    fill_filter(&work->frame);
    work->frame.uniforms.seed = (uint32_t)(request->sampling.seed ^ request->sampling.seed >> 32);
    return size_frame(renderer, error);
}

/* Gets ready, once the tracers are brought to the scene. */
static bool get_ready(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    const struct frame_request *request = &work->frame.request;
    const bool goes_on = renderer->samples_before > 0;
    if (!begin_comparison(renderer, error) || (renderer->key_tracer && !frame_key_set_pass(renderer, error)) ||
        !set_up(renderer, error))
        return false;
    if (request->sampling.samples && !renderer->announced)
        announce_programs(renderer);
    if (!denoise_history_begin(&renderer->history, &work->frame, renderer->shared->showing, goes_on, error) ||
        !reserve_frame(renderer, error) || !gpu_check_reset(renderer->device, "beginning a frame", error))
        return false;
    renderer->result.revision = renderer->shared->copy.revision;
    renderer->sample = renderer->plane = renderer->band = renderer->copied = 0;
    renderer->copying = false;
    renderer->samples_phase = SAMPLES_BEGIN;
    renderer->announced = false;
    denoise_begin(&work->denoise, &renderer->denoise, &renderer->history, &renderer->picture);
    return request->sampling.samples || context_upload_uniforms(&work->frame, error);
}

enum pass_progress ready_step(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    bool lit = false, is_ready = false;
    reserve_begin(renderer);
    bool made = update_environment(renderer, &lit, &failed);
    if (made && lit)
        made = is_ready = get_ready(renderer, &failed);
    made = reserve_end(renderer, made, &failed, error);
    return !made ? PASS_FAILED : is_ready ? PASS_DONE : PASS_MORE;
}

/* Announces programs while the structure is built. */
bool ready_announce_early(struct frame_renderer *renderer, struct error *error)
{
    struct error failed = {0};
    bool lit = false;
    if (renderer->announced_early || renderer->second || renderer->key_tracer)
        return true;
    reserve_begin(renderer);
    bool done = update_environment(renderer, &lit, &failed) && (!lit || set_up(renderer, &failed));
    renderer->announced_early = done && lit;
    if (renderer->announced_early && renderer->work->frame.request.sampling.samples)
        announce_shading(renderer);
    return reserve_end(renderer, done, &failed, error);
}

void reserve_begin(const struct frame_renderer *renderer)
{
    gpu_reserve_begin(renderer->device, RESERVE_NS);
}

/* The next step continues with reservations that were postponed. */
bool reserve_end(const struct frame_renderer *renderer, bool made, const struct error *failed, struct error *error)
{
    bool put_off = gpu_reserve_end(renderer->device);
    if (!made && !put_off && error && error->kind == ERROR_NONE)
        *error = *failed;
    return made || put_off;
}
