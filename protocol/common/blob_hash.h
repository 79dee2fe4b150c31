/* SPDX-License-Identifier: MIT */
/* Hashes that name blobs: BLAKE2b-256 over the BLAKE2b-256 hashes of their 1 MiB chunks, so that threads can
 * share the work. Computed by libsodium's crypto_generichash; any thread. */
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

/* Size of the chunk that begins at `at_bytes`. */
static inline size_t blob_chunk_bytes(uint64_t size_bytes, uint64_t at_bytes)
{
    uint64_t left_bytes = size_bytes - at_bytes;
    return left_bytes < BLOB_CHUNK_BYTES ? (size_t)left_bytes : BLOB_CHUNK_BYTES;
}

void blob_hash_chunk(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, size_t size_bytes);
/* Computes a blob's name from the concatenated hashes of all chunks. */
void blob_hash_chunks(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *chunk_hashes, size_t chunk_count);
/* Computes a blob's name from its bytes. */
void blob_hash(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, uint64_t size_bytes);

#endif
