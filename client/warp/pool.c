/* SPDX-License-Identifier: MIT */
/* Threads that share a loop. */
#include "warp/pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <time.h>

struct worker {
    struct warp_pool *pool;
    pthread_t thread;
    unsigned number;
};

struct warp_pool {
    pthread_mutex_t mutex;
    pthread_cond_t changed; /* signals `round`, `ends` or `busy` */
    unsigned threads, started;
    unsigned round; /* incremented by each run */
    unsigned busy;  /* workers in the current run */
    bool ends;
    warp_pool_work *work; /* function of the current run */
    void *context;
    unsigned items;
    atomic_uint next;
    uint64_t processor_ns;
    struct worker workers[]; /* threads besides the caller */
};

static uint64_t thread_ns(void)
{
    struct timespec now;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return (uint64_t)now.tv_sec * 1000000000u + (uint64_t)now.tv_nsec;
}

static uint64_t take_items(struct warp_pool *pool, unsigned worker)
{
    const uint64_t start_ns = thread_ns();
    for (unsigned item; (item = atomic_fetch_add(&pool->next, 1)) < pool->items;)
        pool->work(pool->context, item, worker);
    return thread_ns() - start_ns;
}

static void *serve(void *argument)
{
    struct worker *worker = argument;
    struct warp_pool *pool = worker->pool;
    pthread_mutex_lock(&pool->mutex);
    for (unsigned round = 0;;) {
        while (pool->round == round && !pool->ends)
            pthread_cond_wait(&pool->changed, &pool->mutex);
        if (pool->ends)
            break;
        round = pool->round;
        pthread_mutex_unlock(&pool->mutex);
        const uint64_t time_ns = take_items(pool, worker->number);
        pthread_mutex_lock(&pool->mutex);
        pool->processor_ns += time_ns;
        pool->busy--;
        pthread_cond_broadcast(&pool->changed);
    }
    pthread_mutex_unlock(&pool->mutex);
    return NULL;
}

struct warp_pool *warp_pool_create(unsigned threads)
{
    struct warp_pool *pool = calloc(1, sizeof(*pool) + (threads - 1) * sizeof(pool->workers[0]));
    if (!pool)
        return NULL;
    pool->threads = threads;
    pthread_mutex_init(&pool->mutex, NULL);
    pthread_cond_init(&pool->changed, NULL);
    for (; pool->started < threads - 1; pool->started++) {
        struct worker *worker = &pool->workers[pool->started];
        *worker = (struct worker){.pool = pool, .number = pool->started + 1};
        if (pthread_create(&worker->thread, NULL, serve, worker) != 0) {
            warp_pool_destroy(pool);
            return NULL;
        }
    }
    return pool;
}

void warp_pool_destroy(struct warp_pool *pool)
{
    if (!pool)
        return;
    pthread_mutex_lock(&pool->mutex);
    pool->ends = true;
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->mutex);
    for (unsigned i = 0; i < pool->started; i++)
        pthread_join(pool->workers[i].thread, NULL);
    pthread_cond_destroy(&pool->changed);
    pthread_mutex_destroy(&pool->mutex);
    free(pool);
}

unsigned warp_pool_threads(const struct warp_pool *pool)
{
    return pool->threads;
}

uint64_t warp_pool_run(struct warp_pool *pool, warp_pool_work *work, void *context, unsigned items)
{
    pthread_mutex_lock(&pool->mutex);
    pool->work = work;
    pool->context = context;
    pool->items = items;
    atomic_store(&pool->next, 0);
    pool->processor_ns = 0;
    pool->busy = pool->started;
    pool->round++;
    pthread_cond_broadcast(&pool->changed);
    pthread_mutex_unlock(&pool->mutex);
    const uint64_t own_ns = take_items(pool, 0);
    pthread_mutex_lock(&pool->mutex);
    while (pool->busy > 0)
        pthread_cond_wait(&pool->changed, &pool->mutex);
    const uint64_t time_ns = pool->processor_ns + own_ns;
    pthread_mutex_unlock(&pool->mutex);
    return time_ns;
}
