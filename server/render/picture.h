/* SPDX-License-Identifier: MIT */
/* The sum of a picture's samples on the device, and its way to pixels on the host. */
#ifndef FARLIGHT_RENDER_PICTURE_H
#define FARLIGHT_RENDER_PICTURE_H

#include "render/context.h"

/* No storage block holds the largest picture everywhere, so it lies in bands of whole tile rows. */
struct picture {
    uint32_t width, height;
    uint32_t tiles_across;
    uint32_t samples;   /* of every pixel that the sums hold, or will when the frame in hand is done */
    uint32_t band_rows; /* pixel rows of every band but the last; a multiple of 8 */
    uint32_t band_count;
    struct gpu_buffer *bands;   /* vec4 a slot: radiance and coverage, summed */
    struct gpu_buffer resolved; /* one band in the output's format */
    uint8_t *pixels;            /* what has been read back so far */
    size_t size_bytes;
};

/* Makes room for the request's picture and sets it to zero; or, where it holds `samples_before` samples of each
 * pixel that the request's are to be added to, leaves it. */
bool picture_begin(struct picture *picture, struct render_context *context, uint32_t samples_before,
                   struct error *error);
uint32_t picture_slot_count(const struct picture *picture);
/* First slot of the band after the one that `slot` is in. */
uint32_t picture_band_end(const struct picture *picture, uint32_t slot);
/* Adds the slice in hand. */
bool picture_accumulate(struct picture *picture, struct render_context *context, struct error *error);
/* resolve.c: band -> picture->resolved; readback.c: from there to picture->pixels. */
bool picture_resolve_band(struct picture *picture, struct render_context *context, uint32_t band,
                          struct error *error);
bool picture_read_band(struct picture *picture, struct render_context *context, uint32_t band,
                       struct error *error);
uint32_t picture_band_first_row(const struct picture *picture, uint32_t band);
uint32_t picture_band_row_count(const struct picture *picture, uint32_t band);
size_t picture_pixel_bytes(enum frame_format format);
void picture_drop_pixels(struct picture *picture);
void picture_finish(struct picture *picture, struct gpu_device *device);

#endif
