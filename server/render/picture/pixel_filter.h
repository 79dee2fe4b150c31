/* SPDX-License-Identifier: MIT */
/* The distribution of samples about a pixel's centre. Ernst, Stamminger, Greiner. Filter Importance Sampling.
 * 2006: their density is the filter's height and all have the same weight, so a pixel does not depend on its
 * neighbours.
 *
 * The filters are products of one function of x and the same of y. The distribution is stored as places: place i
 * is the distance from the centre, in pixels, beyond which a share of (i / 64)^2 of one side's samples lies;
 * between places it is linear in i, which is true to 1/1000 of a pixel, in the outermost 1 % of the samples to
 * 1/200, and in the outermost 1/4096 keeps them within the filter. shaders/common/camera.glsl reads the same
 * table. */
#ifndef FARLIGHT_RENDER_PICTURE_PIXEL_FILTER_H
#define FARLIGHT_RENDER_PICTURE_PIXEL_FILTER_H

#include "render/context/request.h"

#define PIXEL_FILTER_INTERVALS 64

/* Radius of the filter, pixels. */
double pixel_filter_radius(enum pixel_filter filter);
/* The share of samples whose x lies within `distance` of the centre, 0..1. */
double pixel_filter_share(enum pixel_filter filter, double distance);
/* PIXEL_FILTER_INTERVALS + 1 places. */
void pixel_filter_places(float *places, enum pixel_filter filter);
/* From a number in [0, 1) to an offset from the centre, pixels; ascending. */
float pixel_filter_offset(const float *places, float number);

#endif
