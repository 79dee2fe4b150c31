/* SPDX-License-Identifier: MIT */
#include "session/hasher.h"

#include "base/parallel.h"
#include "protocol/common/blob_hash.h"

#include <pthread.h>
#include <stdbool.h>
#include <stdlib.h>

/* Maximum of waiting chunks; when they are reached, the network thread hashes the next chunk itself. */
#define WAITING_MAX 16u

struct chunk {
    uint8_t *hash;
    const uint8_t *data;
    size_t size_bytes;
    uint32_t *left;
};

struct hasher {
    pthread_mutex_t lock; /* guards the members below except the thread, and the counters */
    pthread_cond_t added, hashed;
    struct chunk waiting[WAITING_MAX]; /* a ring */
    uint32_t first, count;
    bool ends;
    pthread_t thread;
};

/* Hashes the next chunk. The caller holds the lock, which is released while the chunk is hashed. */
static void hash_next(struct hasher *hasher)
{
    const struct chunk chunk = hasher->waiting[hasher->first];
    hasher->first = (hasher->first + 1) % WAITING_MAX;
    hasher->count--;
    pthread_mutex_unlock(&hasher->lock);
    blob_hash_chunk(chunk.hash, chunk.data, chunk.size_bytes);
    pthread_mutex_lock(&hasher->lock);
    --*chunk.left;
    pthread_cond_signal(&hasher->hashed);
}

static void *run(void *context)
{
    struct hasher *hasher = context;
    pthread_setname_np(pthread_self(), "hash");
    pthread_mutex_lock(&hasher->lock);
    while (!hasher->ends) {
        if (hasher->count > 0)
            hash_next(hasher);
        else
            pthread_cond_wait(&hasher->added, &hasher->lock);
    }
    pthread_mutex_unlock(&hasher->lock);
    return NULL;
}

struct hasher *hasher_create(void)
{
    struct hasher *hasher = parallel_processors() > 1 ? calloc(1, sizeof(*hasher)) : NULL;
    if (!hasher)
        return NULL;
    pthread_mutex_init(&hasher->lock, NULL);
    pthread_cond_init(&hasher->added, NULL);
    pthread_cond_init(&hasher->hashed, NULL);
    if (pthread_create(&hasher->thread, NULL, run, hasher) == 0)
        return hasher;
    pthread_cond_destroy(&hasher->hashed);
    pthread_cond_destroy(&hasher->added);
    pthread_mutex_destroy(&hasher->lock);
    free(hasher);
    return NULL;
}

void hasher_destroy(struct hasher *hasher)
{
    if (!hasher)
        return;
    pthread_mutex_lock(&hasher->lock);
    hasher->ends = true;
    pthread_cond_signal(&hasher->added);
    pthread_mutex_unlock(&hasher->lock);
    pthread_join(hasher->thread, NULL);
    pthread_cond_destroy(&hasher->hashed);
    pthread_cond_destroy(&hasher->added);
    pthread_mutex_destroy(&hasher->lock);
    free(hasher);
}

void hasher_add(struct hasher *hasher, uint8_t *hash, const uint8_t *data, size_t size_bytes, uint32_t *left)
{
    bool waits = false;
    if (hasher) {
        pthread_mutex_lock(&hasher->lock);
        waits = hasher->count < WAITING_MAX;
        if (waits) {
            hasher->waiting[(hasher->first + hasher->count++) % WAITING_MAX] =
                (struct chunk){hash, data, size_bytes, left};
            ++*left;
            pthread_cond_signal(&hasher->added);
        }
        pthread_mutex_unlock(&hasher->lock);
    }
    if (!waits)
        blob_hash_chunk(hash, data, size_bytes);
}

void hasher_await(struct hasher *hasher, const uint32_t *left)
{
    if (!hasher)
        return;
    pthread_mutex_lock(&hasher->lock);
    while (*left > 0) {
        if (hasher->count > 0)
            hash_next(hasher);
        else
            pthread_cond_wait(&hasher->hashed, &hasher->lock);
    }
    pthread_mutex_unlock(&hasher->lock);
}
