/* SPDX-License-Identifier: MIT */
/* From the device to memory that the frame's taker owns. */
#include "render/picture.h"

#include "base/clock.h"
#include "render/frame_request.h"

#include <stdlib.h>

static size_t rows_bytes(const struct picture *picture, const struct render_context *context, uint32_t plane,
                         uint32_t rows)
{
    return (size_t)frame_request_plane_bytes(&context->request, picture_plane_layer(picture, plane), rows);
}

static size_t band_bytes(const struct picture *picture, const struct render_context *context, uint32_t plane,
                         uint32_t band)
{
    return rows_bytes(picture, context, plane, picture_band_row_count(picture, band));
}

bool picture_reserve_pixels(struct picture *picture, const struct render_context *context, struct error *error)
{
    const size_t size_bytes = (size_t)frame_request_bytes(&context->request);
    if (!gpu_reserve_goes_on(context->device, size_bytes, error))
        return false;
    picture->pixels = malloc(size_bytes);
    picture->size_bytes = size_bytes;
    return picture->pixels ||
           error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture of %zu bytes", size_bytes);
}

/* Where a band belongs. */
static uint8_t *band_pixels(const struct picture *picture, const struct render_context *context, uint32_t plane,
                            uint32_t band)
{
    uint8_t *pixels = picture->pixels;
    for (uint32_t before = 0; before < plane; before++)
        pixels += rows_bytes(picture, context, before, picture->height);
    return pixels + rows_bytes(picture, context, plane, picture_band_first_row(picture, band));
}

bool picture_read_band(struct picture *picture, struct render_context *context, uint32_t plane, uint32_t band,
                       struct error *error)
{
    uint8_t *pixels = band_pixels(picture, context, plane, band);
    context_span_begin(context, STAGE_READBACK);
    gpu_buffer_read(context->device, &picture->resolved, 0, pixels, band_bytes(picture, context, plane, band));
    context_span_end(context);
    return gpu_check_reset(context->device, "reading the picture", error);
}

bool picture_copy_band(struct picture *picture, struct render_context *context, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error)
{
    context_span_begin(context, STAGE_READBACK);
    bool begun = gpu_readback_copy(context->device, copy, &picture->resolved,
                                   band_bytes(picture, context, plane, band), error);
    context_span_end(context);
    return begun && gpu_readback_fence(copy, error) && gpu_check(context->device, "copying the picture", error);
}

bool picture_take_band(struct picture *picture, struct render_context *context, struct gpu_readback *copy,
                       uint32_t plane, uint32_t band, struct error *error)
{
    uint8_t *pixels = band_pixels(picture, context, plane, band);
    /* Not as a span of the device, behind which others' work may be queued already. */
    uint64_t start_ns = clock_now_ns();
    bool taken = gpu_readback_take(context->device, copy, pixels, error);
    context_add_cpu_time(context, STAGE_READBACK, start_ns);
    return taken && gpu_check_reset(context->device, "reading the picture", error);
}
