/* SPDX-License-Identifier: MIT */
#include "render/wave_trace.h"

#include "base/clock.h"
#include "render/comparison.h"

#include <epoxy/gl.h>

static bool trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, struct error *error)
{
    context_span_begin(context, kind == RAY_PRIMARY ? STAGE_PRIMARY : STAGE_TRACE);
    bool traced = tracer_trace(context->tracer, context->scene, wave, error);
    context_span_end(context);
    return traced && gpu_check(context->device, "tracing a wave", error);
}

static bool trace_and_compare(struct render_context *context, enum ray_kind kind, const struct wave *wave,
                              struct error *error)
{
    context_span_begin(context, STAGE_COMPARE);
    bool ready = comparison_prepare(context->comparison, wave, context->wave_number, error);
    context_span_end(context);
    uint64_t start_ns = clock_now_ns();
    if (!ready || !trace(context, kind, wave, error))
        return false;
    glFinish(); /* so that the time is that of the whole wave, as it is for the other tracer */
    uint64_t trace_ns = clock_now_ns() - start_ns;
    context_span_begin(context, STAGE_COMPARE);
    bool compared = comparison_wave(context->comparison, wave, kind, context->wave_number, trace_ns, error);
    context_span_end(context);
    return compared;
}

bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, struct error *error)
{
    return context->comparison ? trace_and_compare(context, kind, wave, error) : trace(context, kind, wave, error);
}
