/* SPDX-License-Identifier: MIT */
/* Packs large arrays of the scene into buffers of the device: they are reserved in steps, mapped, and written by a
 * thread, so that the GL thread returns at the end of its step however large they are. */
#ifndef FARLIGHT_GPU_SCENE_PACKING_H
#define FARLIGHT_GPU_SCENE_PACKING_H

#include "base/error.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct gpu_scene;
struct gpu_buffer;

/* A buffer, and the function that writes it. */
struct packing_part {
    struct gpu_buffer *buffer;
    size_t bytes;
    /* Writes the part, on any thread; it may return early once *stop is set. */
    void (*write)(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop);
    int array, place; /* arguments of `write` */
    void *out;        /* `bytes` of mapped memory */
};

#define PACKING_PARTS_MAX 20

/* All-zero: empty. */
struct packing {
    struct packing_part parts[PACKING_PARTS_MAX];
    uint32_t part_count;
    const struct gpu_scene *gpu;
    bool is_mapped, has_thread;
    pthread_t thread;
    pthread_mutex_t lock; /* guards has_ended; it and its condition exist as long as the thread */
    pthread_cond_t ended;
    bool has_ended;
    atomic_bool stop;
};

enum packing_progress { PACKING_FAILED, PACKING_MORE, PACKING_DONE };

/* Adds a part before the first step. `bytes` 0: the buffer becomes empty. */
void packing_add(struct packing *packing, const struct packing_part *part);
/* Continues until about `end_ns` of the clock. The writers' input must not change until packing is done or
 * stopped. PACKING_FAILED: see gpu_buffer_reserve(); ERROR_BUSY: memory is reserved in steps, and the next step
 * continues. */
enum packing_progress packing_step(struct gpu_scene *gpu, struct packing *packing, uint64_t end_ns,
                                   struct error *error);
/* Whether the thread is writing. */
bool packing_waits(struct packing *packing);
/* Stops the thread and drops the parts. The buffers, if they still exist, are no longer mapped. */
void packing_finish(struct gpu_scene *gpu, struct packing *packing);
uint64_t packing_bytes(const struct packing *packing);

#endif
