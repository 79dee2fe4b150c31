/* SPDX-License-Identifier: MIT */
/* Cuts a picture's samples into slices, so that waves fit their buffers and other jobs get their turn. */
#ifndef FARLIGHT_RENDER_FRAME_SLICES_H
#define FARLIGHT_RENDER_FRAME_SLICES_H

#include "render/context/wave.h"
#include "render/picture/picture.h"

#define SLICES_WAITING_MAX 32 /* halves of halves of at most 2^32 pixels */

struct slices {
    uint32_t slice_rays; /* primary rays of a slice: pixels times samples */
    uint32_t next_slot;
    struct slice waiting[SLICES_WAITING_MAX]; /* halves of a slice that overflowed */
    uint32_t waiting_count;
};

/* How many of the remaining `samples` are traced together, as a power of two: the rays of a pixel form packets, so
 * they are adjacent in a wave. It does not change the picture. */
uint32_t slices_sample_shift(const struct slices *slices, uint32_t samples);
/* The group of samples as a power of two if slices were large, for the samples of a picture of `samples` that
 * follow the first `done`; but no more than a quarter of them, as halves of the samples are compared
 * (passes/denoise/README.md), and a part of a group is no fair share of it. */
uint32_t slices_group_shift(uint32_t samples, uint32_t done);
/* Begins with the first pixel again. */
void slices_restart(struct slices *slices);
/* The next slice for that many samples, of tiles that have not stopped and few that have between them; false: none
 * is left. */
bool slices_take(struct slices *slices, const struct picture *picture, uint32_t sample_shift, struct slice *slice);
/* The slice is done again as two halves; false: it is a single pixel. */
bool slices_split(struct slices *slices, const struct slice *slice);
/* The slice is done again. */
void slices_put_back(struct slices *slices, const struct slice *slice);

#endif
