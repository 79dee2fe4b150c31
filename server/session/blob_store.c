/* SPDX-License-Identifier: MIT */
#include "session/blob_store.h"

#include "base/hashmap.h"

#include <stdlib.h>
#include <string.h>

struct entry {
    struct hashmap_link same_key;
    struct entry *older, *newer;
    blob_principal principal;
    bool forgotten; /* the principal will not return: the blob cannot be found and ends with its last use */
    struct blob *blob;
};

struct blob_store {
    struct hashmap map;            /* first entry of a chain, by key_of() */
    struct entry *oldest, *newest; /* by last use */
    uint64_t held_bytes, reserved_bytes;
    uint64_t limit_bytes, cache_limit_bytes;
    size_t count;
};

static uint64_t key_of(blob_principal principal, const uint8_t hash[BLOB_HASH_BYTES])
{
    uint64_t key;
    memcpy(&key, hash, sizeof(key));
    return key ^ principal * UINT64_C(0x9e3779b97f4a7c15);
}

struct blob_store *blob_store_create(uint64_t limit_bytes, uint64_t cache_limit_bytes)
{
    struct blob_store *store = calloc(1, sizeof(*store));
    if (!store)
        return NULL;
    store->limit_bytes = limit_bytes;
    store->cache_limit_bytes = cache_limit_bytes;
    return store;
}

static void unlink_age(struct blob_store *store, struct entry *entry)
{
    *(entry->older ? &entry->older->newer : &store->oldest) = entry->newer;
    *(entry->newer ? &entry->newer->older : &store->newest) = entry->older;
}

static void link_newest(struct blob_store *store, struct entry *entry)
{
    entry->older = store->newest;
    entry->newer = NULL;
    *(store->newest ? &store->newest->newer : &store->oldest) = entry;
    store->newest = entry;
}

static void remove_entry(struct blob_store *store, struct entry *entry)
{
    hashmap_unchain(&store->map, key_of(entry->principal, entry->blob->hash), &entry->same_key);
    unlink_age(store, entry);
    store->held_bytes -= entry->blob->size_bytes;
    store->count--;
    blob_unref(entry->blob);
    free(entry);
}

void blob_store_destroy(struct blob_store *store)
{
    if (!store)
        return;
    while (store->oldest)
        remove_entry(store, store->oldest);
    hashmap_finish(&store->map);
    free(store);
}

static struct entry *find(const struct blob_store *store, blob_principal principal,
                          const uint8_t hash[BLOB_HASH_BYTES])
{
    struct entry *entry = hashmap_get(&store->map, key_of(principal, hash));
    while (entry && (entry->principal != principal || memcmp(entry->blob->hash, hash, BLOB_HASH_BYTES) != 0))
        entry = (struct entry *)entry->same_key.next;
    return entry;
}

struct blob *blob_store_find(struct blob_store *store, blob_principal principal,
                             const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes)
{
    struct entry *entry = find(store, principal, hash);
    if (!entry || entry->blob->size_bytes != size_bytes)
        return NULL;
    unlink_age(store, entry);
    link_newest(store, entry);
    return blob_ref(entry->blob);
}

struct blob *blob_store_add(struct blob_store *store, blob_principal principal, struct blob *blob)
{
    struct entry *entry = find(store, principal, blob->hash);
    if (entry)
        return blob_ref(entry->blob);
    entry = calloc(1, sizeof(*entry));
    if (!entry)
        return NULL;
    *entry = (struct entry){.principal = principal, .blob = blob};
    if (!hashmap_chain(&store->map, key_of(principal, blob->hash), &entry->same_key)) {
        free(entry);
        return NULL;
    }
    link_newest(store, entry);
    blob_ref(blob);
    store->held_bytes += blob->size_bytes;
    store->count++;
    return blob_ref(blob);
}

/* Whether only the store has a reference. Uses end in other threads, and begin only here. */
static bool is_idle(const struct entry *entry)
{
    return atomic_load_explicit(&entry->blob->references, memory_order_acquire) == 1;
}

static uint64_t cost_of(const struct entry *entry)
{
    return entry->blob->size_bytes + BLOB_STORE_OVERHEAD_BYTES;
}

/* Drops idle blobs until at most that many bytes of them are left: first those of principals that will not return,
 * then the oldest. */
static void trim_to(struct blob_store *store, uint64_t idle_limit_bytes)
{
    uint64_t idle_bytes = 0;
    for (const struct entry *entry = store->oldest; entry; entry = entry->newer)
        idle_bytes += is_idle(entry) && !entry->forgotten ? cost_of(entry) : 0;
    for (struct entry *entry = store->oldest, *newer; entry; entry = newer) {
        newer = entry->newer;
        if (!is_idle(entry) || (!entry->forgotten && idle_bytes <= idle_limit_bytes))
            continue;
        idle_bytes -= entry->forgotten ? 0 : cost_of(entry);
        remove_entry(store, entry);
    }
}

void blob_store_trim(struct blob_store *store)
{
    trim_to(store, store->cache_limit_bytes);
}

void blob_store_limit(struct blob_store *store, uint64_t limit_bytes, uint64_t cache_limit_bytes)
{
    store->limit_bytes = limit_bytes;
    store->cache_limit_bytes = cache_limit_bytes;
    blob_store_trim(store);
}

static uint64_t used_bytes(const struct blob_store *store)
{
    return blob_store_bytes(store) + (uint64_t)store->count * BLOB_STORE_OVERHEAD_BYTES;
}

static bool fits(const struct blob_store *store, uint64_t size_bytes)
{
    uint64_t used = used_bytes(store);
    return used <= store->limit_bytes && size_bytes <= store->limit_bytes - used;
}

uint64_t blob_store_lacking(const struct blob_store *store, uint64_t size_bytes)
{
    if (size_bytes > store->limit_bytes || fits(store, size_bytes))
        return 0;
    return used_bytes(store) - (store->limit_bytes - size_bytes);
}

bool blob_store_reserve(struct blob_store *store, uint64_t size_bytes, struct error *error)
{
    if (!fits(store, size_bytes))
        trim_to(store, 0);
    if (!fits(store, size_bytes)) {
        error_set(error, ERROR_LIMIT, "blob", "%llu bytes are held, %llu more would pass the limit of %llu",
                  (unsigned long long)blob_store_bytes(store), (unsigned long long)size_bytes,
                  (unsigned long long)store->limit_bytes);
        error_remedy(error,
                     "end connections that are not needed, as each holds its blobs, or raise memory.blobs in the "
                     "daemon's configuration");
        if (error)
            error->retryable = size_bytes <= store->limit_bytes;
        return false;
    }
    store->reserved_bytes += size_bytes;
    return true;
}

void blob_store_release(struct blob_store *store, uint64_t size_bytes)
{
    store->reserved_bytes -= size_bytes;
}

void blob_store_forget(struct blob_store *store, blob_principal principal)
{
    for (struct entry *entry = store->oldest; entry; entry = entry->newer)
        entry->forgotten = entry->forgotten || entry->principal == principal;
    blob_store_trim(store);
}

uint64_t blob_store_bytes(const struct blob_store *store)
{
    return store->held_bytes + store->reserved_bytes;
}

size_t blob_store_count(const struct blob_store *store)
{
    return store->count;
}
