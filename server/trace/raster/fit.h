/* SPDX-License-Identifier: MIT */
/* The depth of a scene, counted before anything of it is built: how many samples its images along the axes would
 * have, and so the resolution at which a structure of them stays within bounds; and how deep they are where they
 * are deepest. The number is the sum of the primitives' projected areas in texels (Cauchy: what a line meets of a
 * surface is, on average, its projected area over that of the images), so it holds for rods thinner than a texel
 * too, and nothing is drawn for it. */
#ifndef FARLIGHT_TRACE_RASTER_FIT_H
#define FARLIGHT_TRACE_RASTER_FIT_H

#include "trace/raster/box.h"
#include "trace/structure.h"
#include "trace/tracer.h"

/* A structure of more samples than facts.axes_samples_max is made coarser. This many all three images have at 1024
 * texels along a side where every texel has four layers: what software GL may have. A GPU, which is as much
 * faster, and whose texel buffers end a little farther on, may have some times as many. */
#define AXES_SAMPLES_USUAL (4.0 * 3.0 * 1024.0 * 1024.0)
double axes_times(const struct gpu_device *device);
/* Coarser than this, a picture would show nothing of what is so deep. */
#define AXES_FITTED_MIN 128u

/* Where no resolution was asked for, a structure costs no more than what is worth its time for the picture; one of
 * fewer pixels than this counts as one of this many. A texel without samples costs a share of a sample. */
#define AXES_PICTURE_PIXELS_MIN 65536u
#define AXES_TEXEL_COST 0.2

struct axes_layers {
    double mean;     /* over all texels of the three images, at any resolution: within a tenth for surfaces of many
                      * primitives */
    double greatest; /* of 128 x 128 blocks of each image, the mean of the deepest: single texels may be deeper */
};

/* Of large meshes some primitives stand for all; meshes that deform count as if they did not. `overlap`: as
 * axes_pass; 0: every triangle is in all images, but for those whose unit normal has a smaller component than
 * `steep` along the axis. `whole`: the cube, as one cell. */
struct axes_layers axes_count_layers(const struct gpu_scene *scene, const uint32_t *instances, uint32_t count,
                                     float overlap, float steep, const struct axes_box *whole);

struct axes_wish {
    uint32_t resolution;      /* asked for; 0: chosen */
    uint32_t usual;           /* the maximum of those that are chosen */
    double samples_per_pixel; /* of the picture, that are worth their time */
};

/* The resolution that a scene has where it needs no lower one. */
uint32_t axes_greatest_resolution(const struct axes_wish *wish);

/* That which was asked for; where it is chosen, what goes with the layers and the picture, and not less than
 * AXES_FITTED_MIN. */
uint32_t axes_choose_resolution(const struct tracer *tracer, double layers, const struct axes_wish *wish);

/* Lowers *resolution to what `layers`, on average, allow the tracer. Fails, with a remedy, where that were less
 * than AXES_FITTED_MIN and less than what was asked for. */
bool axes_fit_resolution(const struct tracer *tracer, double layers, uint32_t *resolution, struct error *error);

/* Fails, with a remedy, where the greatest number of `layers` is above the maximum. */
bool axes_fit_depth(const struct tracer *tracer, double layers, uint32_t maximum, struct error *error);

/* The resolution below which the picture lacks something: that which was asked for, or one texel for two pixels
 * along the middle of the picture's sides, of which shadows are then a pixel off at most. */
uint32_t axes_wanted_resolution(const struct tracer *tracer, const struct axes_wish *wish);

/* Says in the row of a structure's resolution, as a warning, that more was wanted, where it was. */
void axes_fit_tell(struct structure_row *resolution, uint32_t wanted);

#endif
