/* SPDX-License-Identifier: MIT */
/* The light from infinitely far away, and the light of a scene that has none.
 *
 * A diffuse surface sees the environment as irradiance: order-2 spherical harmonics (Ramamoorthi and Hanrahan
 * 2001), integrated on the CPU when the environment changes; of a backdrop there is none. A scene without a light
 * and with a black environment is lit by the default of shared/sky.h (frame.h says where lamps replace it). */
#ifndef FARLIGHT_RENDER_LIGHT_ENVIRONMENT_H
#define FARLIGHT_RENDER_LIGHT_ENVIRONMENT_H

#include "gpu/buffer.h"
#include "shared/frame.h"
#include "shared/light.h"
#include "gpu_scene/scene.h"

struct environment {
    bool known;             /* the rest is of `revision` */
    uint64_t revision;      /* revision of the scene's environment */
    uint32_t kind;          /* ENVIRONMENT_* */
    float irradiance[9][3]; /* the environment's own; the colour that multiplies an image included */
    bool default_light;
    struct gpu_buffer default_lights; /* SKY_LIGHTS of struct light */
    uint32_t default_light_group;     /* light group of the default lights */
    /* An image that is being integrated: */
    uint64_t summed_revision; /* 0: none is */
    uint32_t summed_rows;
    double sums[9][3];
};

/* The float of an image's texel; infinity becomes the largest half, NaN becomes 0. */
float environment_float_from_half(uint16_t half);
/* Works until about `end_ns`; *done false: call it again. */
bool environment_update(struct environment *environment, struct gpu_device *device, const struct gpu_scene *gpu,
                        uint64_t end_ns, bool *done, struct error *error);
void environment_fill_uniforms(const struct environment *environment, struct frame_uniforms *uniforms,
                               const struct gpu_scene *gpu);
/* Lights of the scene, or the default light where it has none. */
struct gpu_buffer *environment_lights(struct environment *environment, struct gpu_scene *gpu);
void environment_finish(struct environment *environment, struct gpu_device *device);

#endif
