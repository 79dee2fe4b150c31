/* SPDX-License-Identifier: MIT */
/* Counts the depth of a scene before anything is built: how many samples its images along the axes would have,
 * hence the resolution at which a structure of them stays within bounds, and how deep they are where they are
 * deepest. The number is the sum of the primitives' projected areas in texels (Cauchy: the mean number of
 * intersections of a line with a surface is its projected area over the images' area), so it holds for rods
 * thinner than a texel too, and nothing is drawn for it. */
#ifndef FARLIGHT_TRACE_RASTER_FIT_H
#define FARLIGHT_TRACE_RASTER_FIT_H

#include "trace/raster/box.h"
#include "trace/structure.h"
#include "trace/tracer.h"

/* A structure of more samples than facts.axes_samples_max is made coarser. This many all three images have at 1024
 * texels along a side where every texel has four layers: the limit for software GL. A GPU is several times faster
 * and has somewhat larger texel buffers, so its limit is axes_times() as high. */
#define AXES_SAMPLES_USUAL (4.0 * 3.0 * 1024.0 * 1024.0)
double axes_times(const struct gpu_device *device);
/* Minimum resolution: a coarser picture would show nothing of a scene that deep. */
#define AXES_FITTED_MIN 128u

/* Where no resolution is requested, a structure costs no more than it is worth for the picture; a picture of
 * fewer pixels than this counts as one of this many. A texel without samples costs this share of a sample. */
#define AXES_PICTURE_PIXELS_MIN 65536u
#define AXES_TEXEL_COST 0.2

struct axes_layers {
    double mean;     /* over all texels of the three images, at any resolution: within a tenth for surfaces of many
                      * primitives */
    double greatest; /* mean over the deepest of 128 x 128 blocks of each image: single texels may be deeper */
};

/* Counts layers. A sample of the primitives stands for large meshes; deforming meshes count at rest. `overlap`
 * is that of axes_pass; with 0 every triangle is in all images except those along whose axis its unit normal
 * has a smaller component than `steep`. `whole` is the cube as one cell. */
struct axes_layers axes_count_layers(const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                                     float overlap, float steep, const struct axes_box *whole);

struct axes_request {
    uint32_t resolution;      /* requested; 0: chosen */
    uint32_t usual;           /* maximum of a chosen one */
    double samples_per_pixel; /* samples per pixel of the picture that are worth their time */
};

/* The resolution of a scene that needs no lower one. */
uint32_t axes_greatest_resolution(const struct axes_request *request);

/* Returns the requested resolution; where it is chosen, the one that fits the layers and the picture, at least
 * AXES_FITTED_MIN. */
uint32_t axes_choose_resolution(const struct tracer *tracer, double layers, const struct axes_request *request);

/* Lowers *resolution until the mean number of `layers` is within the tracer's limit. Fails, with a remedy, if
 * that is below both AXES_FITTED_MIN and the requested resolution. */
bool axes_fit_resolution(const struct tracer *tracer, double layers, uint32_t *resolution, struct error *error);

/* Fails, with a remedy, where the maximum number of `layers` is above `maximum`. */
bool axes_fit_depth(const struct tracer *tracer, double layers, uint32_t maximum, struct error *error);

/* The resolution below which the picture lacks detail: the requested one, or one texel for two pixels along the
 * middle of the picture's sides, with which shadows are at most a pixel off. */
uint32_t axes_wanted_resolution(const struct tracer *tracer, const struct axes_request *request);

/* Adds a warning to the row of a structure's resolution where a higher one was wanted. */
void axes_fit_warn(struct structure_row *resolution, uint32_t wanted);

#endif
