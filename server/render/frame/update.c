/* SPDX-License-Identifier: MIT */
/* Brings the scene to the device and takes the tracers of the frame. */
#include "render/frame/update.h"

#include "base/clock.h"
#include "render/frame/announce.h"
#include "render/frame/check.h"
#include "render/frame/key.h"
#include "render/frame/renderer.h"
#include "render/frame/ready.h"
#include "render/frame/work.h"
#include "render/waves/integrator.h"

/* Time of a step in which a thread packs large arrays of the scene. */
#define UPDATE_STEP_NS UINT64_C(6000000)

/* An update that failed leaves no revision. */
static void note_showing(struct frame_scene *shared, uint64_t revision_before, const struct scene_changes *changes)
{
    if (shared->copy.revision != revision_before || changes->bits)
        shared->showing++;
}

static bool update_scene(struct frame_renderer *renderer, const struct scene *scene,
                         const struct scene_motion *motion, struct error *error)
{
    struct frame_work *work = renderer->work;
    struct frame_scene *shared = renderer->shared;
    struct scene_changes changes = {0};
    uint64_t revision_before = shared->copy.revision;
    bool updated = gpu_scene_update(&shared->copy, scene, motion, &changes, &work->device.times, error) &&
                   (!work->frame.integrator->lit_by_surfaces ||
                    gpu_scene_update_emitters(&shared->copy, &changes, &work->device.times, error));
    change_history_note(&shared->changes, updated ? changes.bits : CHANGED_SCENE);
    note_showing(shared, revision_before, &changes);
    if (!updated)
        return false;
    /* Objects that other frames moved and put back may be in other parts of a tracer's structure, whose costs
     * are not added up. */
    if (renderer->kept_showing != shared->showing)
        renderer->samples_before = 0;
    renderer->result.uploaded_bytes = changes.uploaded_bytes;
    work->frame.features = scene_features_of(scene);
    return true;
}

static struct tracer *take_tracer(struct frame_renderer *renderer, unsigned number, const char *field,
                                  struct error *error)
{
    const struct tracer_impl *impl = frame_find_tracer(renderer, number, field, error);
    if (!tracer_check_motion(impl, &renderer->shared->copy, error))
        return NULL;
    return tracer_set_take(frame_tracers(renderer, impl), renderer->device, impl,
                           &renderer->work->frame.request.tracer_options, error);
}

static bool take_tracers(struct frame_renderer *renderer, struct error *error)
{
    struct frame_work *work = renderer->work;
    const struct frame_request *request = &work->frame.request;
    renderer->tracer = work->frame.tracer = take_tracer(renderer, request->tracing.tracer, "tracer", error);
    if (!renderer->tracer || !frame_work_trace_by(renderer->work, &work->trace_state, renderer->tracer, error))
        return false;
    if (frame_is_from_layers(request) || request->hidden_layer)
        return frame_key_take(renderer, error);
    if (!request->comparison.compare)
        return true;
    struct tracer_set *tracers = frame_tracers(renderer, renderer->tracer->impl);
    renderer->second = request->comparison.compare_with == request->tracing.tracer
                           ? tracer_set_take_again(tracers, renderer->tracer)
                           : take_tracer(renderer, request->comparison.compare_with, "compare_with", error);
    return renderer->second;
}

static bool bring_scene(struct frame_renderer *renderer, bool *done, struct error *error)
{
    struct error failed = {0};
    reserve_begin(renderer);
    bool brought = gpu_scene_bring(&renderer->shared->copy, renderer->scene, clock_now_ns() + UPDATE_STEP_NS, done,
                                   &renderer->work->device.times, &failed);
    return reserve_end(renderer, brought, &failed, error);
}

/* Finds the moves at once, as the motion is not kept. */
static bool find_moves(struct frame_renderer *renderer, struct error *error)
{
    return !frame_has_motion_layer(renderer) ||
           moves_find(&renderer->work->layers.moves, &renderer->shared->copy, renderer->motion, error);
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    struct frame_renderer *renderer = self;
    bool done = false;
    (void)wave;
    if (!bring_scene(renderer, &done, error))
        return PASS_FAILED;
    if (!done) {
        announce_first(renderer);
        return PASS_MORE;
    }
    const bool updated = update_scene(renderer, renderer->scene, renderer->motion, error) &&
                         take_tracers(renderer, error) && find_moves(renderer, error);
    return updated ? PASS_DONE : PASS_FAILED;
}

const struct pass update_pass = {.name = "update", .run = run};

static void give_tracer(struct frame_renderer *renderer, const struct tracer *tracer)
{
    if (tracer)
        tracer_set_give(frame_tracers(renderer, tracer->impl), tracer);
}

void update_give_tracers(struct frame_renderer *renderer)
{
    give_tracer(renderer, renderer->tracer);
    give_tracer(renderer, renderer->second);
    give_tracer(renderer, renderer->key_tracer);
    renderer->tracer = renderer->second = renderer->key_tracer = NULL;
}

void update_abandon(struct frame_scene *shared)
{
    gpu_scene_bring_abandon(&shared->copy);
    change_history_note(&shared->changes, CHANGED_SCENE);
    shared->showing++;
}
