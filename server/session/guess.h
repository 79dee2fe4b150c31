/* SPDX-License-Identifier: MIT */
/* Estimate of a frame's time without the programs that were compiled at their first use: a pass of a wave is
 * repeated slice by slice, and its longest time is replaced by the mean of the others. */
#ifndef FARLIGHT_SESSION_GUESS_H
#define FARLIGHT_SESSION_GUESS_H

#include "base/stage_times.h"
#include "session/pacing.h"

/* Time of rendering without builds, and the part of each wave. 0: not known. */
uint64_t guess_render_ns(const struct stage_times *times, uint64_t wave_ns[PACING_WAVES]);

#endif
