/* SPDX-License-Identifier: MIT */
/* A frame from its beginning to its result: one pass of the list after the other (passes.c), a step at a time. */
#include "render/frame/frame.h"

#include "base/clock.h"
#include "render/compare/waves.h"
#include "render/context/camera.h"
#include "render/frame/build.h"
#include "render/frame/check.h"
#include "render/frame/key.h"
#include "render/frame/output.h"
#include "render/frame/passes.h"
#include "render/frame/samples.h"
#include "render/frame/update.h"
#include "render/frame/work.h"
#include "render/picture/readback.h"
#include "render/waves/integrator.h"

#include <string.h>

/* ---- the end ---- */

static void end(struct frame_renderer *renderer)
{
    update_give_tracers(renderer);
    if (renderer->phase == PHASE_UPDATE)
        update_abandon(renderer->shared);
    if (renderer->phase != PHASE_IDLE)
        renderer->shared->frames--;
    renderer->phase = PHASE_IDLE;
    for (int i = 0; i < 2 && renderer->work; i++)
        gpu_readback_drop(&renderer->work->copies[i]);
    if (renderer->work)
        slices_ahead_drop(&renderer->work->ahead);
    frame_work_give(renderer->shared, renderer->work);
    renderer->work = NULL;
}

void frame_abandon(struct frame_renderer *renderer)
{
    if (renderer->phase != PHASE_IDLE) {
        gpu_timer_drop(renderer->work->device.timer);
        renderer->work->device.span_count = 0;
    }
    picture_drop_pixels(&renderer->picture);
    end(renderer);
}

static size_t attached_bytes(const struct frame_request *request)
{
    size_t count = (size_t)__builtin_popcount(request->attachments);
    return count * request->picture.width * request->picture.height * frame_format_bytes(PIXEL_FORMAT_DEPTH32F);
}

static bool hand_out(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    struct frame_work *work = renderer->work;
    const struct frame_request *request = &work->frame.request;
    if (work->frame.comparison && !comparison_take(work->frame.comparison, &renderer->result.comparisons,
                                                   &renderer->result.comparison_count, error))
        return false;
    if (!trace_state_report(work->trace_state, &renderer->result.structure, error) ||
        (frame_is_from_layers(&renderer->request) && !frame_key_report(renderer, error)))
        return false;
    context_collect(&work->device);
    stage_times_add(&work->device.times, STAGE_FRAME, CLOCK_CPU, 0, work->device.times.origin_ns,
                    clock_now_ns() - work->device.times.origin_ns);
    *result = renderer->result;
    const struct frame_crop crop = frame_request_crop(request);
    if (frame_request_is_cropped(request))
        picture_cut(&renderer->picture, request);
    result->pixels = renderer->picture.pixels;
    result->layers = frame_request_layers(request);
    result->attachments = request->attachments;
    result->size_bytes = renderer->picture.size_bytes - attached_bytes(request);
    renderer->picture.pixels = NULL;
    result->width = crop.width;
    result->height = crop.height;
    result->format = request->picture.format;
    result->ycbcr = request->ycbcr;
    result->samples = renderer->picture.samples;
    result->noise = renderer->picture.noise.error;
    result->primary_rays += request->sampling.noise > 0.0f
                                ? picture_noise_rays(&renderer->picture, renderer->samples_before)
                                : (uint64_t)crop.width * crop.height * request->sampling.samples;
    result->times = work->device.times;
    renderer->kept_request = *request;
    renderer->kept_samples = result->samples;
    renderer->kept_showing = renderer->shared->showing;
    end(renderer);
    return true;
}

/* ---- steps ---- */

/* Runs a step of the pass in progress. The first step of the builds belongs to the last one of the update, as it
 * may read the scene's motion. */
static enum pass_progress advance(struct frame_renderer *renderer, struct error *error)
{
    enum pass_progress progress;
    do {
        progress = passes_run(renderer, error);
        if (progress == PASS_REPEAT) { /* with the next picture that the frame is made from */
            renderer->phase = PHASE_BUILD;
            return PASS_MORE;
        }
        if (progress != PASS_DONE)
            return progress;
        const enum frame_phase next = passes_next(renderer, renderer->phase + 1);
        if (next == PHASE_COUNT)
            return PASS_DONE;
        renderer->phase = next;
    } while (renderer->phase == PHASE_BUILD);
    return PASS_MORE;
}

enum frame_progress frame_step(struct frame_renderer *renderer, struct frame_result *result, struct error *error)
{
    const struct gpu_device *device = renderer->device;
    const uint64_t waits = device->waits, dispatches = device->dispatches, barriers = device->barriers;
    if (renderer->phase == PHASE_IDLE) {
        error_set(error, ERROR_INTERNAL, NULL, "a step of no frame");
        return FRAME_FAILED;
    }
    const enum pass_progress progress = advance(renderer, error);
    renderer->result.device_waits += (uint32_t)(device->waits - waits);
    renderer->result.dispatches += (uint32_t)(device->dispatches - dispatches);
    renderer->result.barriers += (uint32_t)(device->barriers - barriers);
    if (progress == PASS_MORE)
        return FRAME_MORE;
    if (progress == PASS_DONE && hand_out(renderer, result, error))
        return FRAME_DONE;
    frame_abandon(renderer);
    return FRAME_FAILED;
}

bool frame_step_waits(const struct frame_renderer *renderer)
{
    switch (renderer->phase) {
    case PHASE_UPDATE:
        return gpu_scene_bring_waits(&renderer->shared->copy);
    case PHASE_BUILD:
        return build_waits(renderer);
    case PHASE_SAMPLES:
        return samples_wait(renderer);
    case PHASE_OUTPUT:
        return output_waits(renderer);
    default:
        return false;
    }
}

/* ---- the beginning ---- */

/* Whether the kept picture shows the same as this frame, once the scene has been updated. */
static bool may_go_on(const struct frame_renderer *renderer, const struct frame_request *request)
{
    return renderer->kept_samples > 0 && !renderer->history.is_moving &&
           request->sampling.samples <= UINT32_MAX - renderer->kept_samples &&
           frame_request_adds_to(&renderer->kept_request, request);
}

static bool is_alone(const struct frame_renderer *renderer)
{
    return renderer->shared->frames == (renderer->phase != PHASE_IDLE);
}

bool frame_may_begin(const struct frame_renderer *renderer, const struct scene *scene,
                     const struct scene_motion *motion, const struct frame_request *request)
{
    struct error refused = {0}; /* set by frame_begin, before it changes anything */
    const struct tracer_impl *const wanted[] = {
        frame_find_tracer(renderer, request->tracing.tracer, "tracer", &refused),
        request->comparison.compare
            ? frame_find_tracer(renderer, request->comparison.compare_with, "compare_with", &refused)
            : NULL,
    };
    if (is_alone(renderer) || refused.kind != ERROR_NONE)
        return true;
    const struct tracer_impl *impls[2]; /* tracers that are shared with the other frames */
    size_t count = 0;
    for (size_t i = 0; i < 2; i++)
        if (wanted[i] && !(wanted[i]->depends_on & CHANGED_VIEW))
            impls[count++] = wanted[i];
    const struct gpu_scene *copy = &renderer->shared->copy;
    const struct integrator *integrator = integrator_by_number(request->light.integrator);
    const bool lit = integrator && integrator->lit_by_surfaces;
    return gpu_scene_is_current(copy, scene, motion) && (!lit || gpu_scene_emitters_are_current(copy)) &&
           tracer_set_are_free(&renderer->shared->tracers, impls, count, &request->tracer_options);
}

/* The view that a structure may depend on: one of several views, or the key view where eyes are made from layers.
 */
static struct trace_view view_of(const struct frame_request *request)
{
    const struct frame_camera camera = frame_key_camera(request);
    struct trace_view view = {
        .fov_y = camera.fov_y,
        .ortho_height = camera.ortho_height,
        .near = camera.near,
    };
    frame_view_size(request, &view.width, &view.height);
    memcpy(view.world_from_view, camera.world_from_view, sizeof(view.world_from_view));
    return view;
}

static bool begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                  const struct frame_request *request, struct error *error)
{
    if (!frame_check_request(renderer, request, error) || !frame_check_light(scene, request, error))
        return false;
    renderer->work = frame_work_take(renderer->shared, integrator_by_number(request->light.integrator), error);
    if (!renderer->work)
        return false;
    struct frame_work *work = renderer->work;
    work->frame.request = renderer->request = *request;
    work->frame.layer_tracer = NULL;
    work->frame.tiles = (struct frame_tiles){0};
    renderer->pass = PASS_UNKNOWN;
    renderer->announced = renderer->announced_early = renderer->announced_first = false;
    renderer->target = &renderer->picture;
    renderer->result = (struct frame_result){0};
    renderer->view = view_of(request);
    renderer->samples_before = may_go_on(renderer, request) ? renderer->kept_samples : 0;
    renderer->kept_samples = 0; /* until this one is finished */
    stage_times_begin(&work->device.times);
    context_set_number(&work->wave, 0);
    renderer->begun_building = false;
    renderer->scene = scene;
    renderer->motion = motion;
    return true;
}

bool frame_begin(struct frame_renderer *renderer, const struct scene *scene, const struct scene_motion *motion,
                 const struct frame_request *request, struct error *error)
{
    frame_abandon(renderer);
    if (!frame_may_begin(renderer, scene, motion, request))
        return error_set(error, ERROR_INTERNAL, NULL, "a frame that may not begin beside others");
    bool begun = begin(renderer, scene, motion, request, error);
    if (begun) {
        renderer->phase = PHASE_UPDATE;
        renderer->shared->frames++;
        begun = advance(renderer, error) != PASS_FAILED;
    }
    if (!begun)
        end(renderer);
    return begun;
}
