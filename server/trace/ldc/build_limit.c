/* SPDX-License-Identifier: MIT */
/* Limits the number of layers to what fits into memory: the nearest of each texel are kept. */
#include "ldc/layout.h"
#include "shared/bindings.h"
#include "trace/ldc/build_state.h"

#include <epoxy/gl.h>

/* Bytes of a buffer that grows: half as much again. */
#define GROWTH(bytes) ((bytes) + (bytes) / 2)

static uint64_t sample_bytes(uint64_t samples, uint64_t quads)
{
    return samples * (LDC_GEOMETRY_BYTES + LDC_SURFACE_BYTES + LDC_PRIMITIVE_BYTES) + quads * LDC_QUAD_BYTES;
}

/* Whether the cube and the buffers of its build fit the device's memory. */
static bool fits_device(const struct ldc_task *task, uint64_t samples, uint64_t quads)
{
    const struct gpu_device *device = task->builder->device;
    const struct ldc_store *store = task->store;
    uint64_t texels_max = device->facts.texture_buffer_texels_max;
    uint64_t present = (uint64_t)store->geometry.capacity_bytes + store->surface.capacity_bytes +
                       store->primitives.capacity_bytes + store->quads.capacity_bytes;
    uint64_t all_samples = task->cube->first_sample + samples, all_quads = task->cube->first_quad + quads;
    uint64_t bytes = sample_bytes(all_samples, all_quads);
    if (all_samples > texels_max || all_quads > texels_max || all_quads > LDC_QUADS_MAX)
        return false;
    if (task->slots == 0) /* peeled: fragments will be in `ordered` and `peeled` */
        bytes += samples * (LDC_ORDERED_BYTES + LDC_PEELED_BYTES);
    return device->memory_limit_bytes == 0 || bytes <= present ||
           device->memory_used_bytes + GROWTH(bytes) <= device->memory_limit_bytes;
}

static bool fits(const struct ldc_task *task, uint64_t samples, uint64_t quads)
{
    uint64_t allowed = (uint64_t)task->options->limits.ldc_mebibytes << 20;
    return (allowed == 0 || sample_bytes(samples, quads) <= allowed) && fits_device(task, samples, quads);
}

static bool read_histogram(struct ldc_task *task, uint32_t texels_with[LDC_HISTOGRAM_BINS], struct error *error)
{
    struct ldc_builder *builder = task->builder;
    struct gpu_device *device = builder->device;
    const struct gpu_program *program = ldc_use(device, "ldc/histogram.comp", error);
    if (!program || !gpu_buffer_reserve(device, &builder->histogram, LDC_HISTOGRAM_BINS * sizeof(uint32_t), error))
        return false;
    gpu_buffer_clear(device, &builder->histogram, 0);
    gpu_buffer_bind_texels(device, &builder->counts, UNIT_LDC_COUNTS, GL_R32UI);
    gpu_buffer_bind_texels(device, &builder->occupied, UNIT_LDC_OCCUPIED, GL_R32UI);
    gpu_buffer_bind_storage(&builder->histogram, BIND_LDC_HISTOGRAM);
    gpu_uniform_uint(program, "occupied_count", task->counts.occupied);
    gpu_uniform_uint(program, "texels_along", task->cube->resolution);
    gpu_dispatch(device, program, task->counts.occupied);
    gpu_buffer_read(device, &builder->histogram, 0, texels_with, LDC_HISTOGRAM_BINS * sizeof(uint32_t));
    return true;
}

bool ldc_limit(struct ldc_task *task, struct error *error)
{
    uint32_t texels_with[LDC_HISTOGRAM_BINS], layers;
    if (task->counts.layers_needed <= task->layers_max &&
        fits(task, task->counts.samples_max, task->counts.quads_max))
        return true;
    if (!read_histogram(task, texels_with, error))
        return false;
    for (layers = task->layers_max; layers > 0; layers--) {
        uint64_t samples = 0, quads = 0;
        for (uint32_t count = 1; count < LDC_HISTOGRAM_BINS; count++) {
            uint32_t kept = count < layers ? count : layers;
            samples += (uint64_t)texels_with[count] * kept;
            quads += (uint64_t)texels_with[count] * ((kept + 3) / 4);
        }
        if (!fits(task, samples, quads))
            continue;
        task->layers_max = layers;
        task->counts.samples_max = (uint32_t)samples;
        task->counts.quads_max = (uint32_t)quads;
        return true;
    }
    error_set(error, ERROR_OUT_OF_MEMORY, NULL,
              "a layered depth cube of %u cells a side has no room for one layer: %llu MiB",
              task->cube->resolution,
              (unsigned long long)(sample_bytes(task->counts.occupied, task->counts.occupied) >> 20));
    return error_remedy(error, "take a lower resolution, or allow it more memory");
}
