/* SPDX-License-Identifier: MIT */
/* Measures the error of each tile and stops those that have samples enough. */
#include "render/picture/noise.h"

#include "render/picture/picture.h"

#include "shared/path.h"

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>

/* Fewer samples say little about how far they are off. */
#define SAMPLES_FIRST 16u
/* A tile continues beside one whose error is this many times the limit: rare light, as from a small mirror,
 * appears in one tile before it does in the next. */
#define NEIGHBOUR_FACTOR 4.0f

void picture_noise_finish(struct picture_noise *noise, struct gpu_device *device)
{
    for (uint32_t i = 0; i < noise->band_count; i++)
        gpu_buffer_finish(device, &noise->halves[i]);
    free(noise->halves);
    gpu_buffer_finish(device, &noise->tile_samples);
    gpu_buffer_finish(device, &noise->tile_errors);
    free(noise->samples);
    free(noise->errors);
    *noise = (struct picture_noise){0};
}

static bool allocate(struct picture *picture, struct error *error)
{
    struct picture_noise *noise = &picture->noise;
    noise->tile_count = picture_slot_count(picture) / TILE_SLOTS;
    noise->halves = calloc(picture->band_count, sizeof(*noise->halves));
    noise->samples = calloc(noise->tile_count, sizeof(*noise->samples));
    noise->errors = calloc(noise->tile_count, sizeof(*noise->errors));
    noise->band_count = noise->halves ? picture->band_count : 0;
    if (!noise->halves || !noise->samples || !noise->errors)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the errors of a picture's tiles");
    return true;
}

static bool reserve(struct picture *picture, struct gpu_device *device, struct error *error)
{
    struct picture_noise *noise = &picture->noise;
    for (uint32_t band = 0; band < picture->band_count; band++)
        if (!gpu_buffer_reserve(device, &noise->halves[band], picture_band(picture, 0, band)->size_bytes, error))
            return false;
    return gpu_buffer_reserve(device, &noise->tile_errors, noise->tile_count * sizeof(float), error) &&
           gpu_buffer_reserve(device, &noise->tile_samples, noise->tile_count * sizeof(uint32_t), error);
}

bool picture_noise_begin(struct picture *picture, const struct render_frame *frame, uint32_t samples_before,
                         struct error *error)
{
    struct picture_noise *noise = &picture->noise;
    if (!(frame->request.sampling.noise > 0.0f)) {
        picture_noise_finish(noise, frame->device->gpu);
        return true;
    }
    if (!noise->errors) {
        picture_noise_finish(noise, frame->device->gpu);
        if (!allocate(picture, error))
            return false;
    }
    if (!reserve(picture, frame->device->gpu, error))
        return false;
    if (samples_before > 0)
        return true;
    noise->going_on = noise->tile_count;
    noise->error = PICTURE_NOISE_UNKNOWN;
    for (uint32_t tile = 0; tile < noise->tile_count; tile++) {
        noise->samples[tile] = 0;
        noise->errors[tile] = PICTURE_NOISE_UNKNOWN;
    }
    gpu_buffer_clear(frame->device->gpu, &noise->tile_samples, 0);
    gpu_buffer_write(frame->device->gpu, &noise->tile_errors, 0, noise->errors,
                     noise->tile_count * sizeof(*noise->errors));
    return true;
}

/* 8, 16, 24, 32, 48, 64, 96 .. */
uint32_t picture_noise_next(uint32_t samples)
{
    uint64_t next = SAMPLES_FIRST / 2;
    while (next <= samples)
        next = next < SAMPLES_FIRST ? SAMPLES_FIRST : next & (next - 1) ? next / 3 * 4 : next / 2 * 3;
    return next < UINT32_MAX ? (uint32_t)next : UINT32_MAX;
}

bool picture_noise_is_due(const struct picture *picture, uint32_t samples)
{
    return picture->noise.errors && samples > 0 && picture_noise_next(samples - 1) == samples;
}

static bool neighbours_are_quiet(const struct picture *picture, uint32_t tile, float limit)
{
    const struct picture_noise *noise = &picture->noise;
    const int64_t across = picture->tiles_across, x = tile % across, y = tile / across,
                  down = noise->tile_count / across;
    for (int64_t v = y - 1; v <= y + 1; v++)
        for (int64_t u = x - 1; u <= x + 1; u++)
            if (u >= 0 && u < across && v >= 0 && v < down && noise->errors[v * across + u] > limit)
                return false;
    return true;
}

/* From the errors, those that have samples enough. */
static void stop_tiles(struct picture *picture, float limit, uint32_t samples)
{
    struct picture_noise *noise = &picture->noise;
    noise->error = 0.0f;
    for (uint32_t tile = 0; tile < noise->tile_count; tile++) {
        noise->error = fmaxf(noise->error, noise->errors[tile]);
        if (noise->samples[tile] || noise->errors[tile] > limit ||
            !neighbours_are_quiet(picture, tile, NEIGHBOUR_FACTOR * limit))
            continue;
        noise->samples[tile] = samples;
        noise->going_on--;
    }
}

bool picture_noise_measure(struct picture *picture, const struct render_frame *frame, uint32_t samples,
                           struct error *error)
{
    struct picture_noise *noise = &picture->noise;
    const size_t bytes = noise->tile_count * sizeof(uint32_t);
    const bool is_first = samples < SAMPLES_FIRST;
    uint32_t half = SAMPLES_FIRST / 2;
    while (half * 2 < samples)
        half *= 2;
    const struct gpu_program *program = context_use(frame->device, "render/tile_error.comp", error);
    if (!program)
        return false;
    context_span_begin(frame->device, STAGE_RESOLVE);
    context_bind_frame(frame);
    gpu_buffer_bind_texels(frame->device->gpu, &noise->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
    gpu_buffer_bind_storage(&noise->tile_errors, BIND_TILE_ERRORS);
    gpu_uniform_uint(program, "samples", samples);
    gpu_uniform_uint(program, "half_samples", is_first ? 0 : half);
    gpu_uniform_uint(program, "keep", is_first || samples == 2 * half);
    gpu_uniform_float(program, "exposure", exp2f(frame->request.picture.exposure_stops));
    for (uint32_t band = 0; band < picture->band_count; band++) {
        uint32_t first_slot;
        const uint32_t slots = picture_band_slots(picture, band, &first_slot);
        gpu_buffer_bind_storage(picture_band(picture, 0, band), BIND_ACCUMULATION);
        gpu_buffer_bind_storage(&noise->halves[band], BIND_HALVES);
        gpu_uniform_uint(program, "first_tile", first_slot / TILE_SLOTS);
        gpu_uniform_uint(program, "tile_count", slots / TILE_SLOTS);
        gpu_dispatch(frame->device->gpu, program, slots / TILE_SLOTS);
    }
    context_span_end(frame->device);
    if (is_first)
        return gpu_check(frame->device->gpu, "keeping half of the samples", error);
    gpu_buffer_read(frame->device->gpu, &noise->tile_errors, 0, noise->errors, bytes);
    if (!gpu_check(frame->device->gpu, "the errors of tiles", error))
        return false;
    stop_tiles(picture, frame->request.sampling.noise, samples);
    gpu_buffer_write(frame->device->gpu, &noise->tile_samples, 0, noise->samples, bytes);
    return true;
}

uint64_t picture_noise_rays(const struct picture *picture, uint32_t samples_before)
{
    const struct picture_noise *noise = &picture->noise;
    uint64_t rays = 0;
    for (uint32_t tile = 0; tile < noise->tile_count; tile++) {
        const uint32_t left = picture->width - tile % picture->tiles_across * 8;
        const uint32_t below = picture->height - tile / picture->tiles_across * 8;
        const uint32_t held = noise->samples[tile] ? noise->samples[tile] : picture->samples;
        if (held > samples_before)
            rays += (uint64_t)(held - samples_before) * (left < 8 ? left : 8) * (below < 8 ? below : 8);
    }
    return rays;
}

uint64_t picture_noise_device_bytes(const struct picture_noise *noise)
{
    uint64_t sum = noise->tile_samples.capacity_bytes + noise->tile_errors.capacity_bytes;
    for (uint32_t i = 0; i < noise->band_count; i++)
        sum += noise->halves[i].capacity_bytes;
    return sum;
}
