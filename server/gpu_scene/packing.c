/* SPDX-License-Identifier: MIT */
/* Steps of packing: memory is reserved, mapped, written by a thread, and unmapped. */
#include "gpu_scene/packing.h"

#include "base/clock.h"
#include "base/host.h"
#include "gpu/buffer.h"
#include "gpu_scene/scene.h"

/* Minimum of bytes for a thread: fewer are written at once, as a thread costs more. */
#define THREADED_BYTES ((uint64_t)4 << 20)

void packing_add(struct packing *packing, const struct packing_part *part)
{
    packing->parts[packing->part_count++] = *part;
}

uint64_t packing_bytes(const struct packing *packing)
{
    uint64_t bytes = 0;
    for (uint32_t i = 0; i < packing->part_count; i++)
        bytes += packing->parts[i].bytes;
    return bytes;
}

/* Maps all parts. They are reserved first, so that a postponed step leaves none mapped. */
static bool map_all(struct gpu_scene *gpu, struct packing *packing, struct error *error)
{
    for (uint32_t i = 0; i < packing->part_count; i++) {
        if (!gpu_buffer_reserve(gpu->device, packing->parts[i].buffer, packing->parts[i].bytes, error))
            return false;
    }
    packing->is_mapped = true;
    for (uint32_t i = 0; i < packing->part_count; i++) {
        struct packing_part *part = &packing->parts[i];
        if (part->bytes && !(part->out = gpu_buffer_map(gpu->device, part->buffer, part->bytes, error)))
            return false;
    }
    return true;
}

static void write_all(struct packing *packing)
{
    for (uint32_t i = 0; i < packing->part_count && !atomic_load(&packing->stop); i++) {
        if (packing->parts[i].bytes)
            packing->parts[i].write(packing->gpu, &packing->parts[i], &packing->stop);
    }
}

static void *run_thread(void *context)
{
    struct packing *packing = context;
    host_thread_lower_priority();
    write_all(packing);
    pthread_mutex_lock(&packing->lock);
    packing->has_ended = true;
    pthread_cond_signal(&packing->ended);
    pthread_mutex_unlock(&packing->lock);
    return NULL;
}

static void begin(struct gpu_scene *gpu, struct packing *packing)
{
    packing->gpu = gpu;
    packing->has_ended = false;
    if (packing_bytes(packing) >= THREADED_BYTES) {
        pthread_mutex_init(&packing->lock, NULL);
        pthread_cond_init(&packing->ended, NULL);
        packing->has_thread = pthread_create(&packing->thread, NULL, run_thread, packing) == 0;
    }
    if (!packing->has_thread)
        write_all(packing);
}

static bool has_ended_by(struct packing *packing, uint64_t until_ns)
{
    return !packing->has_thread || clock_wait_for(&packing->has_ended, &packing->ended, &packing->lock, until_ns);
}

static void join(struct packing *packing)
{
    if (!packing->has_thread)
        return;
    pthread_join(packing->thread, NULL);
    pthread_cond_destroy(&packing->ended);
    pthread_mutex_destroy(&packing->lock);
    packing->has_thread = false;
}

enum packing_progress packing_step(struct gpu_scene *gpu, struct packing *packing, uint64_t end_ns,
                                   struct error *error)
{
    if (!packing->is_mapped) {
        if (!map_all(gpu, packing, error))
            return PACKING_FAILED;
        begin(gpu, packing);
    }
    return has_ended_by(packing, end_ns) ? PACKING_DONE : PACKING_MORE;
}

bool packing_waits(struct packing *packing)
{
    return packing->has_thread && !has_ended_by(packing, 0);
}

void packing_finish(struct gpu_scene *gpu, struct packing *packing)
{
    atomic_store(&packing->stop, true);
    join(packing);
    for (uint32_t i = 0; i < packing->part_count; i++) {
        if (packing->parts[i].out)
            gpu_buffer_unmap(gpu->device, packing->parts[i].buffer);
    }
    *packing = (struct packing){0};
}
