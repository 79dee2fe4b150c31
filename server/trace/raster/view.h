/* SPDX-License-Identifier: MIT */
/* Draws the visible surfaces of a view: which primitive of which instance, and its depth, reversed (1 at the
 * near distance). GL thread, a part at a time. */
#ifndef FARLIGHT_TRACE_RASTER_VIEW_H
#define FARLIGHT_TRACE_RASTER_VIEW_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu_scene/scene.h"
#include "shared/frame.h"

#include <stdbool.h>
#include <stdint.h>

/* The view of shaders/shared/frame.h. */
struct raster_camera {
    float world_from_view[12]; /* rigid; looks along -z, y up */
    float extent[2];           /* half width and height at distance 1; orthographic: half size of the view
                                  itself */
    float near, far;           /* far: for an orthographic view only */
    bool orthographic;
    uint32_t width, height;
};
/* Fills the camera's members of the uniforms, and no others, for a picture with one view. */
void raster_camera_fill(struct frame_uniforms *uniforms, const struct raster_camera *camera);

/* The near distance of a view, metres; where `near` is 0, one at which nothing is cut off. */
float raster_near(const struct gpu_scene *scene, float near, bool orthographic);

/* Primitives of an instance, counted from its first. */
struct raster_span {
    uint32_t instance, first, end;
};

/* Progress of drawing, and the size of a part. All-zero is valid; measured costs stay. */
struct raster_view {
    uint32_t sort, span, primitive; /* span: an instance where there are no spans */
    uint32_t part_vertices; /* vertices of a part, or pixels that cost as much, times step_scale; 0: unknown yet */
    bool has_some;          /* the part has a primitive already */
};

struct raster_view_target {
    struct gpu_device *device;
    const struct gpu_scene *scene;
    const struct frame_uniforms *frame; /* the uniforms at UNIFORM_FRAME */
    uint32_t first_row;                 /* row of the view's picture that is the framebuffer's first */
    uint32_t sample;                    /* index in frame_uniforms.sample_places */
    /* Number of layers that are drawn now. 0: the nearest surface, and no layer will follow. 1: the nearest
     * behind the depths at UNIT_TRACER_2, if has_before. 2 or 3: as many colours, for layers from the nearest
     * on, and after them a colour of as many depths, all cleared to 0; no depth is tested, and the device
     * fetches_framebuffer. */
    uint32_t layers;
    bool has_before;
    const struct raster_span *spans; /* the only primitives drawn, besides discs; NULL: all instances, whole */
    uint32_t span_count;
};

void raster_view_begin(struct raster_view *view);
/* Draws the next part into the framebuffer that is bound, with the scene and UNIFORM_FRAME bound and the viewport
 * set. Sets all other state, and leaves the tests of depth and sides off. *whole: nothing is left. */
bool raster_view_draw(struct raster_view *view, const struct raster_view_target *target, bool *whole,
                      struct error *error);
/* Adapts the size of a part to the time that the last one took; step_ns is the maximum. */
void raster_view_learn(struct raster_view *view, uint64_t took_ns, uint64_t step_ns);
/* Gets the programs that draw the nearest surfaces of a scene, to announce them (gpu_program_announce). */
void raster_view_announce(struct gpu_device *device, const struct gpu_scene *scene);

#endif
