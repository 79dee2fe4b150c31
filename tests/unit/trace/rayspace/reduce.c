/* SPDX-License-Identifier: MIT */
/* That a stream is reduced by segments, and by a geometry shader, to what is not empty in it: nothing is lost,
 * nothing comes twice, and what has no room leaves no trace. */
#include "trace/rayspace/reduce.h"

#include "tests/accuracy/test_scenes.h"
#include "tests/fixtures/device.h"
#include "tests/harness/test.h"

#include <stdlib.h>
#include <string.h>

ALL_TESTS(open_device, close_device)

#define WAITING 7u /* pairs that are on the stack before */
#define LEAVES 3u
#define PUT_OFF 2u
#define PASS_GROUP (64u * RAYSPACE_CHUNK)

static const enum rayspace_reduce ways[] = {RAYSPACE_REDUCE_SEGMENTS, RAYSPACE_REDUCE_GEOMETRY};
#define WAYS (sizeof(ways) / sizeof(ways[0]))

struct pair {
    uint32_t words[4];
};

struct stream {
    struct rayspace_control control;
    uint32_t slot_count, pair_count, leaf_count, far_count;
    struct pair *slots, *pairs, *leaves, *far; /* as they come, and what is to be left of them */
};

/* Of the pass of so many pairs: `share` of 16 slots are kept, every third of these a leaf, a third put off. */
static void stream_init(struct stream *stream, uint32_t taken, uint32_t share)
{
    uint64_t seed = taken;
    const uint32_t slots = ((taken - 1) / RAYSPACE_CHUNK + 1) * RAYSPACE_CHUNK_SLOTS;
    *stream = (struct stream){.slot_count = slots,
                              .slots = calloc(slots, sizeof(struct pair)),
                              .pairs = calloc(slots, sizeof(struct pair)),
                              .leaves = calloc(slots, sizeof(struct pair)),
                              .far = calloc(slots, sizeof(struct pair))};
    for (uint32_t i = 0; i < slots; i++) {
        const bool kept = test_random(&seed) % 16 < share;
        const uint32_t kind = test_random(&seed) % 3;
        const bool leaf = kind == 0, far = kind == 1;
        const uint32_t last = !kept  ? RAYSPACE_SLOT_EMPTY
                              : leaf ? RAYSPACE_SLOT_LEAF
                              : far  ? RAYSPACE_AGAIN | i % 5
                                     : i % 5;
        stream->slots[i] = (struct pair){{i, i + 1, i + 2, last}};
        if (kept && leaf)
            stream->leaves[stream->leaf_count++] = stream->slots[i];
        else if (kept && far)
            stream->far[stream->far_count++] = stream->slots[i];
        else if (kept)
            stream->pairs[stream->pair_count++] = stream->slots[i];
    }
    stream->control = (struct rayspace_control){
        .taken = taken,
        .waiting_0 = WAITING,
        .waiting_2 = PUT_OFF,
        .leaves = LEAVES,
        .room = stream->pair_count,
        .leaves_room = stream->leaf_count,
        .put_off_room = stream->far_count,
        .pass_groups_x = (taken - 1) / PASS_GROUP + 1,
        .pass_groups_y = 1,
        .pass_groups_z = 1,
    };
}

static void stream_finish(struct stream *stream)
{
    free(stream->slots);
    free(stream->pairs);
    free(stream->leaves);
    free(stream->far);
}

/* What lies in a list behind the pairs that were in it is `expected`, and nothing else was touched. */
static void expect_list(const struct gpu_buffer *list, uint32_t before, const struct pair *expected,
                        uint32_t count, uint32_t slot_count)
{
    struct pair *found = calloc(before + slot_count, sizeof(*found)), untouched;
    memset(&untouched, 0xab, sizeof(untouched));
    gpu_buffer_read(device, list, 0, found, (before + slot_count) * sizeof(*found));
    for (uint32_t i = 0; i < before; i++)
        assert_memory_equal(&found[i], &untouched, sizeof(untouched));
    if (count > 0)
        assert_memory_equal(found + before, expected, count * sizeof(*expected));
    for (uint32_t i = before + count; i < before + slot_count; i++)
        assert_memory_equal(&found[i], &untouched, sizeof(untouched));
    free(found);
}

static void reduce(struct rayspace_reduction *reduction, enum rayspace_reduce way, struct stream *stream,
                   bool is_to_fit)
{
    struct gpu_buffer control = {0}, pairs = {0}, leaves = {0}, far = {0};
    const struct rayspace_lists lists = {
        .control = &control, .pairs = &pairs, .leaves = &leaves, .put_off = &far, .to = 0, .later = 2};
    const size_t bytes = (stream->slot_count + WAITING + LEAVES) * sizeof(struct pair);
    struct error error = {0};
    assert_true(rayspace_reduction_reserve(device, reduction, way, stream->control.taken, &error));
    gpu_buffer_write(device, &reduction->slots, 0, stream->slots, stream->slot_count * sizeof(struct pair));
    assert_true(gpu_buffer_upload(device, &control, &stream->control, sizeof(stream->control), &error));
    assert_true(gpu_buffer_reserve(device, &pairs, bytes, &error));
    assert_true(gpu_buffer_reserve(device, &leaves, bytes, &error));
    assert_true(gpu_buffer_reserve(device, &far, bytes, &error));
    gpu_buffer_clear(device, &pairs, 0xabababab);
    gpu_buffer_clear(device, &leaves, 0xabababab);
    gpu_buffer_clear(device, &far, 0xabababab);
    if (!rayspace_reduction_run(device, reduction, &lists, &error))
        fail_msg("%s: %s", error.field, error.text);
    struct rayspace_control told;
    gpu_buffer_read(device, &control, 0, &told, sizeof(told));
    assert_int_equal(told.written, stream->pair_count);
    assert_int_equal(told.leaves_written, stream->leaf_count);
    assert_int_equal(told.put_off, stream->far_count);
    expect_list(&pairs, WAITING, stream->pairs, is_to_fit ? stream->pair_count : 0, stream->slot_count);
    expect_list(&leaves, LEAVES, stream->leaves, is_to_fit ? stream->leaf_count : 0, stream->slot_count);
    expect_list(&far, PUT_OFF, stream->far, is_to_fit ? stream->far_count : 0, stream->slot_count);
    gpu_buffer_finish(device, &control);
    gpu_buffer_finish(device, &pairs);
    gpu_buffer_finish(device, &leaves);
    gpu_buffer_finish(device, &far);
}

TEST(what_is_not_empty_is_left_in_its_order)
{
    static const uint32_t sizes[] = {1, 4, 5, 63, 256, 257, 5000}, shares[] = {0, 1, 5, 16};
    struct rayspace_reduction reduction = {0};
    for (size_t way = 0; way < WAYS; way++) {
        for (size_t size = 0; size < sizeof(sizes) / sizeof(sizes[0]); size++) {
            for (size_t share = 0; share < sizeof(shares) / sizeof(shares[0]); share++) {
                struct stream stream;
                stream_init(&stream, sizes[size], shares[share]);
                reduce(&reduction, ways[way], &stream, true);
                stream_finish(&stream);
            }
        }
    }
    rayspace_reduction_finish(device, &reduction);
}

TEST(what_one_list_has_no_room_for_goes_to_neither)
{
    struct rayspace_reduction reduction = {0};
    for (size_t way = 0; way < WAYS; way++) {
        struct stream stream;
        stream_init(&stream, 1000, 8);
        stream.control.room--;
        reduce(&reduction, ways[way], &stream, false);
        stream.control.room++;
        stream.control.leaves_room--;
        reduce(&reduction, ways[way], &stream, false);
        stream.control.leaves_room++;
        stream.control.put_off_room--;
        reduce(&reduction, ways[way], &stream, false);
        stream_finish(&stream);
    }
    rayspace_reduction_finish(device, &reduction);
}
