/* SPDX-License-Identifier: MIT */
/* From the device to memory that the frame's taker owns. */
#include "render/picture.h"

#include <stdlib.h>

bool picture_read_band(struct picture *picture, struct render_context *context, uint32_t plane, uint32_t band,
                       struct error *error)
{
    size_t row_bytes = picture->width * picture_pixel_bytes(context->request.format);
    if (!picture->pixels) {
        picture->size_bytes = row_bytes * picture->height * picture->plane_count;
        picture->pixels = malloc(picture->size_bytes);
        if (!picture->pixels)
            return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a picture of %zu bytes",
                             picture->size_bytes);
    }
    size_t first_row = (size_t)plane * picture->height + picture_band_first_row(picture, band);
    context_span_begin(context, STAGE_READBACK);
    gpu_buffer_read(context->device, &picture->resolved, 0, picture->pixels + first_row * row_bytes,
                    picture_band_row_count(picture, band) * row_bytes);
    context_span_end(context);
    return gpu_check(context->device, "reading the picture", error);
}
