/* SPDX-License-Identifier: MIT */
/* What a frame would have taken without the programs that were compiled at their first use: of each pass of each
 * wave, which is repeated slice by slice, the longest time counts as the mean of the others. */
#ifndef FARLIGHT_SESSION_GUESS_H
#define FARLIGHT_SESSION_GUESS_H

#include "base/stage_times.h"
#include "session/pacing.h"

/* Nanoseconds of rendering, without builds; of these each wave's. 0: the frame says nothing. */
uint64_t guess_render_ns(const struct stage_times *times, uint64_t wave_ns[PACING_WAVES]);

#endif
