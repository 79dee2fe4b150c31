/* SPDX-License-Identifier: MIT */
/* Adaptive sampling: tiles of 8 x 8 pixels get no more samples once their error is below a limit.
 *
 * The error is estimated as Dammertz et al. do (A Hierarchical Automatic Stopping Condition for Monte Carlo Global
 * Illumination. 2010, section 3), from the mean of all n samples and that of a part of them. The part is the first
 * a samples, a the power of two that is at least n / 2, and not every second one: samples are stratified
 * (sequence.h), so each half of a stratified set is one itself, and every second one is not. Were the two parts
 * independent, their difference would give the mean's standard error: |mean of all - mean of the first a| * sqrt(a
 * / (n - a)). They are not: they complete each other, and the estimate is rather too high. A tile's error is the
 * root mean square of that over its pixels and channels, after exposure, divided by the tile's mean plus
 * 0.03 of white; or that of alpha, if it is larger. It is measured at 16, 24, 32, 48, 64, 96 ..
 * samples.
 *
 * Filters use the same expression, squared, as the variance of each pixel's mean; halves and half_samples stand
 * beside the picture's bands. */
#ifndef FARLIGHT_RENDER_PICTURE_NOISE_H
#define FARLIGHT_RENDER_PICTURE_NOISE_H

#include "base/error.h"
#include "gpu/buffer.h"

#define PICTURE_NOISE_UNKNOWN 1e6f /* an error, before there are 16 samples */

/* The noise of a picture whose request limits it; all-zero for other pictures. */
struct picture_noise {
    uint32_t tile_count;            /* in the order of slots */
    uint32_t going_on;              /* tiles that get samples */
    float error;                    /* maximum over the tiles, as last measured */
    uint32_t *samples;              /* owned; samples of each finished tile; 0: it is unfinished */
    float *errors;                  /* owned; of each tile */
    struct gpu_buffer tile_samples; /* `samples` on the device */
    struct gpu_buffer tile_errors;
    uint32_t band_count;
    struct gpu_buffer *halves; /* owned; like the bands of the first plane: of the first half_samples */
};

struct picture;
struct render_frame;

/* Begins the request's picture, whose bands are there, or continues it after `samples_before`. */
bool picture_noise_begin(struct picture *picture, const struct render_frame *frame, uint32_t samples_before,
                         struct error *error);
/* The next number of samples after that many at which the error is measured. */
uint32_t picture_noise_next(uint32_t samples);
bool picture_noise_is_due(const struct picture *picture, uint32_t samples);
/* Measures each unfinished tile, with that many samples, all of which are in the picture, and finishes those
 * with enough. Waits for the device. */
bool picture_noise_measure(struct picture *picture, const struct render_frame *frame, uint32_t samples,
                           struct error *error);
/* Primary rays of the picture up to that many samples. */
uint64_t picture_noise_rays(const struct picture *picture, uint32_t samples_before);
uint64_t picture_noise_device_bytes(const struct picture_noise *noise);
void picture_noise_finish(struct picture_noise *noise, struct gpu_device *device);

#endif
