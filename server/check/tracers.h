/* SPDX-License-Identifier: MIT */
/* Checks by small frames: every tracer ray by ray against the reference, every integrator, both ways to first
 * hits, and the longest dispatch among all of them. */
#ifndef FARLIGHT_CHECK_TRACERS_H
#define FARLIGHT_CHECK_TRACERS_H

#include "check/frames.h"
#include "check/report.h"
#include "gpu/device.h"

/* Checks a tracer ray by ray, in a row; the frames are of check_scene_small(). False: there was no frame. */
bool check_rays(struct check_report *report, struct check_frames *frames, unsigned tracer);
void check_tracers(struct check_report *report, struct gpu_device *device);

#endif
