/* SPDX-License-Identifier: MIT */
#include "render/waves/trace.h"

#include "base/clock.h"
#include "render/compare/waves.h"

#include <epoxy/gl.h>

_Static_assert(RAY_COUNT <= WAVE_RAY_KINDS, "a family for each kind and bounce");

/* Rays of one kind and bounce cost about the same from slice to slice. */
static unsigned family_of(const struct render_context *context, enum ray_kind kind)
{
    const uint32_t bounce = context->wave_number < WAVE_BOUNCES ? context->wave_number : WAVE_BOUNCES - 1;
    return (unsigned)kind * WAVE_BOUNCES + bounce;
}

/* A crop cuts the picture into other waves than the whole has, and its pixels are the same. */
static void set_frame(const struct render_context *context, struct wave *wave)
{
    const struct frame_request *request = &context->request;
    wave->frame_samples = (uint64_t)request->width * request->height * request->samples;
    wave->apart = request->crop.width > 0;
}

static enum tracer_progress trace_step(struct render_context *context, enum ray_kind kind, const struct wave *wave,
                                       uint64_t step_ns, struct error *error)
{
    struct trace_state *state = context->trace_state;
    enum tracer_progress progress = TRACER_FAILED;
    context_span_begin(context, kind == RAY_PRIMARY ? STAGE_PRIMARY : STAGE_TRACE);
    context_bind(context); /* another scene's frame may have had its turn since the last step */
    if (state->in_progress || tracer_trace_begin(context->tracer, context->scene, wave, state, error))
        progress = tracer_trace_step(context->tracer, context->scene, state, step_ns, error);
    context_span_end(context);
    return progress;
}

static bool trace_and_compare(struct render_context *context, enum ray_kind kind, const struct wave *wave,
                              struct error *error)
{
    context_span_begin(context, STAGE_COMPARE);
    bool ready = comparison_prepare(context->comparison, wave, context->wave_number, error);
    context_span_end(context);
    uint64_t start_ns = clock_now_ns();
    if (!ready || trace_step(context, kind, wave, STEP_WITHOUT_END, error) != TRACER_DONE)
        return false;
    gpu_finish(context->device); /* so that the time is that of the whole wave, as it is for the other tracer */
    uint64_t trace_ns = clock_now_ns() - start_ns;
    context_span_begin(context, STAGE_COMPARE);
    bool compared = comparison_wave(context->comparison, wave, kind, context->wave_number, trace_ns, error);
    context_span_end(context);
    return compared;
}

bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, bool *done,
                struct error *error)
{
    struct wave own = *wave;
    own.family = family_of(context, kind);
    set_frame(context, &own);
    *done = true;
    if (context->comparison)
        return trace_and_compare(context, kind, &own, error);
    const enum tracer_progress progress = trace_step(context, kind, &own, STEP_NS, error);
    *done = progress == TRACER_DONE;
    return progress != TRACER_FAILED;
}

void wave_announce(struct render_context *context, const struct wave *wave)
{
    struct wave own = *wave;
    own.ray_count = context->wave_capacity;
    set_frame(context, &own);
    if (!context->counts_on_host)
        own.counts = own.stopped = &context->wave_state;
    if (!context->comparison)
        tracer_announce(context->tracer, context->scene, &own);
}
