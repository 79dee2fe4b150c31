/* SPDX-License-Identifier: MIT */
/* Immutable bytes named by their content, shared between threads by reference count. */
#ifndef FARLIGHT_BASE_BLOB_H
#define FARLIGHT_BASE_BLOB_H

#include "protocol/common/blob_hash.h"

#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct blob {
    atomic_uint references;
    uint8_t hash[BLOB_HASH_BYTES]; /* blob_hash() */
    size_t size_bytes;
    uint8_t *data;         /* 64-aligned; constant once the hash has been checked */
    size_t capacity_bytes; /* allocated for `data`: less than the size while a blob arrives */
};

struct blob *blob_create(size_t size_bytes); /* has one reference; data not initialised; NULL: out of memory */
/* Creates a blob without data, for bytes that arrive in chunks and may never be complete: blob_reserve() grows
 * `data` to at least `needed_bytes`, keeps its contents and may move it. Only while there is one reference.
 * False: out of memory, or more than the size. */
struct blob *blob_create_empty(size_t size_bytes);
bool blob_reserve(struct blob *blob, size_t needed_bytes);
struct blob *blob_ref(struct blob *blob); /* accepts and returns NULL */
void blob_unref(struct blob *blob);       /* accepts NULL */

#endif
