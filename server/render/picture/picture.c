/* SPDX-License-Identifier: MIT */
/* Bands of a picture's sums, and slices added to them. */
#include "render/picture/picture.h"

#include "render/context/request.h"
#include "shared/path.h"

#include <epoxy/gl.h>
#include <stdlib.h>

static void free_bands(struct picture *picture, struct gpu_device *device)
{
    for (uint32_t i = 0; i < picture->band_count * picture->plane_count; i++)
        gpu_buffer_finish(device, &picture->bands[i]);
    free(picture->bands);
    picture->bands = NULL;
    picture->band_count = 0;
    picture_noise_finish(&picture->noise, device);
}

enum layer picture_plane_layer(const struct picture *picture, uint32_t plane)
{
    uint32_t left = picture->layers;
    for (; plane > 0; plane--)
        left &= left - 1;
    return (enum layer)__builtin_ctz(left);
}

struct gpu_buffer *picture_band(const struct picture *picture, uint32_t plane, uint32_t band)
{
    return &picture->bands[plane * picture->band_count + band];
}

uint64_t picture_device_bytes(const struct picture *picture)
{
    uint64_t sum = picture->resolved.capacity_bytes + picture_noise_device_bytes(&picture->noise);
    for (uint32_t i = 0; i < picture->band_count * picture->plane_count; i++)
        sum += picture->bands[i].capacity_bytes;
    return sum;
}

uint32_t picture_band_first_row(const struct picture *picture, uint32_t band)
{
    return band * picture->band_rows;
}

uint32_t picture_band_row_count(const struct picture *picture, uint32_t band)
{
    uint32_t first = picture_band_first_row(picture, band), left = picture->height - first;
    return left < picture->band_rows ? left : picture->band_rows;
}

static uint32_t band_slots(const struct picture *picture)
{
    return picture->tiles_across * 8 * picture->band_rows;
}

uint32_t picture_row_of(const struct picture *picture, uint32_t slot)
{
    return picture_band_first_row(picture, slot / band_slots(picture));
}

uint32_t picture_strip_rows(const struct picture *picture, uint32_t pixels_max)
{
    uint32_t bands = pixels_max / (picture->width * picture->band_rows);
    uint32_t rows = (bands ? bands : 1) * picture->band_rows;
    return rows < picture->height ? rows : picture->height;
}

uint32_t picture_slot_count(const struct picture *picture)
{
    return picture->tiles_across * ((picture->height + 7) / 8) * 64;
}

bool picture_has_tile(const struct picture *picture, uint32_t tile)
{
    const uint32_t x = tile % picture->tiles_across, y = tile / picture->tiles_across;
    return x >= picture->crop_left && x < picture->crop_right && y >= picture->crop_top &&
           y < picture->crop_bottom;
}

uint32_t picture_run_end(const struct picture *picture, uint32_t slot)
{
    const uint32_t across = picture->tiles_across;
    if (picture->crop_right - picture->crop_left == across)
        return picture->crop_bottom * across * TILE_SLOTS;
    return (slot / TILE_SLOTS / across * across + picture->crop_right) * TILE_SLOTS;
}

static void set_crop(struct picture *picture, const struct frame_request *request)
{
    const struct frame_crop crop = frame_request_crop(request);
    picture->crop_left = crop.x / 8;
    picture->crop_right = (crop.x + crop.width + 7) / 8;
    picture->crop_top = crop.y / 8;
    picture->crop_bottom = (crop.y + crop.height + 7) / 8;
}

uint32_t picture_band_end(const struct picture *picture, uint32_t slot)
{
    uint64_t end = (uint64_t)(slot / band_slots(picture) + 1) * band_slots(picture);
    uint32_t all = picture_slot_count(picture);
    return end < all ? (uint32_t)end : all;
}

static bool list_bands(struct picture *picture, const struct gpu_facts *facts, const struct frame_request *request,
                       struct error *error)
{
    uint32_t row_slots = picture->tiles_across * 8;
    picture->band_rows = facts->band_slots_max / row_slots & ~7u;
    if (picture->band_rows == 0)
        picture->band_rows = 8;
    uint32_t padded_rows = (request->picture.height + 7) & ~7u;
    if (picture->band_rows > padded_rows)
        picture->band_rows = padded_rows;
    uint32_t count = (padded_rows + picture->band_rows - 1) / picture->band_rows;
    picture->bands = calloc((size_t)count * picture->plane_count, sizeof(*picture->bands));
    if (!picture->bands)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the picture");
    picture->band_count = count;
    return true;
}

static bool reserve_bands(struct picture *picture, struct gpu_device *device, struct error *error)
{
    uint32_t row_slots = picture->tiles_across * 8;
    for (uint32_t i = 0; i < picture->band_count * picture->plane_count; i++) {
        uint32_t rows = (picture_band_row_count(picture, i % picture->band_count) + 7) & ~7u;
        if (!gpu_buffer_reserve(device, &picture->bands[i], (size_t)rows * row_slots * sizeof(vec4), error))
            return false;
    }
    return true;
}

static bool clear_bands(struct picture *picture, struct gpu_device *device, struct error *error)
{
    for (; picture->cleared < picture->band_count * picture->plane_count; picture->cleared++) {
        if (!gpu_reserve_in_time(device, error))
            return false;
        gpu_buffer_clear(device, &picture->bands[picture->cleared], 0);
    }
    return true;
}

void picture_restart(struct picture *picture)
{
    picture->cleared = 0;
}

bool picture_begin(struct picture *picture, struct render_frame *frame, uint32_t samples_before,
                   struct error *error)
{
    const struct frame_request *request = &frame->request;
    uint32_t layers = frame_request_planes(request);
    picture_drop_pixels(picture);
    if (!picture->bands || picture->width != request->picture.width ||
        picture->height != request->picture.height || picture->layers != layers) {
        free_bands(picture, frame->device->gpu);
        picture->layers = layers;
        picture->plane_count = (uint32_t)__builtin_popcount(layers);
        picture->width = request->picture.width;
        picture->height = request->picture.height;
        picture->tiles_across = (request->picture.width + 7) / 8;
        if (!list_bands(picture, &frame->device->gpu->facts, request, error))
            return false;
    }
    set_crop(picture, request);
    picture->samples = samples_before + request->sampling.samples;
    frame->tile_samples = request->sampling.noise > 0.0f ? &picture->noise.tile_samples : NULL;
    return true;
}

bool picture_reserve(struct picture *picture, const struct render_frame *frame, uint32_t samples_before,
                     struct error *error)
{
    return reserve_bands(picture, frame->device->gpu, error) &&
           (samples_before > 0 || clear_bands(picture, frame->device->gpu, error)) &&
           picture_noise_begin(picture, frame, samples_before, error);
}

const struct gpu_program *picture_accumulate_program(struct render_wave *wave, struct error *error)
{
    static const struct gpu_define stopping[] = {{"HAS_TILE_SAMPLES", "1"}, {0}};
    const struct gpu_program *program = context_use_with(wave->device, "render/accumulate.comp",
                                                         wave->frame->tile_samples ? stopping : NULL, error);
    if (program && wave->frame->tile_samples) {
        gpu_buffer_bind_texels(wave->device->gpu, wave->frame->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
        gpu_uniform_uint(program, "first_picture_slot", wave->slice.first_slot);
    }
    return program;
}

bool picture_accumulate(struct picture *picture, struct render_wave *wave, uint32_t plane, struct gpu_buffer *sums,
                        uint32_t first_sum, struct error *error)
{
    const struct gpu_program *program = picture_accumulate_program(wave, error);
    if (!program)
        return false;
    uint32_t first_slot;
    const uint32_t band = picture_slice_band_number(picture, &wave->slice, &first_slot);
    gpu_buffer_bind_storage(picture_band(picture, plane, band), BIND_ACCUMULATION);
    gpu_buffer_bind_storage(sums, BIND_SLICE_SUMS);
    gpu_buffer_bind_uniform(&wave->state, UNIFORM_WAVE);
    gpu_uniform_uint(program, "first_sum", first_sum);
    gpu_uniform_uint(program, "first_slot", first_slot);
    gpu_uniform_uint(program, "slot_count", wave->slice.slot_count);
    gpu_uniform_uint(program, "sample_shift", wave->frame->uniforms.sample_shift);
    context_span_begin(wave->device, STAGE_SHADE);
    gpu_dispatch(wave->device->gpu, program, wave->slice.slot_count);
    context_span_end(wave->device);
    return true;
}

struct gpu_buffer_place picture_sums_place(const struct picture *picture, const struct render_wave *wave)
{
    uint32_t first_slot = 0;
    const struct gpu_buffer *band = picture_slice_band(picture, &wave->slice, &first_slot);
    const size_t offset_bytes = first_slot * sizeof(vec4);
    return wave->frame->sums_in_picture && offset_bytes % GPU_STORAGE_ALIGNMENT == 0
               ? (struct gpu_buffer_place){band, offset_bytes}
               : (struct gpu_buffer_place){&wave->slice_sums, 0};
}

uint32_t picture_band_slots(const struct picture *picture, uint32_t band, uint32_t *first)
{
    *first = band * band_slots(picture);
    return picture_band_end(picture, *first) - *first;
}

uint32_t picture_slice_band_number(const struct picture *picture, const struct slice *slice, uint32_t *first_slot)
{
    const uint32_t band = slice->first_slot / band_slots(picture);
    *first_slot = slice->first_slot - band * band_slots(picture);
    return band;
}

struct gpu_buffer *picture_slice_band(const struct picture *picture, const struct slice *slice,
                                      uint32_t *first_slot)
{
    return picture_band(picture, 0, picture_slice_band_number(picture, slice, first_slot));
}

void picture_drop_pixels(struct picture *picture)
{
    free(picture->pixels);
    picture->pixels = NULL;
    picture->size_bytes = 0;
}

void picture_finish(struct picture *picture, struct gpu_device *device)
{
    picture_drop_pixels(picture);
    free_bands(picture, device);
    gpu_buffer_finish(device, &picture->resolved);
    *picture = (struct picture){0};
}
