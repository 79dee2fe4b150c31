/* SPDX-License-Identifier: MIT */
/* From the sum of samples to pixels: mean, exposure and, for 8 bits, tone map and sRGB. */
#include "render/frame_request.h"
#include "render/layers.h"
#include "render/picture.h"

#include "shared/path.h"

#include <math.h>

size_t picture_pixel_bytes(enum frame_format format)
{
    switch (format) {
    case FRAME_RGBA8:
    case FRAME_DEPTH32F:
    case FRAME_NORMAL8:
        return 4;
    case FRAME_RGBA16F:
        return 8;
    case FRAME_RGBA32F:
        return 16;
    }
    return 0;
}

/* Of the sum of a layer's samples what its pixels show. */
static float scale_of(const struct picture *picture, const struct frame_request *request, enum frame_layer layer)
{
    float mean = 1.0f / (float)picture->samples;
    if (layer == LAYER_BEAUTY)
        return exp2f(request->exposure_stops) * mean;
    return layers_of_first_sample(layer) ? 1.0f : mean;
}

bool picture_resolve_band(struct picture *picture, struct render_context *context, uint32_t plane, uint32_t band,
                          struct error *error)
{
    enum frame_layer layer = picture_plane_layer(picture, plane);
    const struct frame_request *request = &context->request;
    enum frame_format format = frame_request_plane_format(request, layer);
    uint32_t pixel_count = picture_band_row_count(picture, band) * picture->width;
    if (!gpu_buffer_reserve(context->device, &picture->resolved, pixel_count * picture_pixel_bytes(format), error))
        return false;
    context_span_begin(context, STAGE_RESOLVE);
    context_bind(context);
    const struct gpu_program *program = context_use(context, "render/resolve.comp", error);
    if (program) {
        float coverage_scale = layers_of_first_sample(layer) ? 1.0f : 1.0f / (float)picture->samples;
        gpu_buffer_bind_storage(picture_band(picture, plane, band), BIND_ACCUMULATION);
        gpu_buffer_bind_storage(&picture->resolved, BIND_RESOLVED);
        gpu_uniform_uint(program, "pixel_count", pixel_count);
        gpu_uniform_uint(program, "format_number", format);
        gpu_uniform_uint(program, "tone_map_kind", request->tone_map);
        gpu_uniform_float(program, "scale", scale_of(picture, request, layer));
        gpu_uniform_float(program, "coverage_scale", coverage_scale);
        gpu_dispatch(context->device, program, pixel_count);
    }
    context_span_end(context);
    return program && gpu_check(context->device, "resolving", error);
}
