/* SPDX-License-Identifier: MIT */
/* Memory and references of blobs. */
#include "base/blob.h"

#include <stdlib.h>
#include <sys/mman.h>

/* Size from which memory comes from mmap, which grows without copying (mremap moves pages, not bytes). */
#define MAPPED_BYTES_MIN ((size_t)256 << 10)
#define ALIGNMENT_BYTES ((size_t)64)
#define PAGE_ROUND_BYTES ((size_t)4096)
/* Size from which memory is in huge pages if there are some, which take a third of the time to be provided. */
#define HUGE_BYTES_MIN ((size_t)8 << 20)

static bool is_mapped(const struct blob *blob)
{
    return blob->size_bytes >= MAPPED_BYTES_MIN;
}

struct blob *blob_create_empty(size_t size_bytes)
{
    if (size_bytes > SIZE_MAX / 2)
        return NULL;
    struct blob *blob = calloc(1, sizeof(*blob));
    if (!blob)
        return NULL;
    atomic_init(&blob->references, 1);
    blob->size_bytes = size_bytes;
    return blob;
}

static bool map_at_least(struct blob *blob, size_t needed_bytes)
{
    /* Doubling keeps the number of calls small; the size is known, so nothing beyond it is allocated. */
    size_t capacity_bytes = blob->capacity_bytes * 2;
    if (capacity_bytes < needed_bytes)
        capacity_bytes = needed_bytes;
    if (capacity_bytes < MAPPED_BYTES_MIN)
        capacity_bytes = MAPPED_BYTES_MIN;
    if (capacity_bytes > blob->size_bytes)
        capacity_bytes = blob->size_bytes;
    capacity_bytes = (capacity_bytes + PAGE_ROUND_BYTES - 1) & ~(PAGE_ROUND_BYTES - 1);
    void *data = blob->data
                     ? mremap(blob->data, blob->capacity_bytes, capacity_bytes, MREMAP_MAYMOVE)
                     : mmap(NULL, capacity_bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (data == MAP_FAILED)
        return false;
    /* The condition is that half of it is about to arrive: a sender of few bytes does not make it use a huge
     * page. */
    if (capacity_bytes >= HUGE_BYTES_MIN)
        (void)madvise(data, capacity_bytes, MADV_HUGEPAGE);
    blob->data = data;
    blob->capacity_bytes = capacity_bytes;
    return true;
}

bool blob_reserve(struct blob *blob, size_t needed_bytes)
{
    if (needed_bytes > blob->size_bytes)
        return false;
    if (blob->data && needed_bytes <= blob->capacity_bytes)
        return true;
    if (is_mapped(blob))
        return map_at_least(blob, needed_bytes);
    size_t capacity_bytes = (blob->size_bytes + ALIGNMENT_BYTES - 1) & ~(ALIGNMENT_BYTES - 1);
    if (!capacity_bytes)
        capacity_bytes = ALIGNMENT_BYTES;
    blob->data = aligned_alloc(ALIGNMENT_BYTES, capacity_bytes);
    if (!blob->data)
        return false;
    blob->capacity_bytes = capacity_bytes;
    return true;
}

struct blob *blob_create(size_t size_bytes)
{
    struct blob *blob = blob_create_empty(size_bytes);
    if (blob && !blob_reserve(blob, size_bytes)) {
        blob_unref(blob);
        return NULL;
    }
    return blob;
}

struct blob *blob_ref(struct blob *blob)
{
    if (blob)
        atomic_fetch_add_explicit(&blob->references, 1, memory_order_relaxed);
    return blob;
}

void blob_unref(struct blob *blob)
{
    if (!blob || atomic_fetch_sub_explicit(&blob->references, 1, memory_order_acq_rel) != 1)
        return;
    if (!is_mapped(blob))
        free(blob->data);
    else if (blob->data)
        munmap(blob->data, blob->capacity_bytes);
    free(blob);
}
