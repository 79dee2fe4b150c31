/* SPDX-License-Identifier: MIT */
/* The wave in progress: a slice's rays, their paths and hits, and the sums of the slice. */
#ifndef FARLIGHT_RENDER_CONTEXT_WAVE_H
#define FARLIGHT_RENDER_CONTEXT_WAVE_H

#include "render/context/frame.h"
#include "shared/wave.h"

struct wave_notes;

/* Some pixels: slots of shared/frame.h's order, all in one band. The samples of a pixel that are traced together,
 * 2^sample_shift of the uniforms, are in one slice. */
struct slice {
    uint32_t first_slot, slot_count;
};

struct render_wave {
    struct render_device *device;
    const struct render_frame *frame;
    struct wave_notes *notes; /* notes that shading takes for layers */
    uint32_t waves_queued;    /* waves of a slice, where the host does not wait for their counts */
    uint32_t capacity;        /* rays that the buffers hold */
    struct slice slice;
    bool has_rays;                 /* the slice's first rays are made */
    uint32_t number;               /* 0: first hits */
    uint32_t ray_count, hit_count; /* without counts_on_host: their maxima */
    struct gpu_buffer rays, paths, hits;
    struct gpu_buffer ray_times;            /* float a ray; empty if all stands still */
    bool sampled_hits;                      /* the hits, but for those of discs, are stored samples */
    struct gpu_buffer hit_list, hit_places; /* the paths with a hit, see waves/compact.h */
    uint32_t asked;                         /* shadow rays of each hit that are traced */
    uint32_t asking; /* shadow rays of each hit that are made but not traced to the end; 0: none */
    struct gpu_buffer block_offsets;
    struct gpu_buffer state;       /* struct wave_state, kept by the compaction */
    struct wave_state known_state; /* with counts_on_host: as it was last read */
    struct gpu_buffer slice_sums;  /* vec4 per sample of a slice: radiance so far, coverage */
    struct gpu_buffer_place sums;  /* the slice's sums: slice_sums, or its part of the picture */
    uint64_t shadow_rays;          /* shadow rays of the slice that the state does not count */
};

/* Sets the wave's number, for its spans too. */
void context_set_number(struct render_wave *wave, uint32_t number);
/* Binds the sums of the slice: BIND_SLICE_SUMS. */
void context_bind_sums(const struct render_wave *wave);
/* Binds the scene, the frame's uniforms and the wave's state. */
void context_bind(struct render_wave *wave);
/* Binds these, and the rays, hits, paths and hit list of the wave. */
void context_bind_hits(struct render_wave *wave);
/* Defines of passes that read hits (common/material.glsl): at most CONTEXT_SURFACE_DEFINES to `defines`. Returns
 * how many. */
#define CONTEXT_SURFACE_DEFINES 16
size_t context_surface_defines(const struct render_wave *wave, struct gpu_define *defines);
/* Reserves buffers for slices of `samples` samples and waves of `capacity` rays. */
bool context_reserve(struct render_wave *wave, uint32_t slice_samples, struct error *error);
/* The times of the wave's rays; NULL: all stands still. */
struct gpu_buffer *context_ray_times(struct render_wave *wave);
uint64_t context_device_bytes(const struct render_wave *wave);
void context_finish(struct render_wave *wave);

#endif
