/* SPDX-License-Identifier: MIT */
/* Hashes that name blobs. */
#include "protocol/common/blob_hash.h"

#include <sodium.h>

void blob_hash_chunk(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, size_t size_bytes)
{
    /* Picks the fastest implementation for this processor; hashing works without it, too. */
    int status = sodium_init();
    (void)status;
    crypto_generichash(hash, BLOB_HASH_BYTES, data, size_bytes, NULL, 0);
}

void blob_hash_chunks(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *chunk_hashes, size_t chunk_count)
{
    blob_hash_chunk(hash, chunk_hashes, chunk_count * BLOB_HASH_BYTES);
}

void blob_hash(uint8_t hash[BLOB_HASH_BYTES], const uint8_t *data, uint64_t size_bytes)
{
    crypto_generichash_state state;
    crypto_generichash_init(&state, NULL, 0, BLOB_HASH_BYTES);
    for (uint64_t at = 0; at < size_bytes; at += BLOB_CHUNK_BYTES) {
        uint8_t chunk_hash[BLOB_HASH_BYTES];
        blob_hash_chunk(chunk_hash, data + at, blob_chunk_bytes(size_bytes, at));
        crypto_generichash_update(&state, chunk_hash, sizeof(chunk_hash));
    }
    crypto_generichash_final(&state, hash, BLOB_HASH_BYTES);
}
