/* SPDX-License-Identifier: MIT */
/* Sums of a denoised picture beside its samples' radiance: the radiance of half of them, and properties of
 * their first hits. Slices note them, and they reach the sums when the slice reaches the picture. */
#ifndef FARLIGHT_RENDER_PASSES_DENOISE_SUMS_H
#define FARLIGHT_RENDER_PASSES_DENOISE_SUMS_H

#include "render/context/wave.h"
#include "render/passes/denoise/history.h"
#include "render/picture/picture.h"

enum denoise_sum {
    DENOISE_SUM_HALF,    /* the light of the first half: shaders/render/denoise_half.glsl */
    DENOISE_SUM_DOUBLED, /* the light of as many samples as the last power of two, which will be half of them */
    DENOISE_SUM_ALBEDO,
    DENOISE_SUM_NORMAL,
    DENOISE_SUM_MOTION, /* with has_motion */
    DENOISE_SUM_RESULT, /* the denoised picture's, of as many samples; no sum of slices */
    DENOISE_SUM_COUNT
};

struct denoise_sums {
    struct gpu_buffer *bands; /* owned; sum after sum, as the picture's bands; vec4 a slot */
    uint32_t band_count;
    /* Whether notes follow mirrors and glass to the surfaces in them. Not for pictures of one view that
     * follow each other: each sample meets other surfaces from one to the next. */
    bool follows;
    bool has_motion; /* `follows`, or an object has moved since the previous picture */
};

/* Whether the frame is to be filtered. Frames without random rays, and pictures made from others, have no
 * notes and stay unchanged. */
bool denoise_is_wanted(const struct render_frame *frame);
/* Whether the next samples are noted: DENOISE_AUTO reads none behind a limit. */
bool denoise_notes_samples(const struct render_frame *frame);
/* How much of the filtering a picture of that many samples gets, 0 to 1. */
float denoise_strength(const struct frame_request *request, uint32_t samples);
/* A program that asks how many samples a pixel has, as its tile may have stopped. `reprojected`: the light of the
 * picture has that of pictures before in it. */
const struct gpu_program *denoise_use(const struct render_frame *frame, const struct denoise_sums *sums,
                                      const char *shader, bool reprojected, struct error *error);
/* Called after picture_begin(): reserves the sums, and clears them unless the frame continues. */
bool denoise_sums_begin(struct denoise_sums *sums, const struct render_frame *frame, const struct picture *picture,
                        uint32_t samples_before, const struct denoise_history *history, struct error *error);
/* Notes properties of the hits of a new slice, which the wave has. `moved`: see denoise_history_moved().
 * Inside no span. */
bool denoise_note(const struct denoise_sums *sums, struct gpu_buffer *notes, struct gpu_buffer *moved,
                  struct render_wave *wave, struct error *error);
/* Notes the hits of the next rays, which the wave has: they are the surfaces in mirrors and behind glass. */
bool denoise_follow(const struct denoise_sums *sums, struct gpu_buffer *notes, struct gpu_buffer *moved,
                    struct render_wave *wave, struct error *error);
/* Adds the current slice, before the picture has it. Call it once the slice cannot be repeated, but on the device.
 */
bool denoise_accumulate(struct denoise_sums *sums, struct gpu_buffer *notes, struct render_wave *wave,
                        const struct picture *picture, struct error *error);
struct gpu_buffer *denoise_sums_band(const struct denoise_sums *sums, enum denoise_sum sum, uint32_t band);
uint64_t denoise_sums_device_bytes(const struct denoise_sums *sums);
void denoise_sums_finish(struct denoise_sums *sums, struct gpu_device *device);

#endif
