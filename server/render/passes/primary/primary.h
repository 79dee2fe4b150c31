/* SPDX-License-Identifier: MIT */
/* What the eye sees first: rays of a slice's pixels and, where they are rasterised, their hits. */
#ifndef FARLIGHT_RENDER_PASSES_PRIMARY_H
#define FARLIGHT_RENDER_PASSES_PRIMARY_H

#include "gpu/texture.h"
#include "render/context/context.h"
#include "trace/raster/view.h"

/* The visibility buffer: which primitive of which instance each pixel sees, in a layer for each of the current
 * samples. It has a strip of the picture's rows at a time, so that no picture needs more than some memory at once.
 */
struct primary {
    /* RG32UI: instance + 1 (0: nothing), primitive; row 0 is the strip's uppermost. An array. */
    struct gpu_texture visible;
    struct gpu_texture depth; /* reversed, 32-bit float; of the layer that is drawn */
    struct gpu_framebuffer framebuffers[SAMPLES_TOGETHER_MAX]; /* one a layer */
    uint32_t first_row;                                        /* of the strip, in the picture */
    uint32_t layer_count;                                      /* that are drawn */
    /* where drawing goes on */
    uint32_t layer;
    struct raster_view view;
    bool cleared;
};

/* Makes room for strips of that many rows of the request's picture, and for that many samples. */
bool primary_reserve(struct primary *primary, struct render_context *context, uint32_t rows, uint32_t samples,
                     struct error *error);
/* Draws the strip from that row on for all samples that the uniforms describe, a part of the scene a call until it
 * is done. */
void primary_rasterise_begin(struct primary *primary, uint32_t first_row, uint32_t samples);
bool primary_rasterise(struct primary *primary, struct render_context *context, bool *done, struct error *error);
/* Rays, paths and black pixels of context->slice. */
bool primary_begin_slice(const struct primary *primary, struct render_context *context, struct error *error);
/* Its hits, from the visibility buffer, or, where `primary` is NULL, a part of them a call from the tracer. */
bool primary_find(const struct primary *primary, struct render_context *context, bool *done, struct error *error);
/* In place of that, for rays that only ask where they hit: their intersections, a part of them a call; and then,
 * if their surfaces are asked for after all, hits of them and the list of these. */
bool primary_intersect(struct render_context *context, bool *done, struct error *error);
bool primary_make_surfaces(struct render_context *context, struct error *error);
/* In place of all that, where the tracer has a shorter way to where eyes look (tracer_finds_eyes): begins a slice;
 * and shared/eye_hit.h in place of its hits. */
void primary_begin_eyes(struct render_context *context);
bool primary_find_eyes(struct render_context *context, struct error *error);
/* Announces the programs of the first hits (gpu_program_announce). */
void primary_announce(struct render_context *context, bool rasterised);
void primary_finish(struct primary *primary, struct gpu_device *device);

#endif
