/* SPDX-License-Identifier: MIT */
#include "trace/ldc/store.h"

#include <epoxy/gl.h>

void ldc_store_init(struct ldc_store *store, struct gpu_device *device)
{
    *store = (struct ldc_store){.device = device};
}

void ldc_store_finish(struct ldc_store *store)
{
    gpu_buffer_finish(store->device, &store->texels);
    gpu_buffer_finish(store->device, &store->quads);
    gpu_buffer_finish(store->device, &store->geometry);
    gpu_buffer_finish(store->device, &store->surface);
    gpu_buffer_finish(store->device, &store->nodes);
    gpu_buffer_finish(store->device, &store->entries);
    *store = (struct ldc_store){.device = store->device};
}

uint64_t ldc_store_bytes(const struct ldc_store *store)
{
    return (uint64_t)store->texels.capacity_bytes + store->quads.capacity_bytes + store->geometry.capacity_bytes +
           store->surface.capacity_bytes + store->nodes.capacity_bytes + store->entries.capacity_bytes;
}

struct tracer_cube ldc_cube_stats(const struct ldc_cube *cube, bool rebuilt)
{
    if (cube->resolution == 0)
        return (struct tracer_cube){0};
    return (struct tracer_cube){
        .resolution = cube->resolution,
        .cell_metres = cube->cell_world,
        .layers_needed = cube->layers_needed,
        .layers_kept = cube->layers_kept,
        .samples = cube->sample_count,
        .samples_lost = cube->samples_lost,
        .rebuilt = rebuilt,
    };
}

bool ldc_store_grow(struct gpu_device *device, struct gpu_buffer *buffer, uint64_t kept_bytes, uint64_t size_bytes,
                    struct error *error)
{
    if (size_bytes > SIZE_MAX)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "a buffer of %llu bytes",
                         (unsigned long long)size_bytes);
    if (kept_bytes > buffer->size_bytes)
        kept_bytes = buffer->size_bytes;
    if (kept_bytes == 0 || size_bytes <= buffer->capacity_bytes)
        return gpu_buffer_reserve(device, buffer, (size_t)size_bytes, error);
    /* What moves is built anew with each frame and seldom to the same size. */
    struct gpu_buffer grown = {0};
    if (!gpu_buffer_reserve(device, &grown, (size_t)(size_bytes + (size_bytes - kept_bytes) / 4), error) ||
        !gpu_buffer_reserve(device, &grown, (size_t)size_bytes, error)) {
        gpu_buffer_finish(device, &grown);
        return false;
    }
    glMemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    glCopyNamedBufferSubData(buffer->name, grown.name, 0, 0, (GLsizeiptr)kept_bytes);
    gpu_buffer_finish(device, buffer);
    *buffer = grown;
    return true;
}
