/* SPDX-License-Identifier: MIT */
/* Draws what a view sees of the scene: which primitive of which instance, and its depth, reversed (1 at the near
 * distance). A part at a time. GL thread. */
#ifndef FARLIGHT_TRACE_RASTER_VIEW_H
#define FARLIGHT_TRACE_RASTER_VIEW_H

#include "base/error.h"
#include "gpu/device.h"
#include "gpu_scene/scene.h"
#include "shared/frame.h"

#include <stdbool.h>
#include <stdint.h>

/* A view as shaders/shared/frame.h has it. */
struct raster_camera {
    float world_from_view[12]; /* rigid; looks along -z, y up */
    float extent[2];           /* half width and height at distance 1; orthographic: of the view itself */
    float near, far;           /* far: of an orthographic view alone */
    bool orthographic;
    uint32_t width, height;
};
/* Fills the camera's part of the uniforms, and no other: of a picture that has one view. */
void raster_camera_fill(struct frame_uniforms *uniforms, const struct raster_camera *camera);

/* The near distance of a view, metres; where `near` is 0 one that cuts nothing off. */
float raster_near(const struct gpu_scene *scene, float near, bool orthographic);

/* Primitives of an instance, counted from its first. */
struct raster_span {
    uint32_t instance, first, end;
};

/* Where drawing goes on, and how large a part is. All-zero is valid; it keeps what it has learnt. */
struct raster_view {
    uint32_t sort, span, primitive; /* span: an instance where there are no spans */
    uint32_t part_vertices;         /* that are drawn in one part, times step_scale; 0: not known yet */
};

struct raster_view_target {
    struct gpu_device *device;
    const struct gpu_scene *scene;
    uint32_t first_row; /* of the framebuffer, in the view's picture */
    uint32_t sample;    /* of frame_uniforms.sample_places */
    /* That are drawn now. 0: what is nearest, and no layer will follow. 1: the nearest of what lies behind the
     * depths at UNIT_TRACER_2, if has_before. 2 or 3: so many colours, of layers from the nearest on, and behind
     * them a colour of as many depths, all cleared to 0; there are no depths to test, and the device
     * fetches_framebuffer. */
    uint32_t layers;
    bool has_before;
    const struct raster_span *spans; /* that alone are drawn, besides discs; NULL: all instances, whole */
    uint32_t span_count;
};

void raster_view_begin(struct raster_view *view);
/* Draws the next part into the framebuffer that is bound, with the scene and UNIFORM_FRAME bound and the viewport
 * set. Sets all other state, and leaves the tests of depth and sides off. *whole: nothing is left. */
bool raster_view_draw(struct raster_view *view, const struct raster_view_target *target, bool *whole,
                      struct error *error);
/* From the time that a part took, where step_ns is what it should take at most. */
void raster_view_learn(struct raster_view *view, uint64_t took_ns, uint64_t step_ns);
/* Gets the programs that what is nearest needs of a scene, to announce them (gpu_program_announce). */
void raster_view_announce(struct gpu_device *device, const struct gpu_scene *scene);

#endif
