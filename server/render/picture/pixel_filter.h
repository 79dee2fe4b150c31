/* SPDX-License-Identifier: MIT */
/* The distribution of samples about a pixel's centre. Ernst, Stamminger, Greiner. Filter Importance Sampling.
 * 2006: they are as dense as the filter is high and all weigh the same, so a pixel needs nothing of its
 * neighbours.
 *
 * The filters are products of one function of x and the same of y. Its distribution is kept as places: place i is
 * how far from the centre, in pixels, a share of (i / 64)^2 of one side's samples lies or farther; between places
 * it is linear in i, which is true to 1/1000 of a pixel, in the outermost 1 % of the samples to 1/200, and in the
 * outermost 1/4096 keeps them within the filter. shaders/common/camera.glsl looks up the same. */
#ifndef FARLIGHT_RENDER_PICTURE_PIXEL_FILTER_H
#define FARLIGHT_RENDER_PICTURE_PIXEL_FILTER_H

#include "render/context/request.h"

#define PIXEL_FILTER_INTERVALS 64

/* From the centre to where the filter ends, pixels. */
double pixel_filter_radius(enum pixel_filter filter);
/* The share of samples whose x lies within `distance` of the centre, 0..1. */
double pixel_filter_share(enum pixel_filter filter, double distance);
/* PIXEL_FILTER_INTERVALS + 1 places. */
void pixel_filter_places(float *places, enum pixel_filter filter);
/* From a number in [0, 1) to an offset from the centre, pixels; ascending. */
float pixel_filter_offset(const float *places, float number);

#endif
