/* SPDX-License-Identifier: MIT */
/* The frame in progress: its request, its scene, and the values derived from both. It is set when the frame,
 * or one of the pictures that it needs, begins; passes read it. */
#ifndef FARLIGHT_RENDER_CONTEXT_FRAME_H
#define FARLIGHT_RENDER_CONTEXT_FRAME_H

#include "gpu/buffer.h"
#include "gpu_scene/scene.h"
#include "render/context/device.h"
#include "render/context/features.h"
#include "render/context/request.h"
#include "shared/frame.h"
#include "trace/tracer.h"

struct comparison;
struct environment;
struct environment_choice;
struct integrator;

/* The tiles of a picture that are rendered, where the others are not (shared/key_view.h). */
struct frame_tiles {
    struct gpu_buffer *list; /* NULL: all tiles are rendered */
    struct gpu_buffer *marks;
    uint32_t first_tile, first_mark;
};

struct render_frame {
    struct render_device *device;
    /* These four are shared with other frames. */
    struct gpu_scene *scene;
    struct environment *environment;
    struct environment_choice *environment_choice; /* kept up to date for integrators that sample it */
    struct tracer *tracer;
    struct trace_state *trace_state; /* the state of waves that this tracer traces */
    const struct integrator *integrator;
    struct tracer *layer_tracer; /* first hits are those of a layer of its structure; NULL: they are not */
    uint32_t layer;
    struct frame_tiles tiles;
    struct gpu_buffer *tile_samples; /* samples of tiles that stop one by one; NULL: no tile stops */
    struct comparison *comparison;   /* NULL: tracers are not compared */
    struct frame_request request;
    struct scene_features features;
    struct frame_uniforms uniforms;
    struct gpu_buffer uniform_buffer;
    bool display_values;  /* light is a display's values, see scene_environment */
    bool spread;          /* each pixel has its samples in places of its own; else all have sample_places */
    bool has_filter;      /* the uniforms have the places of `filter` */
    bool sums_in_picture; /* the picture has one sample, and no slice in it is ever repeated */
    enum pixel_filter filter;
};

/* Binds the scene and the frame's uniforms. */
void context_bind_frame(const struct render_frame *frame);
/* Sets the tiles that are rendered, for programs that have HAS_TILES. */
void context_bind_tiles(const struct render_frame *frame, const struct gpu_program *program);
bool context_upload_uniforms(struct render_frame *frame, struct error *error);
/* Whether emissive triangles are sampled as lights. Stored samples do not distinguish spheres from triangles,
 * so if spheres glow as well, rays of such a tracer find all of that light by hitting it. */
bool context_samples_emitters(const struct render_frame *frame);
/* Ambient occlusion: rays a sample, and their reach in metres. */
uint32_t context_ao_rays(const struct render_frame *frame);
float context_ao_distance(const struct render_frame *frame);

#endif
