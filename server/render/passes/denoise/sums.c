/* SPDX-License-Identifier: MIT */
/* Notes guides of a slice's hits and adds them to the sums of the picture. */
#include "render/passes/denoise/sums.h"

#include "render/waves/compact.h"
#include "render/context/request.h"
#include "render/waves/integrator.h"
#include "shared/denoise.h"

#include <epoxy/gl.h>
#include <stdlib.h>

/* Number of samples from which DENOISE_AUTO does not filter; up to half of it filters in full
 * (protocol/words.def). */
#define AUTO_SAMPLES 128u

float denoise_strength(const struct frame_request *request, uint32_t samples)
{
    if (request->picture.denoise != DENOISE_AUTO)
        return request->picture.denoise == DENOISE_ON ? 1.0f : 0.0f;
    if (request->sampling.noise > 0.0f) /* the requested noise is the end of sampling */
        return 0.0f;
    const float left = 2.0f - 2.0f * (float)samples / (float)AUTO_SAMPLES;
    return left < 0.0f ? 0.0f : left < 1.0f ? left : 1.0f;
}

bool denoise_notes_samples(const struct render_frame *frame)
{
    return denoise_is_wanted(frame) && denoise_strength(&frame->request, frame->uniforms.sample_index) > 0.0f;
}

bool denoise_is_wanted(const struct render_frame *frame)
{
    const struct frame_request *request = &frame->request;
    /* How many samples come to one that others will be added to is not known. */
    const uint32_t samples = request->sampling.accumulate ? 1 : request->sampling.samples;
    return denoise_strength(request, samples) > 0.0f && frame->integrator->random &&
           frame_request_planes(request) & 1u << LAYER_BEAUTY && !request->hidden_layer &&
           request->picture.view_source != VIEW_SOURCE_LAYERS;
}

const struct gpu_program *denoise_use(const struct render_frame *frame, const struct denoise_sums *sums,
                                      const char *shader, bool reprojected, struct error *error)
{
    struct gpu_define defines[4] = {0};
    size_t count = 0;
    if (frame->tile_samples)
        defines[count++] = (struct gpu_define){"HAS_TILE_SAMPLES", "1"};
    if (reprojected)
        defines[count++] = (struct gpu_define){"HAS_REPROJECTED", "1"};
    if (sums->has_motion)
        defines[count++] = (struct gpu_define){"HAS_NOTED_MOTION", "1"};
    const struct gpu_program *program = context_use_with(frame->device, shader, defines, error);
    if (program && frame->tile_samples)
        gpu_buffer_bind_texels(frame->device->gpu, frame->tile_samples, UNIT_TILE_SAMPLES, GL_R32UI);
    return program;
}

struct gpu_buffer *denoise_sums_band(const struct denoise_sums *sums, enum denoise_sum sum, uint32_t band)
{
    return &sums->bands[(uint32_t)sum * sums->band_count + band];
}

bool denoise_sums_begin(struct denoise_sums *sums, const struct render_frame *frame, const struct picture *picture,
                        uint32_t samples_before, const struct denoise_history *history, struct error *error)
{
    struct gpu_device *device = frame->device->gpu;
    const struct denoise_sums before = *sums;
    if (sums->band_count != picture->band_count || !denoise_is_wanted(frame))
        denoise_sums_finish(sums, device);
    if (!denoise_is_wanted(frame))
        return true;
    if (!sums->bands)
        sums->bands = calloc((size_t)picture->band_count * DENOISE_SUM_COUNT, sizeof(*sums->bands));
    if (!sums->bands)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for the sums of a denoised picture");
    sums->band_count = picture->band_count;
    const bool is_clear = frame->features.clear && frame->request.light.depth > 0;
    sums->follows = samples_before > 0 ? before.follows : is_clear && !history->is_written;
    sums->has_motion = samples_before > 0 ? before.has_motion : sums->follows || history->things_moved;
    for (uint32_t band = 0; band < sums->band_count; band++) {
        uint32_t first;
        const size_t bytes = picture_band_slots(picture, band, &first) * sizeof(vec4);
        for (enum denoise_sum sum = 0; sum < DENOISE_SUM_COUNT; sum++)
            if ((sum != DENOISE_SUM_MOTION || sums->has_motion) &&
                !gpu_buffer_reserve(device, denoise_sums_band(sums, sum, band), bytes, error))
                return false;
    }
    const uint32_t summed = sums->has_motion ? DENOISE_SUM_RESULT : DENOISE_SUM_MOTION;
    for (uint32_t i = 0; samples_before == 0 && i < sums->band_count * summed; i++)
        gpu_buffer_clear(device, &sums->bands[i], 0);
    return true;
}

/* The program that notes, in use, with all that it reads. */
static const struct gpu_program *note_program(const struct denoise_sums *sums, struct gpu_buffer *notes,
                                              struct gpu_buffer *moved, bool follows, struct render_wave *wave,
                                              struct error *error)
{
    struct gpu_define defines[CONTEXT_SURFACE_DEFINES + 4] = {0};
    size_t count = context_surface_defines(wave, defines);
    if (sums->has_motion)
        defines[count++] = (struct gpu_define){"HAS_NOTED_MOTION", "1"};
    if (sums->has_motion && moved)
        defines[count++] = (struct gpu_define){"HAS_MOVED", "1"};
    if (follows)
        defines[count++] = (struct gpu_define){"FOLLOWS", "1"};
    const struct gpu_program *program = context_use_with(wave->device, "render/denoise_note.comp", defines, error);
    if (!program)
        return NULL;
    context_bind_hits(wave);
    gpu_buffer_bind_storage(notes, BIND_DENOISE_NOTES);
    if (sums->has_motion && moved)
        gpu_buffer_bind_texels(wave->device->gpu, moved, UNIT_DENOISE_MOVED, GL_RGBA32F);
    gpu_uniform_uint(program, "first_slot", wave->slice.first_slot);
    return program;
}

bool denoise_note(const struct denoise_sums *sums, struct gpu_buffer *notes, struct gpu_buffer *moved,
                  struct render_wave *wave, struct error *error)
{
    const size_t bytes = (size_t)wave->ray_count * DENOISE_NOTE_TEXELS_MAX * sizeof(vec4);
    if (!gpu_buffer_reserve(wave->device->gpu, notes, bytes, error))
        return false;
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = note_program(sums, notes, moved, false, wave, error);
    if (program) {
        gpu_uniform_uint(program, "ray_count", wave->ray_count);
        gpu_dispatch(wave->device->gpu, program, wave->ray_count);
    }
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "what guides the denoiser", error);
}

bool denoise_follow(const struct denoise_sums *sums, struct gpu_buffer *notes, struct gpu_buffer *moved,
                    struct render_wave *wave, struct error *error)
{
    if (!sums->follows || wave->number > DENOISE_WAVES_MAX)
        return true;
    context_span_begin(wave->device, STAGE_SHADE);
    const struct gpu_program *program = note_program(sums, notes, moved, true, wave, error);
    if (program)
        compact_dispatch(wave, program, WAVE_RAYS);
    context_span_end(wave->device);
    return program && gpu_check(wave->device->gpu, "what mirrors show the denoiser", error);
}

bool denoise_accumulate(struct denoise_sums *sums, struct gpu_buffer *notes, struct render_wave *wave,
                        const struct picture *picture, struct error *error)
{
    uint32_t first_slot;
    const struct gpu_buffer *own = picture_slice_band(picture, &wave->slice, &first_slot);
    const uint32_t band = (uint32_t)(own - picture->bands);
    const struct gpu_program *program =
        denoise_use(wave->frame, sums, "render/denoise_accumulate.comp", false, error);
    if (!program)
        return false;
    if (wave->frame->tile_samples)
        gpu_uniform_uint(program, "first_picture_slot", wave->slice.first_slot);
    gpu_buffer_bind_storage(&wave->slice_sums, BIND_SLICE_SUMS);
    gpu_buffer_bind_storage(notes, BIND_DENOISE_NOTES);
    gpu_buffer_bind_storage(picture_band(picture, 0, band), BIND_DENOISE_SUM);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_DOUBLED, band), BIND_DENOISE_DOUBLED);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_HALF, band), BIND_DENOISE_HALF);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_ALBEDO, band), BIND_DENOISE_ALBEDO);
    gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_NORMAL, band), BIND_DENOISE_NORMAL);
    if (sums->has_motion)
        gpu_buffer_bind_storage(denoise_sums_band(sums, DENOISE_SUM_MOTION, band), BIND_DENOISE_MOTION);
    gpu_buffer_bind_uniform(&wave->state, UNIFORM_WAVE);
    gpu_uniform_uint(program, "first_slot", first_slot);
    gpu_uniform_uint(program, "slot_count", wave->slice.slot_count);
    gpu_uniform_uint(program, "sample_index", wave->frame->uniforms.sample_index);
    gpu_uniform_uint(program, "sample_shift", wave->frame->uniforms.sample_shift);
    context_span_begin(wave->device, STAGE_SHADE);
    gpu_dispatch(wave->device->gpu, program, wave->slice.slot_count);
    context_span_end(wave->device);
    return true;
}

uint64_t denoise_sums_device_bytes(const struct denoise_sums *sums)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < sums->band_count * DENOISE_SUM_COUNT; i++)
        bytes += sums->bands[i].capacity_bytes;
    return bytes;
}

void denoise_sums_finish(struct denoise_sums *sums, struct gpu_device *device)
{
    for (uint32_t i = 0; i < sums->band_count * DENOISE_SUM_COUNT; i++)
        gpu_buffer_finish(device, &sums->bands[i]);
    free(sums->bands);
    *sums = (struct denoise_sums){0};
}
