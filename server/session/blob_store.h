/* SPDX-License-Identifier: MIT */
/* Complete blobs by principal and content. A blob lives while a session or a scene uses it, and then in a
 * bounded cache, least recently used out first, for the same principal's next connection. One thread. */
#ifndef FARLIGHT_SESSION_BLOB_STORE_H
#define FARLIGHT_SESSION_BLOB_STORE_H

#include "base/blob.h"
#include "base/error.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The owner of blobs: a hash must not give access to another user's data. */
typedef uint64_t blob_principal;

/* The memory of a blob beside its content: counted against the limits, as there may be many small blobs. */
#define BLOB_STORE_OVERHEAD_BYTES 256u

struct blob_store;

struct blob_store *blob_store_create(uint64_t limit_bytes, uint64_t cache_limit_bytes); /* NULL: out of memory */
void blob_store_destroy(struct blob_store *store);                                      /* accepts NULL */
/* Sets new limits. Blobs beyond them stay until their uses end. */
void blob_store_limit(struct blob_store *store, uint64_t limit_bytes, uint64_t cache_limit_bytes);

/* A new reference, or NULL: not there. */
struct blob *blob_store_find(struct blob_store *store, blob_principal principal,
                             const uint8_t hash[BLOB_HASH_BYTES], uint64_t size_bytes);
/* Gives the store a complete blob, which takes a reference of its own, and returns a new reference to the
 * one that is held under this name from now on: it, or an equal one that was there. NULL: out of memory. */
struct blob *blob_store_add(struct blob_store *store, blob_principal principal, struct blob *blob);

/* Reserves bytes for a blob that is about to arrive; ERROR_LIMIT if they do not fit even without the cache. */
bool blob_store_reserve(struct blob_store *store, uint64_t size_bytes, struct error *error);
/* Bytes that must be released before that many can be reserved; 0: none, or they can never be reserved. */
uint64_t blob_store_lacking(const struct blob_store *store, uint64_t size_bytes);
/* Releases reserved bytes: the blob is added now, or was abandoned. */
void blob_store_release(struct blob_store *store, uint64_t size_bytes);

/* Drops unused blobs beyond the cache; to be called when uses may have ended. */
void blob_store_trim(struct blob_store *store);
/* The principal will not return: its blobs that scenes still use are kept, and counted, until their uses end. */
void blob_store_forget(struct blob_store *store, blob_principal principal);
uint64_t blob_store_bytes(const struct blob_store *store); /* bytes of content, held and reserved */
size_t blob_store_count(const struct blob_store *store);

#endif
