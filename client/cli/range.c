/* SPDX-License-Identifier: MIT */
/* The range of an animation's frames, and what goes by it. */
#include "cli/cli.h"

#define RADIANS_PER_DEGREE 0.017453292519943295

/* The turn is reached one frame after the last, so that a full turn repeats without a doubled frame. */
static void settle_orbit(struct cli_job *job)
{
    struct fl_job_options *wanted = &job->options;
    const struct fl_frame_run *range = &job->series.range;
    wanted->orbit_turn = (float)(job->series.orbit_degrees * RADIANS_PER_DEGREE);
    wanted->orbit_seconds = (float)fl_frame_run_count(range) * (float)range->step / wanted->frames_per_second;
}

bool cli_settle_range(struct cli_job *job, struct fl_error *error)
{
    (void)error;
    job->options.time_origin_frame = job->series.range.first;
    if (job->is_orbit)
        settle_orbit(job);
    return true;
}
