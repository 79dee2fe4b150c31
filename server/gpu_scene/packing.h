/* SPDX-License-Identifier: MIT */
/* Large arrays of the scene into buffers of the device: reserved in steps, mapped, and written by a thread beside
 * the one that owns GL, which is back at the end of its step however large they are. */
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

/* A buffer, and who writes it. */
struct packing_part {
    struct gpu_buffer *buffer;
    size_t bytes;
    /* On any thread; it may return early once *stop is set. */
    void (*write)(const struct gpu_scene *gpu, const struct packing_part *part, const atomic_bool *stop);
    int array, place; /* for `write`: what is packed */
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
    pthread_mutex_t lock; /* of has_ended; with its condition there as long as the thread */
    pthread_cond_t ended;
    bool has_ended;
    atomic_bool stop;
};

enum packing_progress { PACKING_FAILED, PACKING_MORE, PACKING_DONE };

/* Before the first step. `bytes` 0: the buffer becomes empty. */
void packing_add(struct packing *packing, const struct packing_part *part);
/* Goes on until about `end_ns` of the clock. What the writers read must not change until it is done or stopped.
 * PACKING_FAILED: see gpu_buffer_reserve(); ERROR_BUSY: memory is reserved in steps, and the next one goes on. */
enum packing_progress packing_step(struct gpu_scene *gpu, struct packing *packing, uint64_t end_ns,
                                   struct error *error);
/* Whether the thread is writing. */
bool packing_waits(struct packing *packing);
/* Stops the thread and forgets the parts. The buffers, if they are still there, are not mapped any more. */
void packing_finish(struct gpu_scene *gpu, struct packing *packing);
uint64_t packing_bytes(const struct packing *packing);

#endif
