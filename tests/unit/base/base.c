/* SPDX-License-Identifier: MIT */
/* base: errors, map, stage times, blobs. */
#include <stddef.h>
#include <stdint.h>

#include "base/blob.h"
#include "base/error.h"
#include "base/hashmap.h"
#include "base/stage_times.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

TEST(the_first_error_wins)
{
    struct error error = {0};
    assert_false(error_set(&error, ERROR_INVALID, "mesh 3", "%d is odd", 7));
    assert_false(error_set(&error, ERROR_LIMIT, "other", "too much"));
    assert_int_equal(error.kind, ERROR_INVALID);
    assert_string_equal(error.field, "mesh 3");
    assert_string_equal(error.text, "7 is odd");
    assert_false(error_remedy(&error, "use %s", "8"));
    assert_string_equal(error.remedy, "use 8");
    assert_false(error_set(NULL, ERROR_INVALID, NULL, "nobody listens"));
}

/* Against a plain array of flags, with keys that a client would choose and keys that collide. */
TEST(a_map_keeps_what_was_put_and_forgets_what_was_removed)
{
    enum { KEYS = 5000, STEPS = 60000 };
    struct hashmap map = {0};
    static int values[KEYS];
    static bool there[KEYS];
    unsigned random = 1;
    size_t count = 0;
    for (int step = 0; step < STEPS; step++) {
        random = random * 1664525u + 1013904223u;
        size_t i = (random >> 8) % KEYS;
        uint64_t key = i % 2 ? i : (uint64_t)i << 40;
        assert_ptr_equal(hashmap_get(&map, key), there[i] ? &values[i] : NULL);
        if (random >> 31) {
            assert_true(hashmap_put(&map, key, &values[i]));
            count += !there[i];
            there[i] = true;
        } else {
            assert_ptr_equal(hashmap_remove(&map, key), there[i] ? &values[i] : NULL);
            count -= there[i];
            there[i] = false;
        }
        assert_int_equal(map.count, count);
    }
    size_t cursor = 0, seen = 0;
    void *value;
    while (hashmap_next(&map, &cursor, NULL, &value)) {
        assert_true(there[(int *)value - values]);
        seen++;
    }
    assert_int_equal(seen, count);
    hashmap_finish(&map);
}

/* Undoes the finaliser of splitmix64, whose constants everybody knows. */
static uint64_t key_with_home(uint64_t home)
{
    home = (home ^ home >> 31 ^ home >> 62) * 0x319642b2d24d8ec3u;
    home = (home ^ home >> 27 ^ home >> 54) * 0x96de1b173f119089u;
    return home ^ home >> 30 ^ home >> 60;
}

TEST(keys_chosen_to_collide_do_not_make_a_map_slow)
{
    struct hashmap map = {0};
    int value = 0;
    clock_t start = clock();
    for (uint64_t i = 1; i <= 150000; i++)
        assert_true(hashmap_put(&map, key_with_home(i << 24), &value));
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    assert_int_equal(map.count, 150000);
    hashmap_finish(&map);
    if (seconds > 2) /* a few hundredths; if all fell on one place, a minute */
        fail_msg("%.2f s for 150000 keys", seconds);
}

TEST(a_map_is_iterated_in_the_order_of_insertion)
{
    struct hashmap map = {0};
    int value = 0;
    for (uint64_t key = 1000; key > 0; key -= 10)
        hashmap_put(&map, key, &value);
    size_t cursor = 0;
    uint64_t key, expected = 1000;
    for (; hashmap_next(&map, &cursor, &key, NULL); expected -= 10)
        assert_int_equal(key, expected);
    assert_int_equal(expected, 0);
    hashmap_finish(&map);
}

TEST(stage_spans_beyond_the_last_are_added_to_one_of_their_kind)
{
    static struct stage_times times;
    stage_times_begin(&times);
    for (uint32_t wave = 0; wave < STAGE_SPANS_MAX + 10; wave++)
        stage_times_add(&times, STAGE_TRACE, CLOCK_GPU, wave, times.origin_ns + wave, 2);
    assert_int_equal(times.count, STAGE_SPANS_MAX);
    assert_int_equal(times.spans[5].start_ns, 5);
    assert_int_equal(stage_times_sum_ns(&times, STAGE_TRACE, CLOCK_GPU), 2 * (STAGE_SPANS_MAX + 10));
    assert_int_equal(stage_times_sum_ns(&times, STAGE_TRACE, CLOCK_CPU), 0);
    stage_times_add(&times, STAGE_SEND, CLOCK_CPU, 0, times.origin_ns, 77); /* the first of its kind finds room */
    assert_int_equal(times.count, STAGE_SPANS_MAX);
    assert_int_equal(stage_times_sum_ns(&times, STAGE_SEND, CLOCK_CPU), 77);
    assert_int_equal(stage_times_sum_ns(&times, STAGE_TRACE, CLOCK_GPU), 2 * (STAGE_SPANS_MAX + 10));
    stage_times_add(NULL, STAGE_TRACE, CLOCK_GPU, 0, 0, 1);
    assert_string_equal(stage_name(STAGE_READBACK), "readback");
}

static void print_hash(const uint8_t hash[BLOB_HASH_BYTES], char text[65])
{
    for (int i = 0; i < BLOB_HASH_BYTES; i++)
        snprintf(text + 2 * i, 3, "%02x", hash[i]);
}

TEST(a_blob_is_named_by_the_hash_of_its_chunks_hashes)
{
    /* By Python's hashlib: b = blake2b(digest_size=32); b(b(b"abc")) */
    uint8_t hash[BLOB_HASH_BYTES], hashes[3 * BLOB_HASH_BYTES], whole[BLOB_HASH_BYTES];
    char text[65];
    blob_hash(hash, (const uint8_t *)"abc", 3);
    print_hash(hash, text);
    assert_string_equal(text, "f6674caaed0b83eae0ae556b6c7d45a12463413a4822152989a0c78c9428f4f3");
    size_t bytes = 2 * BLOB_CHUNK_BYTES + 5;
    uint8_t *data = malloc(bytes);
    for (size_t i = 0; i < bytes; i++)
        data[i] = (uint8_t)(i * 7 + i / 999);
    for (size_t i = 0; i < 3; i++)
        blob_hash_chunk(hashes + i * BLOB_HASH_BYTES, data + i * BLOB_CHUNK_BYTES, i < 2 ? BLOB_CHUNK_BYTES : 5);
    blob_hash_chunks(hash, hashes, 3);
    blob_hash(whole, data, bytes);
    assert_memory_equal(hash, whole, BLOB_HASH_BYTES);
    free(data);
}

TEST(a_blob_that_arrives_grows_and_keeps_its_bytes)
{
    for (size_t size = 1; size < (size_t)9 << 20; size = size * 5 + 3) {
        struct blob *blob = blob_create_empty(size);
        assert_non_null(blob);
        assert_null(blob->data);
        size_t arrived = 0;
        while (arrived < size) {
            size_t piece = size - arrived < 100000 ? size - arrived : 100000;
            assert_true(blob_reserve(blob, arrived + piece));
            assert_int_equal((uintptr_t)blob->data % 64, 0);
            memset(blob->data + arrived, (int)(arrived / 100000), piece);
            arrived += piece;
        }
        for (size_t i = 0; i < size; i += 997)
            assert_int_equal(blob->data[i], (uint8_t)(i / 100000));
        assert_false(blob_reserve(blob, size + 1));
        blob_unref(blob_ref(blob));
        assert_int_equal(blob->data[size - 1], (uint8_t)((size - 1) / 100000));
        blob_unref(blob);
    }
    blob_unref(NULL);
    assert_null(blob_ref(NULL));
}
