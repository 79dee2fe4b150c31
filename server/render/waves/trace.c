/* SPDX-License-Identifier: MIT */
/* Traces a frame's waves a step at a time, by a second tracer too where tracers are compared. */
#include "render/waves/trace.h"

#include "base/clock.h"
#include "render/compare/waves.h"

#include <epoxy/gl.h>

_Static_assert(RAY_COUNT <= WAVE_RAY_KINDS, "a family for each kind and bounce");

/* Rays of one kind and bounce cost about the same from slice to slice. */
static unsigned family_of(const struct render_wave *wave, enum ray_kind kind)
{
    const uint32_t bounce = wave->number < WAVE_BOUNCES ? wave->number : WAVE_BOUNCES - 1;
    return (unsigned)kind * WAVE_BOUNCES + bounce;
}

/* A crop cuts the picture into other waves than the whole has, and its pixels are the same. */
static void set_frame(const struct render_frame *frame, struct wave *rays)
{
    const struct frame_request *request = &frame->request;
    rays->frame_samples = (uint64_t)request->picture.width * request->picture.height * request->sampling.samples;
    rays->apart = frame_request_is_cropped(request);
}

static enum tracer_progress trace_step(struct render_wave *wave, enum ray_kind kind, const struct wave *rays,
                                       uint64_t step_ns, struct error *error)
{
    struct trace_state *state = wave->frame->trace_state;
    enum tracer_progress progress = TRACER_FAILED;
    context_span_begin(wave->device, kind == RAY_PRIMARY ? STAGE_PRIMARY : STAGE_TRACE);
    context_bind(wave); /* another scene's frame may have had its turn since the last step */
    if (state->in_progress || tracer_trace_begin(wave->frame->tracer, wave->frame->scene, rays, state, error))
        progress = tracer_trace_step(wave->frame->tracer, wave->frame->scene, state, step_ns, error);
    context_span_end(wave->device);
    return progress;
}

static bool trace_and_compare(struct render_wave *wave, enum ray_kind kind, const struct wave *rays,
                              struct error *error)
{
    context_span_begin(wave->device, STAGE_COMPARE);
    bool ready = comparison_prepare(wave->frame->comparison, rays, wave->number, error);
    context_span_end(wave->device);
    uint64_t start_ns = clock_now_ns();
    if (!ready || trace_step(wave, kind, rays, STEP_WITHOUT_END, error) != TRACER_DONE)
        return false;
    gpu_finish(wave->device->gpu); /* so that the time is that of the whole rays, as it is for the other tracer */
    uint64_t trace_ns = clock_now_ns() - start_ns;
    context_span_begin(wave->device, STAGE_COMPARE);
    bool compared = comparison_wave(wave->frame->comparison, rays, kind, wave->number, trace_ns, error);
    context_span_end(wave->device);
    return compared;
}

bool wave_trace(struct render_wave *wave, enum ray_kind kind, const struct wave *rays, bool *done,
                struct error *error)
{
    struct wave own = *rays;
    own.family = family_of(wave, kind);
    set_frame(wave->frame, &own);
    *done = true;
    if (wave->frame->comparison)
        return trace_and_compare(wave, kind, &own, error);
    const enum tracer_progress progress = trace_step(wave, kind, &own, STEP_NS, error);
    *done = progress == TRACER_DONE;
    return progress != TRACER_FAILED;
}

void wave_announce(struct render_wave *wave, const struct wave *rays)
{
    struct wave own = *rays;
    own.ray_count = wave->capacity;
    set_frame(wave->frame, &own);
    if (!wave->device->counts_on_host)
        own.counts = own.stopped = &wave->state;
    if (!wave->frame->comparison)
        tracer_announce(wave->frame->tracer, wave->frame->scene, &own);
}
