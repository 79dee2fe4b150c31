/* SPDX-License-Identifier: MIT */
/* From the device to memory that the frame's taker owns. */
#include "render/frame_request.h"
#include "render/picture.h"

#include <stdlib.h>

static size_t row_bytes_of(const struct picture *picture, const struct frame_request *request, uint32_t plane)
{
    enum frame_format format = frame_request_plane_format(request, picture_plane_layer(picture, plane));
    return picture->width * picture_pixel_bytes(format);
}

bool picture_read_band(struct picture *picture, struct render_context *context, uint32_t plane, uint32_t band,
                       struct error *error)
{
    const struct frame_request *request = &context->request;
    if (!picture->pixels) {
        picture->size_bytes = (size_t)frame_request_bytes(request);
        picture->pixels = malloc(picture->size_bytes);
        if (!picture->pixels)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture of %zu bytes",
                             picture->size_bytes);
    }
    size_t row_bytes = row_bytes_of(picture, request, plane);
    uint8_t *to = picture->pixels + picture_band_first_row(picture, band) * row_bytes;
    for (uint32_t before = 0; before < plane; before++)
        to += row_bytes_of(picture, request, before) * picture->height;
    context_span_begin(context, STAGE_READBACK);
    gpu_buffer_read(context->device, &picture->resolved, 0, to, picture_band_row_count(picture, band) * row_bytes);
    context_span_end(context);
    return gpu_check(context->device, "reading the picture", error);
}
