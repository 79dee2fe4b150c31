/* SPDX-License-Identifier: MIT */
/* The one place where waves of a frame meet a tracer. */
#ifndef FARLIGHT_RENDER_WAVE_TRACE_H
#define FARLIGHT_RENDER_WAVE_TRACE_H

#include "render/context.h"
#include "render/compare/rays.h"

/* Traces a wave with the frame's tracer, or as much of it as is a short step, and counts that in context->traced;
 * *done: it was the last part, and context->traced is 0 again for the next wave. What is in the wave stays as it
 * is until then. A span of its own (STAGE_PRIMARY for primary rays, else STAGE_TRACE; no span is open). Where the
 * frame compares tracers the wave is traced whole, once more with the other, and compared (STAGE_COMPARE).
 *
 * How many rays are a short step follows the clock, for what a ray costs differs a hundredfold between tracers,
 * scenes and machines; what the rays find does not depend on it. */
bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, bool *done,
                struct error *error);
/* A frame begins: what its rays cost is not known. */
void wave_trace_forget(struct render_context *context);

#endif
