/* SPDX-License-Identifier: MIT */
/* The passes of a wave that all integrators have: what left the scene, shadow rays traced and gathered, children
 * made the next wave. What a hit sends out and asks for is the integrator's own pass (shaders/render/shade.glsl).
 */
#ifndef FARLIGHT_RENDER_WAVE_PASSES_H
#define FARLIGHT_RENDER_WAVE_PASSES_H

#include "render/integrators/integrator.h"

struct wave_passes;

/* What an integrator of this kind is made of. */
struct wave_passes_kind {
    const struct integrator_impl *impl;
    uint32_t children_a_hit; /* at most */
    uint32_t shadow_waves;   /* how many waves of shadow rays the buffers hold; no more are traced at once */
    uint32_t (*shadow_rays_a_hit)(const struct render_context *context); /* of the frame in hand */
    /* Over the hits, of which there are some: shadow rays first .. first + count - 1 of each; where first is 0
     * also what the hit sends out, and its children. Inside no span. */
    bool (*shade)(struct wave_passes *passes, struct render_context *context, uint32_t first, uint32_t count,
                  struct error *error);
    uint32_t straight_waves; /* waves beyond the depth that are left to rays which go straight on */
    const char *left_scene;  /* a define of render/left_scene.comp; NULL: none */
    const char *gather;      /* a define of render/gather.comp; NULL: none */
};

struct wave_passes {
    struct integrator base;
    const struct wave_passes_kind *kind;
    struct gpu_buffer radiance, children, child_counts;
    struct gpu_buffer shadow_rays, shadow_times, visibility, light_samples;
};

/* Rays that go straight on through blended surfaces do not count as bounces; so many waves are left to them. */
#define STRAIGHT_WAVES 16

/* What integrators of this kind have in their tables; the integrator is a struct wave_passes. */
struct integrator *wave_passes_create(const struct wave_passes_kind *kind, struct gpu_device *device,
                                      struct error *error);
void wave_passes_destroy(struct integrator *integrator); /* and frees it; accepts NULL */
bool wave_passes_reserve(struct integrator *integrator, struct render_context *context, struct error *error);
uint64_t wave_passes_device_bytes(const struct integrator *integrator);
/* A batch of shadow rays, as many of each hit as the buffers hold, is made in one call and traced in the next
 * ones. */
enum integrator_progress wave_passes_shade(struct integrator *integrator, struct render_context *context,
                                           struct error *error);

/* For a kind's own pass: its program, in use, with the scene and everything that shade.glsl names bound and set;
 * `defines` of its own, ending with {0}, at most 6. NULL and *error if it cannot be had. */
const struct gpu_program *wave_passes_shade_program(struct wave_passes *passes, struct render_context *context,
                                                    const char *compute, const struct gpu_define *defines,
                                                    struct error *error);
/* For those that need no more: wave_passes_shade_program, and dispatched with `first_ray` and `batch_rays`. */
bool wave_passes_run(struct wave_passes *passes, struct render_context *context, const char *compute,
                     const struct gpu_define *defines, uint32_t first, uint32_t count, struct error *error);

#endif
