/* SPDX-License-Identifier: MIT */
/* The only place where waves of a frame are traced. */
#ifndef FARLIGHT_RENDER_WAVES_TRACE_H
#define FARLIGHT_RENDER_WAVES_TRACE_H

#include "render/context/wave.h"
#include "render/compare/rays.h"

/* Traces a wave with the frame's tracer: a short part in each step until *done. The wave stays unchanged until
 * then. A span of its own (STAGE_PRIMARY for primary rays, else STAGE_TRACE; no span is open). Where the frame
 * compares tracers the wave is traced whole, once more with the other, and compared (STAGE_COMPARE).
 *
 * The size of a step follows the clock, as the cost of a ray differs a hundredfold between tracers, scenes and
 * machines; the results do not depend on it. */
bool wave_trace(struct render_wave *wave, enum ray_kind kind, const struct wave *rays, bool *done,
                struct error *error);

/* Announces the programs for a wave of this kind. */
void wave_announce(struct render_wave *wave, const struct wave *rays);

#endif
