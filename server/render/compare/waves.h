/* SPDX-License-Identifier: MIT */
/* Traces the waves of a frame a second time by another tracer, and compares both answers
 * (render/compare/rays.h). */
#ifndef FARLIGHT_RENDER_COMPARE_WAVES_H
#define FARLIGHT_RENDER_COMPARE_WAVES_H

#include "base/error.h"
#include "gpu/device.h"
#include "trace/tracer.h"
#include "render/compare/rays.h"

#include <stdbool.h>
#include <stdint.h>

struct comparison;

struct comparison *comparison_create(struct gpu_device *device, struct error *error);
void comparison_destroy(struct comparison *comparison); /* accepts NULL */
uint64_t comparison_device_bytes(const struct comparison *comparison);

/* A frame begins. The tracers are brought to the scene already and live as long as the frame; far_share as in
 * wave_compare_settings, 0: WAVE_FAR_SHARE. */
void comparison_begin(struct comparison *comparison, struct gpu_scene *scene, struct tracer *first,
                      struct tracer *second, float far_share);
/* Before the first tracer traces the wave: if it is the frame's first of its number and kind, both trace it
 * once unmeasured, which compiles their programs, so that measured times are of tracing alone; then waits
 * until the device is idle. */
bool comparison_prepare(struct comparison *comparison, const struct wave *wave, uint32_t wave_number,
                        struct error *error);
/* The wave has been traced, in first_ns, and its buffers hold the answers. The scene is bound. */
bool comparison_wave(struct comparison *comparison, const struct wave *wave, enum ray_kind kind,
                     uint32_t wave_number, uint64_t first_ns, struct error *error);
/* The current slice has reached the picture, and its counts are kept; or it is split and traced again. */
bool comparison_keep_slice(struct comparison *comparison, struct error *error);
void comparison_drop_slice(struct comparison *comparison);
/* The figures of the frame, ascending by wave and kind; malloc'ed, the caller's. */
bool comparison_take(struct comparison *comparison, struct record_wave_comparison **figures, uint32_t *count,
                     struct error *error);

#endif
