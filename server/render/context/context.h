/* SPDX-License-Identifier: MIT */
/* The state that the passes of one frame share, and the buffers of the current wave. */
#ifndef FARLIGHT_RENDER_CONTEXT_H
#define FARLIGHT_RENDER_CONTEXT_H

#include "gpu/buffer.h"
#include "gpu/program.h"
#include "gpu/timer.h"
#include "render/light/environment.h"
#include "render/light/environment_choice.h"
#include "render/context/features.h"
#include "render/frame/frame.h"
#include "shared/frame.h"
#include "shared/wave.h"
#include "gpu_scene/scene.h"
#include "trace/tracer.h"
#include "render/compare/rays.h"

/* Some pixels: slots of shared/frame.h's order, all in one band. Of each as many samples as are in hand together,
 * uniforms.sample_shift. */
struct slice {
    uint32_t first_slot, slot_count;
};

struct key_view;
struct layers;

struct render_context {
    struct gpu_device *device;
    struct gpu_scene *scene; /* shared with other frames, as are the next three */
    struct environment *environment;
    struct environment_choice *environment_choice; /* which the integrator path keeps up */
    struct tracer *tracer;
    struct trace_state *trace_state; /* of the wave in hand, by that tracer */
    struct tracer *layer_tracer;     /* first hits are those of a layer of its structure; NULL: they are not */
    uint32_t layer;
    struct key_view *marked_key;     /* whose marks say which texels of it are rendered; NULL: all are */
    struct gpu_buffer *covers;       /* shared/layers.h, to be noted as waves are shaded; NULL: not */
    struct gpu_buffer *tile_samples; /* of a picture whose tiles stop one by one; NULL: of others */
    struct layers *layers;           /* of the same work */
    struct comparison *comparison;   /* of the current frame; NULL: nothing is compared */
    struct gpu_timer *timer;
    struct frame_request request;
    struct stage_times times;
    struct stage_times collected; /* only for a moment, on the way to `times` */
    struct scene_features features;
    struct frame_uniforms uniforms;
    struct gpu_buffer uniform_buffer;
    bool display_values; /* light is a display's values, see scene_environment */
    bool spread;         /* each pixel has its samples in places of its own; else sample_places' */
    bool has_filter;     /* the uniforms have the places of `filter` */
    enum pixel_filter filter;
    /* The host waits for the counts of each wave and dispatches what there is; else it queues a slice's waves on
     * what there may be at most, and the device leaves out what there is not (compact.h). */
    bool counts_on_host;
    uint32_t waves_queued;  /* of a slice, where it does not wait */
    uint32_t wave_capacity; /* rays that the buffers below hold */
    /* The current wave: ray, path and, once traced, hit of each. */
    struct gpu_buffer rays, paths, hits;
    struct gpu_buffer ray_times;            /* float a ray; empty where nothing moves */
    struct slice slice;                     /* in hand */
    uint32_t ray_count, wave_number;        /* without counts_on_host: at most; so is hit_count */
    bool sampled_hits;                      /* but for those of discs, those of the wave are stored samples */
    struct gpu_buffer hit_list, hit_places; /* of those paths that hit something, see compact.h */
    uint32_t hit_count;
    uint32_t asked;  /* shadow rays of each hit of the current wave that are traced already */
    uint32_t asking; /* and that are made and not traced to the end; 0: none */
    struct gpu_buffer block_offsets;
    struct gpu_buffer wave_state;  /* struct wave_state, of the compaction */
    struct wave_state known_state; /* with counts_on_host: as it was last read */
    struct gpu_buffer slice_sums;  /* vec4 per sample of a slice: radiance so far, coverage */
    struct gpu_buffer_place sums;  /* of the slice in hand: slice_sums, or its part of the picture */
    bool sums_in_picture;          /* it has one sample, and no slice in it must be done again */
    uint64_t shadow_rays;          /* of the slice in hand, that are not counted in the state */
    uint32_t span_count;           /* since the timer was collected */
};

/* Spans of this frame; the ring is emptied before it is full. */
void context_span_begin(struct render_context *context, enum stage stage);
void context_span_end(struct render_context *context);
void context_collect(struct render_context *context);
void context_collect_done(
    struct render_context *context); /* those that the device is through with; does not wait */
/* Spans of this frame that were not measured by its timer. */
void context_add_times(struct render_context *context, const struct stage_times *spans);
/* What the host has done for a stage since then. */
void context_add_cpu_time(struct render_context *context, enum stage stage, uint64_t start_ns);
/* The sums of the slice in hand: BIND_SLICE_SUMS. */
void context_bind_sums(const struct render_context *context);
/* A compute program of shaders/render with no defines, in use. */
const struct gpu_program *context_use(struct render_context *context, const char *compute, struct error *error);
/* `defines` ends with {0}. */
const struct gpu_program *context_use_with(struct render_context *context, const char *compute,
                                           const struct gpu_define *defines, struct error *error);
/* To programs that have HAS_TILES: which pixels the picture has, where those are not all. */
void context_bind_tiles(const struct render_context *context, const struct gpu_program *program);
/* The scene, the lights and the frame's uniforms at their places. */
void context_bind(struct render_context *context);
bool context_upload_uniforms(struct render_context *context, struct error *error);
uint64_t context_device_bytes(const struct render_context *context);
/* For passes that read hits (common/material.glsl): at most CONTEXT_SURFACE_DEFINES to `defines`. Returns how
 * many. */
#define CONTEXT_SURFACE_DEFINES 16
size_t context_surface_defines(const struct render_context *context, struct gpu_define *defines);
/* The same, with the scene, the frame's uniforms, and the rays, hits, paths and hit list of the current wave. */
void context_bind_hits(struct render_context *context);
/* Whether emissive triangles are sampled as lights. Stored samples do not tell spheres from triangles, so where
 * these shine, too, such a tracer's rays find all of it as they hit it. */
bool context_samples_emitters(const struct render_context *context);
/* Of ambient occlusion: rays a sample, and how far they look, metres. */
uint32_t context_ao_rays(const struct render_context *context);
float context_ao_distance(const struct render_context *context);
/* Reserves buffers for slices of `samples` samples and waves of wave_capacity rays. */
bool context_reserve(struct render_context *context, uint32_t slice_samples, struct error *error);
/* The times of the current wave's rays; NULL: nothing moves. */
struct gpu_buffer *context_ray_times(struct render_context *context);
void context_finish(struct render_context *context);

#endif
