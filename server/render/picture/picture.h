/* SPDX-License-Identifier: MIT */
/* The sums of a picture's samples on the device, and their way to pixels on the host. */
#ifndef FARLIGHT_RENDER_PICTURE_H
#define FARLIGHT_RENDER_PICTURE_H

#include "render/context/wave.h"
#include "render/picture/noise.h"

/* No storage block holds the largest picture everywhere, so it lies in bands of whole tile rows. */
struct picture {
    uint32_t width, height;
    uint32_t tiles_across;
    uint32_t crop_left, crop_right, crop_top, crop_bottom; /* tiles that get samples: from, and up to before */
    uint32_t samples;   /* samples per pixel in the sums, those of the current frame included; see noise */
    uint32_t band_rows; /* pixel rows of every band but the last; a multiple of 8 */
    uint32_t cleared;   /* bands that are so for this frame */
    uint32_t band_count;
    uint32_t layers;          /* bits; each layer is a plane, in the order of their numbers */
    uint32_t plane_count;     /* number of planes */
    struct gpu_buffer *bands; /* plane after plane; vec4 a slot, of the beauty radiance and coverage, summed */
    const struct gpu_buffer *denoised; /* bands that are shown in place of those of the first plane; NULL: none */
    struct picture_noise noise;        /* where tiles stop one by one */
    struct gpu_buffer resolved;        /* a band of a plane in the output's format */
    uint8_t *pixels;                   /* pixels read back so far, plane after plane */
    size_t size_bytes;
};

/* Begins another frame: all of the picture is to be cleared. */
void picture_restart(struct picture *picture);
/* Gives it the request's size; a picture of `samples_before` samples per pixel, to which the request adds, is
 * kept. */
bool picture_begin(struct picture *picture, struct render_frame *frame, uint32_t samples_before,
                   struct error *error);
/* Reserves and clears it, unless it is kept; may be put off (gpu_reserve_begin). */
bool picture_reserve(struct picture *picture, const struct render_frame *frame, uint32_t samples_before,
                     struct error *error);
bool picture_has_tile(const struct picture *picture, uint32_t tile); /* whether a tile gets samples */
/* The end of the slots without a gap, from `slot` on, whose tiles get samples. */
uint32_t picture_run_end(const struct picture *picture, uint32_t slot);
/* Row of the first slot of a band. */
uint32_t picture_row_of(const struct picture *picture, uint32_t slot);
/* Rows of as many whole bands as have that many pixels, at least one; all rows if there are no more. */
uint32_t picture_strip_rows(const struct picture *picture, uint32_t pixels_max);
uint32_t picture_slot_count(const struct picture *picture);
/* First slot of the band after the one that `slot` is in. */
uint32_t picture_band_end(const struct picture *picture, uint32_t slot);
/* The program that adds slices, in use. */
const struct gpu_program *picture_accumulate_program(struct render_wave *wave, struct error *error);
/* The place where the current slice is summed up: for a picture of one sample that is the picture, but for parts
 * of a slice that begin where no storage block may. */
struct gpu_buffer_place picture_sums_place(const struct picture *picture, const struct render_wave *wave);
/* Adds the current slice to a plane: the slice's samples in `sums` from first_sum on. */
bool picture_accumulate(struct picture *picture, struct render_wave *wave, uint32_t plane, struct gpu_buffer *sums,
                        uint32_t first_sum, struct error *error);
enum layer picture_plane_layer(const struct picture *picture, uint32_t plane);
struct gpu_buffer *picture_band(const struct picture *picture, uint32_t plane, uint32_t band);
/* How many slots a band has, and the first of them. */
uint32_t picture_band_slots(const struct picture *picture, uint32_t band, uint32_t *first);
/* The band that the slice is in, and its first slot there. */
uint32_t picture_slice_band_number(const struct picture *picture, const struct slice *slice, uint32_t *first_slot);
/* The band of the first plane that the slice is in, and its first slot there. */
struct gpu_buffer *picture_slice_band(const struct picture *picture, const struct slice *slice,
                                      uint32_t *first_slot);
uint64_t picture_device_bytes(const struct picture *picture);
uint32_t picture_band_first_row(const struct picture *picture, uint32_t band);
uint32_t picture_band_row_count(const struct picture *picture, uint32_t band);
void picture_drop_pixels(struct picture *picture);
void picture_finish(struct picture *picture, struct gpu_device *device);

#endif
