/* SPDX-License-Identifier: MIT */
/* From the sums of a picture to those of a denoised one; README.md says how. A strip of the picture at a time, as
 * wide and as high as a storage block holds. */
#ifndef FARLIGHT_RENDER_PASSES_DENOISE_FILTER_H
#define FARLIGHT_RENDER_PASSES_DENOISE_FILTER_H

#include "render/context/pass.h"
#include "render/passes/denoise/history.h"
#include "render/passes/denoise/sums.h"

struct denoise_filter {
    struct denoise_sums *sums; /* these three are the renderer's */
    struct denoise_history *history;
    struct picture *picture;
    struct gpu_buffer notes;                   /* notes of the slice */
    struct gpu_buffer guides, slopes;          /* guides of the first surfaces */
    struct gpu_buffer motions;                 /* motions, where the sums have them */
    struct gpu_buffer first, wider, levels[2]; /* halves of the light: at first; filtered; as it was chosen */
    struct gpu_buffer risks;
    /* progress */
    uint32_t strip_row, strip_rows; /* rows of the strip, with those that its edges depend on */
    uint32_t own_row, own_end;      /* rows of the picture that it is for */
    uint32_t pass, row;             /* the next step's; row: of the strip, or of the picture */
};

/* Notes properties of a slice's hits, for its denoiser. */
extern const struct pass guides_pass;
/* Filters a picture whose samples are complete, into DENOISE_SUM_RESULT. Same state. */
extern const struct pass denoise_pass;

/* A picture begins. */
void denoise_begin(struct denoise_filter *filter, struct denoise_sums *sums, struct denoise_history *history,
                   struct picture *picture);
uint64_t denoise_filter_device_bytes(const struct denoise_filter *filter);

#endif
