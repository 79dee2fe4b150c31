/* SPDX-License-Identifier: MIT */
/* The passes of a wave that all integrators have: what left the scene, shadow rays traced and gathered, children
 * made the next wave. What a hit sends out and asks for is the integrator's own pass (shaders/render/shade.glsl).
 */
#ifndef FARLIGHT_RENDER_WAVE_PASSES_H
#define FARLIGHT_RENDER_WAVE_PASSES_H

#include "render/integrator.h"

struct wave_passes {
    struct integrator base;
    uint32_t children_a_hit; /* at most */
    uint32_t shadow_waves;   /* how many waves of shadow rays the buffers hold */
    struct gpu_buffer radiance, children, child_counts;
    struct gpu_buffer shadow_rays, shadow_times, visibility, light_samples;
};

/* What integrators of this kind have in their tables; the integrator is a struct wave_passes. */
struct integrator *wave_passes_create(const struct integrator_impl *impl, struct gpu_device *device,
                                      uint32_t children_a_hit, uint32_t shadow_waves, struct error *error);
void wave_passes_destroy(struct integrator *integrator); /* accepts NULL */
bool wave_passes_reserve(struct integrator *integrator, struct render_context *context, struct error *error);
uint64_t wave_passes_device_bytes(const struct integrator *integrator);

/* The integrator's program, in use, with the scene and everything that shade.glsl names bound and set; `defines`
 * of its own, ending with {0}, at most 6. NULL and *error if it cannot be had. */
const struct gpu_program *wave_passes_shade_program(struct wave_passes *passes, struct render_context *context,
                                                    const char *compute, const struct gpu_define *defines,
                                                    struct error *error);
/* What the paths that left the scene bring home. */
bool wave_passes_left_scene(struct wave_passes *passes, struct render_context *context, struct error *error);
/* Traces the shadow rays that were made: hit_count times `rays_a_hit`. */
bool wave_passes_trace_shadows(struct wave_passes *passes, struct render_context *context, uint32_t rays_a_hit,
                               struct error *error);
/* Adds the light that they let through to the samples; `first`: and the wave's radiance. */
bool wave_passes_gather(struct wave_passes *passes, struct render_context *context, bool first,
                        uint32_t rays_a_hit, struct error *error);
/* The children become the context's rays and paths; counts the wave. Inside no span. */
enum integrator_progress wave_passes_next_wave(struct wave_passes *passes, struct render_context *context,
                                               struct error *error);

#endif
