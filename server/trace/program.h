/* SPDX-License-Identifier: MIT */
/* The program of shaders/trace/wave.comp for one traverse.glsl, and a wave through it. What a tracer's trace()
 * does. */
#ifndef FARLIGHT_TRACE_PROGRAM_H
#define FARLIGHT_TRACE_PROGRAM_H

#include "base/error.h"
#include "gpu/program.h"
#include "gpu_scene/scene.h"
#include "trace/wave.h"

#include <stdbool.h>
#include <stdint.h>

/* Zero is the default of each. */
struct trace_program_source {
    const char *traverse;             /* "bvh/traverse.glsl" */
    const struct gpu_define *defines; /* of the tracer's own, ends with {0}; may be NULL; at most 12 */
    uint32_t rays_together;           /* 0: 1 */
    uint32_t rays_a_dispatch;         /* 0: all; a multiple of rays_together */
};

/* Compiled for what the scene has (spheres, cutouts, translucent surfaces, motion where the wave has times) and
 * for the kind of wave, or from the device's cache. The tracer may set uniforms of its own on it before
 * trace_program_run. */
const struct gpu_program *trace_program_get(const struct gpu_scene *scene, const struct wave *wave,
                                            const struct trace_program_source *source, struct error *error);
/* Binds the wave's buffers, sets `ray_count`, `disc_count` and `instance_count`, dispatches, and makes hits of the
 * crossings. The scene's buffers and the tracer's own are bound already. */
bool trace_program_run(const struct gpu_program *program, const struct gpu_scene *scene, const struct wave *wave,
                       const struct trace_program_source *source, struct error *error);
/* From crossings to hits, in place: what trace_program_run ends with. Nothing to do for any-hit waves. */
bool trace_surfaces(const struct gpu_scene *scene, const struct wave *wave, struct error *error);

#endif
