/* SPDX-License-Identifier: MIT */
/* The one place where waves of a frame meet a tracer. */
#ifndef FARLIGHT_RENDER_WAVE_TRACE_H
#define FARLIGHT_RENDER_WAVE_TRACE_H

#include "render/context.h"
#include "render/compare/rays.h"

/* Traces a wave with the frame's tracer: a short step of it, and so from step to step until *done. What is in the
 * wave stays as it is until then. A span of its own (STAGE_PRIMARY for primary rays, else STAGE_TRACE; no span is
 * open). Where the frame compares tracers the wave is traced whole, once more with the other, and compared
 * (STAGE_COMPARE).
 *
 * What a step does follows the clock, for what a ray costs differs a hundredfold between tracers, scenes and
 * machines; what the rays find does not depend on it. */
bool wave_trace(struct render_context *context, enum ray_kind kind, const struct wave *wave, bool *done,
                struct error *error);
#endif
