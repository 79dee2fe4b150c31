/* SPDX-License-Identifier: MIT */
/* From the device to memory that the taker of the frame owns. */
#ifndef FARLIGHT_RENDER_PICTURE_READBACK_H
#define FARLIGHT_RENDER_PICTURE_READBACK_H

#include "gpu/readback.h"
#include "render/picture/picture.h"

/* Reserves memory for all pixels, before the first band is read; may be put off (gpu_reserve_begin). */
bool picture_reserve_pixels(struct picture *picture, const struct render_frame *frame, struct error *error);
/* Copy picture->resolved to picture->pixels in two steps, between which the device may have other work: `resolved`
 * is free again after the first. */
bool picture_copy_band(struct picture *picture, const struct render_frame *frame, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error);
bool picture_take_band(struct picture *picture, const struct render_frame *frame, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error);
/* Leaves the request's crop of the pixels, all of which are there. */
void picture_cut(struct picture *picture, const struct frame_request *request);

#endif
