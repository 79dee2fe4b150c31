/* SPDX-License-Identifier: MIT */
/* Buffers of the layered depth cubes: their growth, size, and description. */
#include "trace/ldc/store.h"

#include "trace/raster/fit.h"

#include "ldc/layout.h"

#include <epoxy/gl.h>
#include <stdio.h>

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
    gpu_buffer_finish(store->device, &store->primitives);
    gpu_buffer_finish(store->device, &store->nodes);
    gpu_buffer_finish(store->device, &store->entries);
    *store = (struct ldc_store){.device = store->device};
}

uint64_t ldc_store_bytes(const struct ldc_store *store)
{
    return (uint64_t)store->texels.capacity_bytes + store->quads.capacity_bytes + store->geometry.capacity_bytes +
           store->surface.capacity_bytes + store->primitives.capacity_bytes + store->nodes.capacity_bytes +
           store->entries.capacity_bytes;
}

static void warn_of_lost_samples(const struct ldc_cube *cube, const char *name, struct structure_row *row)
{
    snprintf(row->warning, sizeof(row->warning),
             "the %s cube has %u of %u layers: %llu samples of what lies farther are missing (%s)", name,
             cube->layers_kept, cube->layers_needed, (unsigned long long)cube->samples_lost,
             cube->layers_kept >= LDC_LAYERS_MAX
                 ? "no more can be kept: choose another tracer"
                 : "raise limits.ldc_layers or memory.ldc in the daemon's configuration, or choose a lower "
                   "--ldc-resolution");
}

/* The warning is for peeling, whose count and whose layers come from two different programs. */
static void warn_of_uncounted_samples(const struct ldc_cube *cube, const char *name, struct structure_row *row)
{
    snprintf(row->warning, sizeof(row->warning),
             "%llu samples of the %s cube are missing: this device draws more than it counted (choose --ldc-build "
             "lists)",
             (unsigned long long)cube->samples_lost, name);
}

void ldc_cube_report(const struct ldc_store *store, unsigned which, bool built, struct structure_rows *rows)
{
    static const char *const names[LDC_CUBES_MAX] = {"static", "dynamic"};
    const struct ldc_cube *cube = &store->cubes[which];
    if (cube->resolution == 0)
        return;
    rows->part = which;
    rows->part_name = names[which];
    axes_fit_warn(structure_number(rows, "resolution", cube->resolution), cube->resolution_wanted);
    structure_metres(rows, "cell", cube->cell_world);
    structure_number(rows, "layers_needed", cube->layers_needed);
    struct structure_row *kept = structure_number(rows, "layers_kept", cube->layers_kept);
    if (cube->layers_kept < cube->layers_needed)
        warn_of_lost_samples(cube, names[which], kept);
    structure_number(rows, "samples", cube->sample_count);
    struct structure_row *lost = structure_number(rows, "samples_lost", cube->samples_lost);
    if (cube->samples_lost > 0 && cube->layers_kept == cube->layers_needed)
        warn_of_uncounted_samples(cube, names[which], lost);
    structure_built(rows, built);
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
    /* The slack serves cubes of moving instances, which are rebuilt in each frame and seldom have the same
     * size. */
    struct gpu_buffer grown = {0};
    if (!gpu_buffer_reserve(device, &grown, (size_t)(size_bytes + (size_bytes - kept_bytes) / 4), error) ||
        !gpu_buffer_reserve(device, &grown, (size_t)size_bytes, error)) {
        gpu_buffer_finish(device, &grown);
        return false;
    }
    gpu_buffer_copy(device, (struct gpu_buffer_place){buffer, 0}, (struct gpu_buffer_place){&grown, 0},
                    (size_t)kept_bytes);
    gpu_buffer_finish(device, buffer);
    *buffer = grown;
    return true;
}
