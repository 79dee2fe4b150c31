/* SPDX-License-Identifier: MIT */
/* From the device to memory that the frame's taker owns. */
#include "render/picture/readback.h"

#include "base/clock.h"
#include "render/context/request.h"

#include <stdlib.h>
#include <string.h>

static size_t rows_bytes(const struct picture *picture, const struct render_frame *frame, uint32_t plane,
                         uint32_t rows)
{
    return (size_t)frame_request_plane_bytes(&frame->request, picture_plane_layer(picture, plane), rows);
}

static size_t band_bytes(const struct picture *picture, const struct render_frame *frame, uint32_t plane,
                         uint32_t band)
{
    return rows_bytes(picture, frame, plane, picture_band_row_count(picture, band));
}

bool picture_reserve_pixels(struct picture *picture, const struct render_frame *frame, struct error *error)
{
    const size_t size_bytes = (size_t)frame_request_bytes(&frame->request);
    if (!gpu_reserve_in_time(frame->device->gpu, error))
        return false;
    picture->pixels = malloc(size_bytes);
    picture->size_bytes = size_bytes;
    return picture->pixels ||
           error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture of %zu bytes", size_bytes);
}

/* Where a band belongs. */
static uint8_t *band_pixels(const struct picture *picture, const struct render_frame *frame, uint32_t plane,
                            uint32_t band)
{
    uint8_t *pixels = picture->pixels;
    for (uint32_t before = 0; before < plane; before++)
        pixels += rows_bytes(picture, frame, before, picture->height);
    return pixels + rows_bytes(picture, frame, plane, picture_band_first_row(picture, band));
}

void picture_cut(struct picture *picture, const struct frame_request *request)
{
    const struct frame_crop crop = frame_request_crop(request);
    const size_t pixel_bytes = frame_format_bytes(request->picture.format), row_bytes = crop.width * pixel_bytes;
    uint8_t *to = picture->pixels;
    for (uint32_t plane = 0; plane < picture->plane_count; plane++) {
        for (uint32_t y = 0; y < crop.height; y++, to += row_bytes) {
            const size_t row = (size_t)plane * picture->height + crop.y + y;
            memmove(to, picture->pixels + (row * picture->width + crop.x) * pixel_bytes, row_bytes);
        }
    }
    picture->size_bytes = (size_t)(to - picture->pixels);
}

bool picture_copy_band(struct picture *picture, const struct render_frame *frame, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error)
{
    context_span_begin(frame->device, STAGE_READBACK);
    bool begun = gpu_readback_copy(frame->device->gpu, copy, &picture->resolved, 0,
                                   band_bytes(picture, frame, plane, band), error);
    context_span_end(frame->device);
    return begun && gpu_readback_fence(copy, error) && gpu_check(frame->device->gpu, "copying the picture", error);
}

bool picture_take_band(struct picture *picture, const struct render_frame *frame, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error)
{
    uint8_t *pixels = band_pixels(picture, frame, plane, band);
    /* Not as a span of the device, behind which others' work may be queued already. */
    uint64_t start_ns = clock_now_ns();
    bool taken = gpu_readback_take(frame->device->gpu, copy, pixels, error);
    context_add_cpu_time(frame->device, STAGE_READBACK, start_ns);
    return taken && gpu_check_reset(frame->device->gpu, "reading the picture", error);
}
