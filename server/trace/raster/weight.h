/* SPDX-License-Identifier: MIT */
/* Estimates the cost of primitives before they are drawn: nothing interrupts a draw, and one of many primitives
 * that each fill the picture takes software GL minutes. */
#ifndef FARLIGHT_TRACE_RASTER_WEIGHT_H
#define FARLIGHT_TRACE_RASTER_WEIGHT_H

#include "gpu_scene/scene.h"
#include "shared/frame.h"

#include <stdint.h>

/* A view, and an instance as it sees it. */
struct raster_sight {
    float view_from_world[12], extent[2], near; /* members of frame_uniforms */
    bool orthographic;
    float pixels;    /* pixels of the picture */
    float unit_area; /* pixels of a surface of area 1 that faces the view at distance 1; orthographic: anywhere */
    float from_object[12]; /* object to view space */
    float scale;           /* maximum of lengths, object to view space */
    float swelling;        /* how many times as large as at rest areas are */
    const struct gpu_scene_geometry *geometry;
};

void raster_sight_begin(struct raster_sight *sight, const struct frame_uniforms *frame);
void raster_sight_take(struct raster_sight *sight, const struct gpu_scene *scene, uint32_t instance);
/* Pixels that each primitive of the instance's run covers on average, an upper bound but for curved runs. */
float raster_pixels_of_run(const struct raster_sight *sight, uint32_t run);
float raster_pixels_of_disc(const struct raster_sight *sight, const struct disc *disc);

#endif
