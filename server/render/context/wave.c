/* SPDX-License-Identifier: MIT */
/* Buffers of the wave in progress, and bindings of the passes over it. */
#include "render/context/wave.h"

#include "shared/bindings.h"
#include "shared/hit.h"
#include "shared/path.h"
#include "shared/ray.h"
#include "shared/wave.h"

#include <epoxy/gl.h>

void context_set_number(struct render_wave *wave, uint32_t number)
{
    wave->number = wave->device->wave_number = number;
}

void context_bind(struct render_wave *wave)
{
    context_bind_frame(wave->frame);
    gpu_buffer_bind_uniform(&wave->state, UNIFORM_WAVE);
}

size_t context_surface_defines(const struct render_wave *wave, struct gpu_define *defines)
{
    /* Only discs have textures that are not applied already. */
    bool exact = !wave->sampled_hits || wave->frame->scene->disc_count > 0;
    const struct scene_features *features = &wave->frame->features;
    const struct {
        bool has;
        const char *define;
    } rows[CONTEXT_SURFACE_DEFINES] = {
        {wave->sampled_hits, "HAS_SAMPLED"},
        {features->textures && exact, "HAS_TEXTURES"},
        {features->bump && exact, "HAS_BUMP"},
        {features->textures && exact && wave->frame->scene->has_spheres, "HAS_SPHERES"},
        {!features->glass, "NO_GLASS"},
        {!features->blend, "NO_BLEND"},
        {features->volume, "HAS_VOLUME"},
        {features->specular, "HAS_SPECULAR"},
        {features->clearcoat, "HAS_CLEARCOAT"},
        {features->iridescence, "HAS_IRIDESCENCE"},
        {features->sheen, "HAS_SHEEN"},
        {features->diffuse_transmission, "HAS_DIFFUSE_TRANSMISSION"},
        {features->dispersion, "HAS_DISPERSION"},
        {features->thin_walls, "HAS_THIN_WALLS"},
        {features->anisotropy, "HAS_ANISOTROPY"},
        {features->anisotropy_map, "HAS_ANISOTROPY_MAP"},
    };
    size_t n = 0;
    for (size_t i = 0; i < CONTEXT_SURFACE_DEFINES; i++)
        if (rows[i].has)
            defines[n++] = (struct gpu_define){rows[i].define, "1"};
    return n;
}

void context_bind_sums(const struct render_wave *wave)
{
    const size_t samples = (size_t)wave->slice.slot_count << wave->frame->uniforms.sample_shift;
    gpu_buffer_bind_storage_part(wave->sums, samples * sizeof(vec4), BIND_SLICE_SUMS);
}

void context_bind_hits(struct render_wave *wave)
{
    context_bind(wave);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->rays, UNIT_RAYS, GL_RGBA32F);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->hits, UNIT_SHADE_HITS, GL_RGBA32UI);
    gpu_buffer_bind_texels(wave->device->gpu, &wave->paths, UNIT_SHADE_PATHS, GL_RGBA32UI);
    gpu_buffer_bind_storage(&wave->hit_list, BIND_HIT_LIST);
}

bool context_reserve(struct render_wave *wave, uint32_t slice_samples, struct error *error)
{
    struct gpu_device *device = wave->device->gpu;
    size_t capacity = wave->capacity;
    size_t times = wave->frame->scene->has_motion ? capacity : 0;
    size_t blocks = (capacity + COMPACT_BLOCK - 1) / COMPACT_BLOCK;
    return gpu_buffer_reserve(device, &wave->rays, capacity * sizeof(struct ray), error) &&
           gpu_buffer_reserve(device, &wave->ray_times, times * sizeof(float), error) &&
           gpu_buffer_reserve(device, &wave->paths, capacity * sizeof(struct path), error) &&
           gpu_buffer_reserve(device, &wave->hits, capacity * sizeof(struct hit), error) &&
           gpu_buffer_reserve(device, &wave->hit_list, capacity * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &wave->hit_places, capacity * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &wave->block_offsets, blocks * OCTANTS * 2 * sizeof(uint), error) &&
           gpu_buffer_reserve(device, &wave->state, sizeof(struct wave_state), error) &&
           gpu_buffer_reserve(device, &wave->slice_sums, slice_samples * sizeof(vec4), error);
}

struct gpu_buffer *context_ray_times(struct render_wave *wave)
{
    return wave->frame->scene->has_motion ? &wave->ray_times : NULL;
}

uint64_t context_device_bytes(const struct render_wave *wave)
{
    return wave->rays.capacity_bytes + wave->ray_times.capacity_bytes + wave->paths.capacity_bytes +
           wave->hits.capacity_bytes + wave->hit_list.capacity_bytes + wave->hit_places.capacity_bytes +
           wave->block_offsets.capacity_bytes + wave->state.capacity_bytes + wave->slice_sums.capacity_bytes;
}

void context_finish(struct render_wave *wave)
{
    struct gpu_device *device = wave->device->gpu;
    gpu_buffer_finish(device, &wave->rays);
    gpu_buffer_finish(device, &wave->ray_times);
    gpu_buffer_finish(device, &wave->paths);
    gpu_buffer_finish(device, &wave->hits);
    gpu_buffer_finish(device, &wave->hit_list);
    gpu_buffer_finish(device, &wave->hit_places);
    gpu_buffer_finish(device, &wave->block_offsets);
    gpu_buffer_finish(device, &wave->state);
    gpu_buffer_finish(device, &wave->slice_sums);
}
