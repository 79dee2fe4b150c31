/* SPDX-License-Identifier: MIT */
/* Brings the structures of the frame's tracers to the scene. */
#include "render/frame/build.h"

#include "base/clock.h"
#include "render/frame/ready.h"
#include "render/frame/renderer.h"

static enum tracer_progress bring(struct frame_renderer *renderer, const struct tracer *tracer,
                                  struct error *error)
{
    struct frame_work *work = renderer->work;
    struct frame_scene *shared = renderer->shared;
    struct stage_times *spans = context_scratch_times(&work->device);
    const uint64_t start_ns = clock_now_ns();
    const struct tracer_update update = {.view = &renderer->view, .times = spans};
    enum tracer_progress progress = tracer_set_bring(frame_tracers(renderer, tracer->impl), tracer, &shared->copy,
                                                     &update, shared->step_ns, error);
    if (tracer != renderer->second || tracer == renderer->tracer)
        context_add_times(&work->device, spans);
    else /* a structure that does not count as a cost of the frame's own tracer */
        context_add_cpu_time(&work->device, STAGE_COMPARE, start_ns);
    return progress;
}

static enum tracer_progress bring_key(struct frame_renderer *renderer, struct error *error)
{
    const struct tracer *tracer = renderer->key_tracer;
    enum tracer_progress progress = bring(renderer, tracer, error);
    if (progress != TRACER_DONE)
        return progress;
    renderer->key_built = true;
    if (tracer == renderer->tracer)
        return progress;
    renderer->result.uploaded_bytes += tracer->stats.uploaded_bytes;
    renderer->result.structure_bytes += tracer->stats.device_bytes;
    tracer_report(tracer, &renderer->result.structure);
    return progress;
}

static enum pass_progress build(struct frame_renderer *renderer, struct error *error)
{
    const struct tracer_stats *stats = &renderer->tracer->stats;
    enum tracer_progress progress = TRACER_DONE;
    if (!renderer->built) {
        progress = bring(renderer, renderer->tracer, error);
        if (progress != TRACER_DONE)
            return progress == TRACER_MORE && ready_announce_early(renderer, error) ? PASS_MORE : PASS_FAILED;
        renderer->built = true;
        renderer->result.uploaded_bytes += stats->uploaded_bytes;
        renderer->result.structure_bytes = stats->device_bytes;
        tracer_report(renderer->tracer, &renderer->result.structure);
    }
    if (renderer->second && !renderer->second_built) {
        progress = bring(renderer, renderer->second, error);
        renderer->second_built = progress == TRACER_DONE;
    }
    if (renderer->key_tracer && !renderer->key_built)
        progress = bring_key(renderer, error);
    if (progress != TRACER_DONE)
        return progress == TRACER_MORE ? PASS_MORE : PASS_FAILED;
    return ready_step(renderer, error);
}

/* The first step brings every tracer forward: it may read the scene's motion, which others do not keep. */
static enum pass_progress begin(struct frame_renderer *renderer, struct error *error)
{
    renderer->begun_building = true;
    renderer->built = renderer->second_built = renderer->key_built = false;
    picture_restart(&renderer->picture);
    const enum pass_progress progress = build(renderer, error);
    if (progress == PASS_FAILED || renderer->built)
        return progress;
    const bool begun = (!renderer->second || bring(renderer, renderer->second, error) != TRACER_FAILED) &&
                       (!renderer->key_tracer || renderer->key_tracer == renderer->tracer ||
                        bring(renderer, renderer->key_tracer, error) != TRACER_FAILED);
    return begun ? progress : PASS_FAILED;
}

static enum pass_progress run(void *self, struct render_wave *wave, struct error *error)
{
    struct frame_renderer *renderer = self;
    (void)wave;
    return renderer->begun_building ? build(renderer, error) : begin(renderer, error);
}

const struct pass build_pass = {.name = "build", .run = run};

bool build_waits(const struct frame_renderer *renderer)
{
    struct tracer *building = !renderer->built                              ? renderer->tracer
                              : !renderer->second_built && renderer->second ? renderer->second
                              : !renderer->key_built                        ? renderer->key_tracer
                                                                            : NULL;
    return building && tracer_update_waits(building);
}
