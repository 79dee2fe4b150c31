/* SPDX-License-Identifier: MIT */
/* The passes that shade a wave, by an integrator's row: the light that hits send out and ask for, shadow rays
 * traced and gathered, light of paths that left the scene, children made the next wave and traced. */
#ifndef FARLIGHT_RENDER_WAVES_SHADING_H
#define FARLIGHT_RENDER_WAVES_SHADING_H

#include "render/context/pass.h"
#include "render/waves/integrator.h"

/* Surfaces that are no part of the scene, beside those that the integrator shades. */
struct shading_extra {
    bool (*is_shown)(const struct render_frame *frame);
    /* Shadow rays of each hit, the integrator's included. */
    uint32_t (*shadow_rays)(const struct render_frame *frame);
    bool (*prepare)(const struct render_frame *frame, struct error *error); /* with the shading's buffers */
    /* Makes hits of the wave's rays that meet such a surface, before hits are listed. Inside a span. */
    bool (*make_hits)(struct render_wave *wave, struct error *error);
    /* Shades these hits anew, after the integrator has shaded all; and makes dead shadow rays of other hits
     * in the places that the integrator leaves: first .. first + count - 1 of each hit. Bindings of a shading
     * pass are set, but for the program. Inside a span. */
    bool (*shade)(struct render_wave *wave, uint32_t first, uint32_t count, struct error *error);
};

/* Buffers of the shading passes. Owner: a frame's work. */
struct wave_shading {
    const struct shading_extra *extra;
    bool is_wanted;    /* the frame needs the waves' light, or notes of shading */
    bool has_children; /* the wave holds children's rays and paths, not yet traced */
    struct gpu_buffer radiance, children, child_counts;
    struct gpu_buffer shadow_rays, shadow_times, visibility, light_samples;
};

/* Shades the wave whose hits are listed and adds its light to the slice's sums. A batch of shadow rays, as
 * many of each hit as the buffers hold, is made in one step and traced in the next ones; wave->shadow_rays
 * counts them. */
extern const struct pass shading_pass;
/* Traces the children, as the next wave, and lists its hits. Same state. */
extern const struct pass bounce_pass;

uint64_t wave_shading_device_bytes(const struct wave_shading *shading);
/* Whether hits are likely to have children. If they have some all the same, slices whose waves do not fit are
 * split. */
bool wave_shading_expects_bounces(const struct render_frame *frame);
/* Announces the programs that every frame of the integrator needs (gpu_program_announce): those of its first wave,
 * and of its bounces where there will be some. */
void wave_shading_announce(struct wave_shading *shading, struct render_wave *wave);
/* Announces programs that shade first hits and trace their shadow rays, which take longest to compile. */
void wave_shading_announce_long(struct wave_shading *shading, struct render_wave *wave);
/* Announces the program that shades hits, the longest one in scenes of many materials. */
void wave_shading_announce_hits(struct wave_shading *shading, struct render_wave *wave);
/* Announces programs of the first wave that trace no rays. */
void wave_shading_announce_shading(struct wave_shading *shading, struct render_wave *wave);

#endif
