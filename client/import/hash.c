/* SPDX-License-Identifier: MIT */
/* BLAKE2b-256 over the BLAKE2b-256 hashes of a blob's 1 MiB chunks. All chunks of all blobs are one list of work
 * that two threads share. */
#include "import.h"

#include <pthread.h>
#include <sodium.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

#define CHUNK_BYTES (1u << 20)
#define HASH_BYTES 32

struct chunk {
    const unsigned char *bytes;
    size_t size_bytes;
    unsigned char hash[HASH_BYTES];
};

struct hash_work {
    struct chunk *chunks;
    size_t count;
    atomic_size_t next;
};

static void *hash_chunks(void *argument)
{
    struct hash_work *work = argument;

    for (;;) {
        size_t i = atomic_fetch_add(&work->next, 1);

        if (i >= work->count)
            return NULL;
        crypto_generichash(work->chunks[i].hash, HASH_BYTES, work->chunks[i].bytes, work->chunks[i].size_bytes,
                           NULL, 0);
    }
}

static size_t chunk_count(uint64_t size_bytes)
{
    return (size_t)((size_bytes + CHUNK_BYTES - 1) / CHUNK_BYTES);
}

static void list_chunks(const struct import_scene *scene, struct chunk *chunks)
{
    for (size_t b = 0; b < scene->blob_count; b++) {
        const struct import_blob *blob = &scene->blobs[b];

        for (uint64_t at = 0; at < blob->size_bytes; at += CHUNK_BYTES, chunks++) {
            uint64_t rest = blob->size_bytes - at;

            chunks->bytes = blob->bytes + at;
            chunks->size_bytes = rest < CHUNK_BYTES ? (size_t)rest : CHUNK_BYTES;
        }
    }
}

static void join_chunks(struct import_scene *scene, const struct chunk *chunks)
{
    for (size_t b = 0; b < scene->blob_count; b++) {
        crypto_generichash_state state;
        size_t count = chunk_count(scene->blobs[b].size_bytes);

        crypto_generichash_init(&state, NULL, 0, HASH_BYTES);
        for (size_t i = 0; i < count; i++, chunks++)
            crypto_generichash_update(&state, chunks->hash, HASH_BYTES);
        crypto_generichash_final(&state, scene->blobs[b].hash, HASH_BYTES);
    }
}

struct hash_order {
    const struct import_blob *blob;
    uint32_t position;
};

static int compare_hashes(const void *a, const void *b)
{
    const struct hash_order *left = a, *right = b;
    int order = memcmp(left->blob->hash, right->blob->hash, HASH_BYTES);

    return order != 0 ? order : (left->position > right->position) - (left->position < right->position);
}

static bool find_equal(struct import_scene *scene)
{
    struct hash_order *order = calloc(scene->blob_count + 1, sizeof *order);
    uint32_t first = 0;

    if (!order)
        return import_fail(scene, NULL, "out of memory");
    for (size_t i = 0; i < scene->blob_count; i++)
        order[i] = (struct hash_order){&scene->blobs[i], (uint32_t)i};
    qsort(order, scene->blob_count, sizeof *order, compare_hashes);
    for (size_t i = 0; i < scene->blob_count; i++) {
        if (i == 0 || memcmp(order[i].blob->hash, order[i - 1].blob->hash, HASH_BYTES) != 0)
            first = order[i].position;
        scene->blobs[order[i].position].same_as = first;
    }
    free(order);
    return true;
}

bool import_hash(struct import_scene *scene)
{
    struct hash_work work = {0};
    pthread_t helper;
    bool helped;

    if (scene->failed)
        return false;
    if (sodium_init() < 0)
        return import_fail(scene, NULL, "libsodium could not be initialised");
    for (size_t b = 0; b < scene->blob_count; b++)
        work.count += chunk_count(scene->blobs[b].size_bytes);
    work.chunks = calloc(work.count + 1, sizeof *work.chunks);
    if (!work.chunks)
        return import_fail(scene, NULL, "out of memory");
    list_chunks(scene, work.chunks);
    helped = work.count > 1 && pthread_create(&helper, NULL, hash_chunks, &work) == 0;
    hash_chunks(&work);
    if (helped)
        pthread_join(helper, NULL);
    join_chunks(scene, work.chunks);
    free(work.chunks);
    return find_equal(scene);
}
