/* SPDX-License-Identifier: MIT */
/* session/hasher: chunks hashed beside the network thread. */
#include <stddef.h>
#include <stdint.h>

#include "protocol/common/blob_hash.h"
#include "session/hasher.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

#define CHUNKS 200u /* more than wait at a time */
#define BYTES ((size_t)3001)

static void expect_all_hashed(struct hasher *hasher)
{
    uint8_t *data = malloc(CHUNKS * BYTES), *hashes = calloc(CHUNKS, BLOB_HASH_BYTES);
    uint32_t left[2] = {0, 0};
    assert_true(data && hashes);
    for (size_t i = 0; i < CHUNKS * BYTES; i++)
        data[i] = (uint8_t)(i * 31 + i / BYTES);
    for (size_t i = 0; i < CHUNKS; i++)
        hasher_add(hasher, hashes + i * BLOB_HASH_BYTES, data + i * BYTES, BYTES - i, &left[i % 2]);
    for (size_t half = 0; half < 2; half++) {
        hasher_await(hasher, &left[half]);
        assert_int_equal(left[half], 0);
        for (size_t i = half; i < CHUNKS; i += 2) {
            uint8_t expected[BLOB_HASH_BYTES];
            blob_hash_chunk(expected, data + i * BYTES, BYTES - i);
            assert_memory_equal(hashes + i * BLOB_HASH_BYTES, expected, sizeof(expected));
        }
    }
    free(data);
    free(hashes);
}

TEST(each_chunk_has_its_hash_once_its_counter_was_awaited)
{
    struct hasher *hasher = hasher_create();
    for (int round = 0; round < 20; round++)
        expect_all_hashed(hasher);
    hasher_destroy(hasher);
}

TEST(without_a_thread_chunks_are_hashed_at_once)
{
    expect_all_hashed(NULL);
    hasher_destroy(NULL);
}
