/* SPDX-License-Identifier: MIT */
/* Hashing of blobs: all chunks of all blobs form one list of work, which two threads share. */
#include "scene.h"

#include "protocol/common/blob_hash.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>

struct chunk {
    const unsigned char *bytes;
    size_t size_bytes;
};

struct hash_work {
    struct chunk *chunks;
    uint8_t *hashes; /* hashes of the chunks */
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
        blob_hash_chunk(work->hashes + i * BLOB_HASH_BYTES, work->chunks[i].bytes, work->chunks[i].size_bytes);
    }
}

static void list_chunks(const struct import_scene *scene, struct chunk *chunks)
{
    for (size_t b = 0; b < scene->blob_count; b++) {
        const struct import_blob *blob = &scene->blobs[b];

        for (uint64_t at = 0; at < blob->size_bytes; at += BLOB_CHUNK_BYTES, chunks++) {
            chunks->bytes = blob->bytes + at;
            chunks->size_bytes = blob_chunk_bytes(blob->size_bytes, at);
        }
    }
}

static void join_chunks(struct import_scene *scene, const uint8_t *hashes)
{
    for (size_t b = 0; b < scene->blob_count; b++) {
        size_t count = (size_t)blob_chunk_count(scene->blobs[b].size_bytes);

        blob_hash_chunks(scene->blobs[b].hash, hashes, count);
        hashes += count * BLOB_HASH_BYTES;
    }
}

struct hash_order {
    const struct import_blob *blob;
    uint32_t position;
};

static int compare_hashes(const void *a, const void *b)
{
    const struct hash_order *left = a, *right = b;
    int order = memcmp(left->blob->hash, right->blob->hash, BLOB_HASH_BYTES);

    return order != 0 ? order : (left->position > right->position) - (left->position < right->position);
}

static bool find_equal(struct import_scene *scene)
{
    struct hash_order *order = calloc(scene->blob_count + 1, sizeof(*order));
    uint32_t first = 0;

    if (!order)
        return import_fail(scene, NULL, "out of memory");
    for (size_t i = 0; i < scene->blob_count; i++)
        order[i] = (struct hash_order){&scene->blobs[i], (uint32_t)i};
    qsort(order, scene->blob_count, sizeof(*order), compare_hashes);
    for (size_t i = 0; i < scene->blob_count; i++) {
        if (i == 0 || memcmp(order[i].blob->hash, order[i - 1].blob->hash, BLOB_HASH_BYTES) != 0)
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
    for (size_t b = 0; b < scene->blob_count; b++)
        work.count += (size_t)blob_chunk_count(scene->blobs[b].size_bytes);
    work.chunks = calloc(work.count + 1, sizeof(*work.chunks));
    work.hashes = calloc(work.count + 1, BLOB_HASH_BYTES);
    if (!work.chunks || !work.hashes) {
        free(work.chunks);
        free(work.hashes);
        return import_fail(scene, NULL, "out of memory");
    }
    list_chunks(scene, work.chunks);
    helped = work.count > 1 && pthread_create(&helper, NULL, hash_chunks, &work) == 0;
    hash_chunks(&work);
    if (helped)
        pthread_join(helper, NULL);
    join_chunks(scene, work.hashes);
    free(work.chunks);
    free(work.hashes);
    return find_equal(scene);
}
