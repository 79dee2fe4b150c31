/* SPDX-License-Identifier: MIT */
/* Choices that differ from device to device. On one device each is always the same, so that the same request
 * keeps giving the same bytes. */
#ifndef FARLIGHT_RENDER_FRAME_CHOICES_H
#define FARLIGHT_RENDER_FRAME_CHOICES_H

#include "render/context/wave.h"

/* How many times as many rays as a slice its waves have room for at most: mirrors and glass rarely fill it. */
#define CHOICES_WAVE_PER_SLICE 2

/* Maximum of rays of a slice if all of its hits test every one of `lights`. */
uint32_t choices_slice_rays(const struct gpu_device *device, bool compared, uint32_t lights);
/* Whether first hits are rasterised, once the scene and the tracer of the frame are those of its request. */
bool choices_rasterise(const struct render_frame *frame);

#endif
