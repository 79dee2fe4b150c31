/* SPDX-License-Identifier: MIT */
/* First hits: rays of a slice's pixels and, where they are rasterised, the visibility buffer. */
#ifndef FARLIGHT_RENDER_PASSES_PRIMARY_H
#define FARLIGHT_RENDER_PASSES_PRIMARY_H

#include "gpu/texture.h"
#include "render/context/pass.h"
#include "trace/raster/view.h"

/* The visibility buffer: which primitive of which instance each pixel sees, in a layer for each of the current
 * samples. It has a strip of the picture's rows at a time, so that no picture needs more than some memory at once.
 */
struct primary {
    bool rasterises;           /* first hits of the frame are rasterised, else traced */
    uint32_t strip_rows;       /* rows that are rasterised together */
    uint32_t sample_shift_max; /* 2^this samples are rendered together at most */
    /* RG32UI: instance + 1 (0: no surface), primitive; row 0 is the strip's uppermost. An array. */
    struct gpu_texture visible;
    struct gpu_texture depth; /* reversed, 32-bit float; of the layer that is drawn */
    struct gpu_framebuffer framebuffers[SAMPLES_TOGETHER_MAX]; /* a framebuffer for each layer */
    uint32_t first_row;                                        /* the strip's first row in the picture */
    uint32_t layer_count;                                      /* layers that are drawn */
    /* layer at which drawing continues */
    uint32_t layer;
    struct raster_view view;
    bool cleared;
};

/* Makes the rays of a slice and finds their hits: in the visibility buffer, or by the tracer. */
extern const struct pass primary_pass;

/* Draws the strip from that row on for all samples that the uniforms describe, a part of the scene a call until it
 * is done. */
void primary_rasterise_begin(struct primary *primary, uint32_t first_row, uint32_t samples);
bool primary_rasterise(struct primary *primary, const struct render_frame *frame, bool *done, struct error *error);
/* Parts of the pass for eyes of a key view (key_view/eyes.h). Begin a slice: with rays, or without them if
 * the tracer finds the eyes' hits itself (tracer_finds_eyes). */
bool primary_begin_traced(struct render_wave *wave, struct error *error);
void primary_begin_eyes(struct render_wave *wave);
/* Find the hits of eyes: shared/eye_hit.h in place of hits. */
bool primary_find_eyes(struct render_wave *wave, struct error *error);
/* Find the rays' intersections alone, a part of them a call; and, if their surfaces are needed after all, make
 * hits of them and list these. */
bool primary_intersect(struct render_wave *wave, bool *done, struct error *error);
bool primary_make_surfaces(struct render_wave *wave, struct error *error);
/* Announces the programs of the first hits (gpu_program_announce). */
void primary_announce(struct render_wave *wave, bool rasterised);

#endif
