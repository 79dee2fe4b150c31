/* SPDX-License-Identifier: MIT */
/* Buffers of the tracer `abuffer`: their initial state, end and size. */
#include "trace/abuffer/store.h"

#include "abuffer/layout.h"

#define BUFFER_COUNT 7

static void list_buffers(struct abuffer_store *store, struct gpu_buffer *buffers[BUFFER_COUNT])
{
    struct gpu_buffer *all[BUFFER_COUNT] = {&store->texels, &store->samples,   &store->ids, &store->drawn,
                                            &store->voxels, &store->subvoxels, &store->sums};
    for (int i = 0; i < BUFFER_COUNT; i++)
        buffers[i] = all[i];
}

void abuffer_store_init(struct abuffer_store *store, struct gpu_device *device)
{
    *store = (struct abuffer_store){.device = device};
}

void abuffer_store_finish(struct abuffer_store *store)
{
    struct gpu_buffer *buffers[BUFFER_COUNT];
    list_buffers(store, buffers);
    for (int i = 0; i < BUFFER_COUNT; i++)
        gpu_buffer_finish(store->device, buffers[i]);
    abuffer_store_init(store, store->device);
}

bool abuffer_has_subvoxels(const struct abuffer_store *store)
{
    return !store->whole_voxels && store->voxels_along <= ABUFFER_SUBVOXELS_VOXELS_MAX &&
           4 * store->voxels_along <= store->resolution;
}

uint64_t abuffer_store_bytes(const struct abuffer_store *store)
{
    struct abuffer_store copy = *store;
    struct gpu_buffer *buffers[BUFFER_COUNT];
    uint64_t bytes = 0;
    list_buffers(&copy, buffers);
    for (int i = 0; i < BUFFER_COUNT; i++)
        bytes += buffers[i]->capacity_bytes;
    return bytes;
}
