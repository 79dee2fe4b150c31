/* SPDX-License-Identifier: MIT */
#include "base/prefault.h"

#include "base/clock.h"
#include "base/host.h"
#include "base/parallel.h"

#include <pthread.h>
#include <stdlib.h>
#include <string.h>

#define BLOCKS_MAX 16
/* The kernel clears pages one after the other: two processors have twice as many. */
#define THREADS_MAX 2u
/* Between two looks at what else is wanted. */
#define STEP_BYTES ((size_t)2 << 20)
/* Drivers allocate a little more than they are asked for. */
#define SLACK_BYTES ((size_t)1 << 16)
/* A finished block that the caller has not asked for again is freed after this time. */
#define UNCLAIMED_NS UINT64_C(1000000000)

struct block {
    size_t bytes;   /* that the caller will allocate; 0: the place is free */
    size_t begun;   /* of the bytes and the slack: faulted, or a thread is at it */
    size_t faulted; /* likewise */
    uint8_t *memory;
    uint64_t finished_ns; /* 0: not yet */
};

struct prefault {
    pthread_mutex_t lock; /* of all that follows but the threads */
    pthread_cond_t changed;
    struct block blocks[BLOCKS_MAX];
    bool ends;
    pthread_t threads[THREADS_MAX]; /* since the first block */
    unsigned thread_count;
};

static struct block *find(struct prefault *prefault, size_t bytes)
{
    for (size_t i = 0; i < BLOCKS_MAX; i++)
        if (prefault->blocks[i].bytes == bytes)
            return &prefault->blocks[i];
    return NULL;
}

static void drop(struct block *block)
{
    free(block->memory);
    *block = (struct block){0};
}

static size_t left(const struct block *block)
{
    return block->bytes + SLACK_BYTES - block->begun;
}

/* The one with least left to begin; NULL: all are begun. */
static struct block *next_block(struct prefault *prefault)
{
    struct block *next = NULL;
    for (size_t i = 0; i < BLOCKS_MAX; i++) {
        struct block *block = &prefault->blocks[i];
        if (block->bytes && left(block) > 0 && (!next || left(block) < left(next)))
            next = block;
    }
    return next;
}

/* Returns until when the thread may wait for work. */
static uint64_t drop_unclaimed(struct prefault *prefault)
{
    uint64_t now_ns = clock_now_ns(), first_ns = UINT64_MAX;
    for (size_t i = 0; i < BLOCKS_MAX; i++) {
        struct block *block = &prefault->blocks[i];
        uint64_t end_ns = block->finished_ns + UNCLAIMED_NS;
        if (block->finished_ns && end_ns <= now_ns)
            drop(block);
        else if (block->finished_ns && end_ns < first_ns)
            first_ns = end_ns;
    }
    return first_ns;
}

static void *run(void *context)
{
    struct prefault *prefault = context;
    pthread_mutex_lock(&prefault->lock);
    while (!prefault->ends) {
        uint64_t until_ns = drop_unclaimed(prefault);
        struct block *block = next_block(prefault);
        if (!block) {
            clock_wait(&prefault->changed, &prefault->lock, until_ns);
            continue;
        }
        size_t step = left(block) < STEP_BYTES ? left(block) : STEP_BYTES;
        uint8_t *begin = block->memory + block->begun;
        block->begun += step;
        pthread_mutex_unlock(&prefault->lock); /* the caller leaves unfinished blocks alone */
        memset(begin, 0, step);
        pthread_mutex_lock(&prefault->lock);
        block->faulted += step;
        if (block->faulted == block->bytes + SLACK_BYTES)
            block->finished_ns = clock_now_ns();
        pthread_cond_broadcast(&prefault->changed);
    }
    pthread_mutex_unlock(&prefault->lock);
    return NULL;
}

struct prefault *prefault_create(void)
{
    struct prefault *prefault = calloc(1, sizeof(*prefault));
    if (!prefault)
        return NULL;
    pthread_mutex_init(&prefault->lock, NULL);
    pthread_cond_init(&prefault->changed, NULL);
    return prefault;
}

void prefault_destroy(struct prefault *prefault)
{
    if (!prefault)
        return;
    pthread_mutex_lock(&prefault->lock);
    prefault->ends = true;
    pthread_cond_broadcast(&prefault->changed);
    pthread_mutex_unlock(&prefault->lock);
    for (unsigned i = 0; i < prefault->thread_count; i++)
        pthread_join(prefault->threads[i], NULL);
    for (size_t i = 0; i < BLOCKS_MAX; i++)
        free(prefault->blocks[i].memory);
    pthread_cond_destroy(&prefault->changed);
    pthread_mutex_destroy(&prefault->lock);
    free(prefault);
}

static size_t total_bytes(const struct prefault *prefault)
{
    size_t total = 0;
    for (size_t i = 0; i < BLOCKS_MAX; i++)
        total += prefault->blocks[i].bytes;
    return total;
}

/* The second gives way: others may have work for its processor. */
static void *run_beside(void *context)
{
    host_thread_gives_way();
    return run(context);
}

static bool start_threads(struct prefault *prefault)
{
    const unsigned max = parallel_processors() < THREADS_MAX ? parallel_processors() : THREADS_MAX;
    if (prefault->thread_count > 0)
        return true;
    for (unsigned i = 0; i < max; i++) {
        pthread_t *thread = &prefault->threads[prefault->thread_count];
        if (pthread_create(thread, NULL, i == 0 ? run : run_beside, prefault) != 0)
            break;
        pthread_setname_np(*thread, "prefault");
        prefault->thread_count++;
    }
    return prefault->thread_count > 0;
}

/* NULL: there is no thread, or no place or memory for the block. */
static struct block *begin(struct prefault *prefault, size_t bytes)
{
    struct block *block = find(prefault, 0);
    if (!block || bytes > PREFAULT_BYTES_MAX - total_bytes(prefault))
        return NULL;
    uint8_t *memory = start_threads(prefault) ? malloc(bytes + SLACK_BYTES) : NULL;
    if (!memory)
        return NULL;
    *block = (struct block){.bytes = bytes, .memory = memory};
    pthread_cond_broadcast(&prefault->changed);
    return block;
}

static bool is_worth_it(const struct prefault *prefault, size_t bytes)
{
    return prefault && bytes >= PREFAULT_BYTES_MIN && bytes <= PREFAULT_BYTES_MAX;
}

bool prefault_is_ready(struct prefault *prefault, size_t bytes, uint64_t until_ns)
{
    if (!is_worth_it(prefault, bytes))
        return true;
    pthread_mutex_lock(&prefault->lock);
    struct block *block = find(prefault, bytes);
    if (!block)
        block = begin(prefault, bytes);
    bool in_time = true;
    /* A time that has passed is not waited for at all: a wait lets the lock go, and the thread might finish then.
     */
    while (block && !block->finished_ns && in_time)
        in_time = clock_now_ns() < until_ns && clock_wait(&prefault->changed, &prefault->lock, until_ns);
    bool ready = !block || block->finished_ns;
    if (block && ready)
        drop(block);
    pthread_mutex_unlock(&prefault->lock);
    return ready;
}

bool prefault_goes_on(struct prefault *prefault, size_t bytes)
{
    if (!is_worth_it(prefault, bytes))
        return false;
    pthread_mutex_lock(&prefault->lock);
    const struct block *block = find(prefault, bytes);
    bool goes_on = block && !block->finished_ns;
    pthread_mutex_unlock(&prefault->lock);
    return goes_on;
}
