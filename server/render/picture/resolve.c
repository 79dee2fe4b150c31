/* SPDX-License-Identifier: MIT */
/* From the sum of samples to pixels: mean, exposure and, for 8 bits, tone map and sRGB, or Y'CbCr of that.
 * Light in display values is only clamped, and for floats becomes the light that a display emits for it. */
#include "render/picture/resolve.h"

#include "shared/layers.h"
#include "shared/path.h"

#include <epoxy/gl.h>
#include <math.h>

/* Exposed as the beauty is: itself, and its parts. */
static bool is_exposed(enum layer layer)
{
    return layer == LAYER_BEAUTY || frame_request_is_light(layer);
}

/* The factor from the sum of a layer's samples to its pixels. */
static float scale_of(const struct picture *picture, const struct frame_request *request, enum layer layer)
{
    float mean = 1.0f / (float)picture->samples;
    if (is_exposed(layer))
        return exp2f(request->picture.exposure_stops) * mean;
    return frame_request_is_first_sample(layer) ? 1.0f : mean;
}

/* The define of a program that divides each tile's sums by its own number of samples; NULL: it need not. */
static const char *counts_tiles(const struct render_frame *frame, enum layer layer)
{
    return frame->tile_samples && !frame_request_is_first_sample(layer) ? "HAS_TILE_SAMPLES" : NULL;
}

/* Layers that are no colours stay unchanged. */
static const char *shows_display_values(const struct render_frame *frame, enum layer layer)
{
    const bool is_colour = layer == LAYER_BEAUTY || layer == LAYER_ALBEDO;
    return frame->display_values && is_colour ? "DISPLAY_VALUES" : NULL;
}

/* The define of a program for sums that are no colours with a coverage; NULL: they are. */
static const char *form_of(enum layer layer)
{
    return LAYER_BITS_CRYPTO >> layer & 1 ? "PAIRS" : layer == LAYER_MOTION ? "PLAIN" : NULL;
}

/* Defines of a program of display.glsl; with the curve where it makes display values. */
#define DISPLAY_DEFINES 4
static void display_defines(const struct render_frame *frame, enum layer layer, bool displays,
                            struct gpu_define defines[DISPLAY_DEFINES])
{
    static const char *const numbers[] = {[TONE_NEUTRAL] = "0u", [TONE_ACES] = "1u", [TONE_NONE] = "2u"};
    const char *names[] = {shows_display_values(frame, layer), counts_tiles(frame, layer), form_of(layer)};
    size_t n = 0;
    if (displays && !names[0])
        defines[n++] = (struct gpu_define){"TONE_MAP", numbers[frame->request.picture.tone_map]};
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++)
        if (names[i])
            defines[n++] = (struct gpu_define){names[i], "1"};
}

static const struct gpu_program *use_pixels(const struct render_frame *frame, enum layer layer,
                                            uint32_t pixel_count, struct error *error)
{
    static const char *const numbers[] = {
        [PIXEL_FORMAT_RGBA8] = "0",    [PIXEL_FORMAT_RGBA16F] = "1", [PIXEL_FORMAT_RGBA32F] = "2",
        [PIXEL_FORMAT_DEPTH32F] = "3", [PIXEL_FORMAT_NORMAL8] = "4", [PIXEL_FORMAT_SHARE8] = "5"};
    unsigned format = frame_request_plane_format(&frame->request, layer);
    struct gpu_define defines[DISPLAY_DEFINES + 2] = {{"FORMAT", numbers[format]}};
    display_defines(frame, layer, format == PIXEL_FORMAT_RGBA8, defines + 1);
    const struct gpu_program *program = context_use_with(frame->device, "render/resolve.comp", defines, error);
    if (program)
        gpu_uniform_uint(program, "pixel_count", pixel_count);
    return program;
}

static const struct gpu_program *use_ycbcr(const struct render_frame *frame, uint32_t row_count,
                                           struct error *error)
{
    struct gpu_define defines[DISPLAY_DEFINES + 1] = {0};
    display_defines(frame, LAYER_BEAUTY, true, defines);
    const struct gpu_program *program =
        context_use_with(frame->device, "render/resolve_ycbcr.comp", defines, error);
    if (program) {
        gpu_uniform_uint(program, "row_count", row_count);
        gpu_uniform_uint(program, "ycbcr", frame->request.ycbcr);
    }
    return program;
}

/* Sets the background; layers beside the picture have none, except those of light behind surfaces. */
static void set_background(const struct gpu_program *program, const struct render_frame *frame, enum layer layer)
{
    const struct frame_request *request = &frame->request;
    const bool is_behind = layer == LAYER_BACKGROUND ||
                           layer == LAYER_LIGHT_REST + frame->scene->scene->environment.value.light_group;
    const bool has_colour =
        (layer == LAYER_BEAUTY || is_behind) && request->picture.background == BACKGROUND_COLOUR;
    const float *colour = request->picture.background_colour;
    const float background[4] = {colour[0], colour[1], colour[2], 1.0f}, none[4] = {0};
    gpu_uniform_vec(program, "background", 4, has_colour ? background : none);
}

static void set_tiles(const struct gpu_program *program, const struct picture *picture,
                      const struct render_frame *frame, enum layer layer, uint32_t band)
{
    uint32_t first_slot;
    (void)picture_band_slots(picture, band, &first_slot);
    gpu_buffer_bind_texels(frame->device->gpu, frame->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
    gpu_uniform_uint(program, "first_tile", first_slot / TILE_SLOTS);
    gpu_uniform_float(program, "exposure",
                      is_exposed(layer) ? exp2f(frame->request.picture.exposure_stops) : 1.0f);
}

static bool is_ycbcr(const struct render_frame *frame, enum layer layer)
{
    return layer == LAYER_BEAUTY && frame->request.ycbcr != YCBCR_NONE;
}

void picture_announce(const struct picture *picture, struct render_wave *wave)
{
    if (!wave->frame->sums_in_picture || picture->plane_count > 1)
        (void)picture_accumulate_program(wave, NULL);
    if (wave->frame->tile_samples)
        (void)context_use(wave->device, "render/tile_error.comp", NULL);
    for (uint32_t plane = 0; plane < picture->plane_count; plane++) {
        const enum layer layer = picture_plane_layer(picture, plane);
        if (is_ycbcr(wave->frame, layer))
            (void)use_ycbcr(wave->frame, 0, NULL);
        else
            (void)use_pixels(wave->frame, layer, 0, NULL);
    }
}

bool picture_resolve_band(struct picture *picture, const struct render_frame *frame, uint32_t plane, uint32_t band,
                          struct error *error)
{
    enum layer layer = picture_plane_layer(picture, plane);
    const struct frame_request *request = &frame->request;
    uint32_t rows = picture_band_row_count(picture, band), pixel_count = rows * picture->width;
    const bool as_ycbcr = is_ycbcr(frame, layer);
    size_t bytes = (size_t)frame_request_plane_bytes(request, layer, rows);
    if (!gpu_buffer_reserve(frame->device->gpu, &picture->resolved, bytes, error))
        return false;
    context_span_begin(frame->device, STAGE_RESOLVE);
    context_bind_frame(frame);
    const struct gpu_program *program =
        as_ycbcr ? use_ycbcr(frame, rows, error) : use_pixels(frame, layer, pixel_count, error);
    if (program) {
        float coverage_scale = frame_request_is_first_sample(layer) ? 1.0f : 1.0f / (float)picture->samples;
        const bool denoised = layer == LAYER_BEAUTY && picture->denoised;
        gpu_buffer_bind_storage(denoised ? &picture->denoised[band] : picture_band(picture, plane, band),
                                BIND_ACCUMULATION);
        gpu_buffer_bind_storage(&picture->resolved, BIND_RESOLVED);
        gpu_uniform_float(program, "scale", scale_of(picture, request, layer));
        gpu_uniform_float(program, "coverage_scale", coverage_scale);
        set_background(program, frame, layer);
        if (counts_tiles(frame, layer))
            set_tiles(program, picture, frame, layer, band);
        gpu_dispatch(frame->device->gpu, program,
                     as_ycbcr ? picture->tiles_across * ((rows + 1) / 2) : pixel_count);
    }
    context_span_end(frame->device);
    return program && gpu_check(frame->device->gpu, "resolving", error);
}
