/* SPDX-License-Identifier: MIT */
/* The one place where waves of a frame meet a tracer. */
#ifndef FARLIGHT_RENDER_WAVE_TRACE_H
#define FARLIGHT_RENDER_WAVE_TRACE_H

#include "render/context.h"
#include "trace/wave_compare.h"

/* Traces a wave with the frame's tracer, as a span of its own (STAGE_PRIMARY for primary rays, else STAGE_TRACE;
 * no span is open), and where the frame compares tracers, once more with the other and compares (STAGE_COMPARE).
 * The scene is bound. */
bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, struct error *error);

#endif
