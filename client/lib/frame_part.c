/* SPDX-License-Identifier: MIT */
/* Cutting a part out of a frame. */
#include "lib/frame_part.h"

#include "protocol/messages.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

/* Rows of all layers, of `pixel_bytes` each. */
static void copy_rows(uint8_t *to, const struct fl_frame *frame, const struct fl_frame_part *part,
                      size_t pixel_bytes)
{
    const size_t row_bytes = part->width * pixel_bytes;
    const size_t layers = frame->layers ? (size_t)__builtin_popcount(frame->layers) : 1;
    for (size_t layer = 0; layer < layers; layer++) {
        for (size_t y = 0; y < part->height; y++, to += row_bytes) {
            const size_t row = layer * frame->height + part->y + y;
            memcpy(to, frame->pixels + (row * frame->width + part->x) * pixel_bytes, row_bytes);
        }
    }
}

void fl_frame_alike(struct fl_frame *to, const struct fl_frame *frame, uint32_t width, uint32_t height)
{
    *to = *frame;
    to->width = width;
    to->height = height;
    to->pixels = NULL;
    to->pixels_bytes = 0;
    to->stages = NULL;
    to->stage_count = 0;
    to->wave_comparisons = NULL;
    to->wave_comparison_count = 0;
    to->structure = NULL;
    to->structure_count = 0;
    to->encoded = NULL;
    to->encoded_bytes = 0;
    to->depth = NULL;
    to->normals = NULL;
    to->sticking = NULL;
}

struct fl_frame *fl_frame_cut(const struct fl_frame *frame, const struct fl_frame_part *part,
                              struct fl_error *error)
{
    if (!frame->pixels || !part->width || !part->height || part->width > frame->width ||
        part->height > frame->height || part->x > frame->width - part->width ||
        part->y > frame->height - part->height) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "the frame has no such part");
        return NULL;
    }
    const size_t pixel_bytes = protocol_pixel_format_bytes(frame->format);
    const size_t layers = frame->layers ? (size_t)__builtin_popcount(frame->layers) : 1;
    const size_t bytes = layers * part->width * part->height * pixel_bytes;
    struct fl_frame *cut = malloc(sizeof(*cut));
    uint8_t *pixels = malloc(bytes);
    if (!cut || !pixels) {
        free(cut);
        free(pixels);
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    copy_rows(pixels, frame, part, pixel_bytes);
    fl_frame_alike(cut, frame, part->width, part->height);
    cut->pixels = pixels;
    cut->pixels_bytes = bytes;
    cut->digest = XXH3_64bits(pixels, bytes);
    for (int row = 0; row < 3; row++) {
        float *to = cut->world_from_view + (size_t)(4 * row);
        to[3] += to[0] * part->eye[0] + to[1] * part->eye[1];
    }
    return cut;
}
