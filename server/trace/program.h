/* SPDX-License-Identifier: MIT */
/* The programs that most tracers run: shaders/trace/wave.comp with the tracer's traverse.glsl, from rays to
 * intersections, and a surface.comp, from intersections to hits. */
#ifndef FARLIGHT_TRACE_PROGRAM_H
#define FARLIGHT_TRACE_PROGRAM_H

#include "base/error.h"
#include "gpu/program.h"
#include "gpu_scene/scene.h"
#include "trace/wave.h"

#include <stdbool.h>
#include <stdint.h>

#define TRACE_DEPTH_BYTES 16u /* per ray, if rays continue from one dispatch to the next (RAYS_GO_ON) */

#define TRACE_RAYS_MULTIPLE 192u /* a multiple of every packet size */
/* Rays of a dispatch that fill any GPU; more of them come near the time after which a driver ends a dispatch. */
#define TRACE_DISPATCH_RAYS_MAX ((1u << 18) / TRACE_RAYS_MULTIPLE * TRACE_RAYS_MULTIPLE)

/* A program's source; zero is the default of each member. */
struct trace_program_source {
    const char *traverse;             /* "bvh/traverse.glsl" */
    const struct gpu_define *defines; /* defines of the tracer's own, at most 12; end with {0}; may be NULL */
    uint32_t packet_rays;             /* 0: 1 */
    /* Rays per dispatch, a multiple of packet_rays; 0: all. A wave that the device counts is one dispatch where
     * this is TRACE_DISPATCH_RAYS_MAX: its upper bound would make mostly empty dispatches. */
    uint32_t rays_a_dispatch;
};

/* Whether rays of the wave meet things that move. */
bool trace_has_motion(const struct gpu_scene *scene, const struct wave *wave);
/* Writes the defines of a program that reads the rays of the wave and the primitives of the scene: at most
 * TRACE_WAVE_DEFINES, listed in shaders/trace/wave.comp. Returns their number. */
#define TRACE_WAVE_DEFINES 10
size_t trace_wave_defines(const struct gpu_scene *scene, const struct wave *wave, struct gpu_define *defines);
/* Binds the rays as texels, and their times if the program is compiled with HAS_MOTION. */
void trace_bind_rays(const struct gpu_scene *scene, const struct wave *wave);

/* Gets the program for what the scene has (spheres, cutouts, translucent surfaces, motion where the wave has
 * times) and for the kind of wave, compiled or from the device's cache. The tracer may set uniforms of its own
 * on it before trace_program_run. */
const struct gpu_program *trace_program_get(const struct gpu_scene *scene, const struct wave *wave,
                                            const struct trace_program_source *source, struct error *error);
/* Rays of a traversal's dispatch (trace_program_source.rays_a_dispatch) that keep it short enough for every
 * driver, even if each ray takes `rounds_of_a_ray` rounds of the traversal's loops. Except in the densest
 * structures they are enough to fill any GPU. */
uint32_t trace_rays_a_dispatch(const struct gpu_device *device, uint64_t rounds_of_a_ray);
/* Binds the wave's buffers, sets `first_ray`, `ray_count`, `disc_count` and `instance_count`, and dispatches: the
 * rays of the range get their intersections or visibilities. The scene's buffers and the tracer's own are bound
 * already. */
void trace_program_run(const struct gpu_program *program, const struct gpu_scene *scene,
                       const struct ray_range *rays, const struct trace_program_source *source);

/* A surface program in two steps: the tracer may bind its buffers and set its uniforms between them. `compute` is
 * "<tracer>/surface.comp"; `defines` ends with {0}, NULL: none; at most TRACE_SURFACE_DEFINES and another. */
const struct gpu_program *trace_surface_program_get(const struct gpu_scene *scene, const struct wave *wave,
                                                    const char *compute, const struct gpu_define *defines,
                                                    struct error *error);
/* Binds rays and hits, sets `first_ray` and `ray_count`, and dispatches: intersections become hits, in place. */
void trace_surface_program_run(const struct gpu_program *program, const struct gpu_scene *scene,
                               const struct ray_range *rays);
/* Writes the defines by which a program that includes common/surface.glsl leaves out what the scene does not
 * need: at most TRACE_SURFACE_DEFINES. Returns their number. */
#define TRACE_SURFACE_DEFINES 5
size_t trace_surface_defines(const struct gpu_scene *scene, struct gpu_define *defines);
/* Does both steps, for intersections that name a primitive of the scene. */
bool trace_surfaces(const struct gpu_scene *scene, const struct ray_range *rays, struct error *error);

#endif
