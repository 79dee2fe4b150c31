/* SPDX-License-Identifier: MIT */
/* Light transport: the passes over hits and their rays, as a row that waves/shading.h runs. */
#ifndef FARLIGHT_RENDER_WAVES_INTEGRATOR_H
#define FARLIGHT_RENDER_WAVES_INTEGRATOR_H

#include "render/context/wave.h"

#define INTEGRATOR_DEFINES_MAX 7

struct integrator {
    const char *name;
    const char *shader;      /* shader over the hits; shaders/render/shade.glsl defines its output */
    uint32_t children_a_hit; /* at most */
    bool scatters;           /* children in many directions, at most one a hit: a wave of them may be sorted */
    bool random;             /* radiance differs from sample to sample, beside by the place in the pixel */
    bool lit_by_surfaces;    /* emissive ones are lights */
    bool follows_eye;        /* mirrors, glass and highlights are seen from where the eye is */
    /* These three determine the programs that are compiled ahead only: */
    bool always_bounces;     /* hits of any material may have children, unless the depth is 0 */
    bool mirrors;            /* hits of scene_features.mirrors have children */
    bool meets_lights;       /* rays hit area lights, by their weights */
    uint32_t shadow_waves;   /* how many waves of shadow rays the buffers hold at least */
    uint32_t straight_waves; /* waves beyond the depth that are left to rays which go straight on */
    uint32_t (*shadow_rays_a_hit)(const struct render_frame *frame); /* shadow rays of each hit in this frame */
    /* The rest may be NULL: none. */
    const char *ground;     /* a define of render/ground.comp */
    const char *left_scene; /* a define of render/left_scene.glsl */
    const char *gather;     /* a define of render/gather.comp */
    size_t (*defines)(const struct render_wave *wave, struct gpu_define *defines);    /* defines of the shader */
    void (*set)(const struct render_frame *frame, const struct gpu_program *program); /* uniforms and bindings */
    /* At the start of a frame and when the capacity of its waves grows. */
    bool (*prepare)(const struct render_frame *frame, struct error *error);
};

/* For programs that choose among emissive triangles: at most 4. Returns how many. */
size_t integrator_emitter_defines(const struct render_frame *frame, struct gpu_define *defines);

/* By frame_request's number; NULL: there is none. */
const struct integrator *integrator_by_number(unsigned number);

#endif
