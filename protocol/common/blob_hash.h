/* SPDX-License-Identifier: MIT */
/* The names of blobs: BLAKE2b-256 over the BLAKE2b-256 hashes of their 1 MiB chunks, so that threads can share the
 * work. By libsodium's crypto_generichash; any thread. */
#ifndef FARLIGHT_PROTOCOL_COMMON_BLOB_HASH_H
#define FARLIGHT_PROTOCOL_COMMON_BLOB_HASH_H

#include <stddef.h>
#include <stdint.h>

#define BLOB_HASH_BYTES 32
#define BLOB_CHUNK_BYTES ((size_t)1 << 20)

static inline uint64_t blob_chunk_count(uint64_t size_bytes)
{
    return size_bytes / BLOB_CHUNK_BYTES + (size_bytes % BLOB_CHUNK_BYTES != 0);
}

/* Of the chunk that begins at `at_bytes`. */
static inline size_t blob_chunk_bytes(uint64_t size_bytes, uint64_t at_bytes)
{
    uint64_t left_bytes = size_bytes - at_bytes;
    return left_bytes < BLOB_CHUNK_BYTES ? (size_t)left_bytes : BLOB_CHUNK_BYTES;
}

void blob_hash_chunk(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, size_t size_bytes);
/* The name, from the hashes of all chunks one behind the other. */
void blob_hash_chunks(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *chunk_hashes, size_t chunk_count);
/* Both steps. */
void blob_hash(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, uint64_t size_bytes);

#endif
