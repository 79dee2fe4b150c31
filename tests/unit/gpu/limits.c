/* SPDX-License-Identifier: MIT */
/* Drivers' statements about their limits and their memory: made answers, and what follows from them. */
#include <stddef.h>
#include <stdint.h>

#include "gpu/limits.h"
#include "gpu/memory.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <string.h>

#define MIB ((uint64_t)1 << 20)
#define GIB ((uint64_t)1 << 30)

static void fill_needed(uint64_t values[GPU_LIMIT_COUNT])
{
    for (int i = 0; i < GPU_LIMIT_COUNT; i++)
        values[i] = gpu_limit_rows[i].needed;
}

TEST(a_device_that_has_what_is_needed_and_no_more_is_taken)
{
    uint64_t values[GPU_LIMIT_COUNT];
    struct error error = {0};
    fill_needed(values);
    assert_true(gpu_limits_check(values, &error));
    assert_string_equal(error.text, "");
}

TEST(each_limit_that_falls_short_is_named_with_its_value_and_the_need)
{
    for (int i = 0; i < GPU_LIMIT_COUNT; i++) {
        uint64_t values[GPU_LIMIT_COUNT];
        struct error error = {0};
        char value[32], needed[32];
        fill_needed(values);
        values[i]--;
        snprintf(value, sizeof(value), "has %llu ", (unsigned long long)values[i]);
        snprintf(needed, sizeof(needed), "; %llu are needed", (unsigned long long)gpu_limit_rows[i].needed);
        assert_false(gpu_limits_check(values, &error));
        assert_int_equal(error.kind, ERROR_UNSUPPORTED);
        assert_non_null(strstr(error.text, gpu_limit_rows[i].name));
        assert_non_null(strstr(error.text, value));
        assert_non_null(strstr(error.text, needed));
        assert_non_null(strstr(error.remedy, "--list-devices"));
    }
}

TEST(a_device_that_has_what_opengl_promises_and_no_more_is_taken)
{
    uint64_t values[GPU_LIMIT_COUNT];
    struct error error = {0};
    for (int i = 0; i < GPU_LIMIT_COUNT; i++)
        values[i] = gpu_limit_rows[i].promised;
    if (!gpu_limits_check(values, &error))
        fail_msg("%s", error.text);
}

TEST(memory_is_what_the_driver_tells_best_and_a_careful_part_of_it_is_used)
{
    static const struct {
        const char *driver;
        struct gpu_memory_answers answers;
        struct gpu_memory memory;
        uint64_t limit;
    } rows[] = {
        {"llvmpipe", {true, 32 * GIB, 0, 0}, {GPU_MEMORY_HOST, 32 * GIB}, 32 * GIB / 100 * 25},
        {"zink on lavapipe, which tells a constant",
         {true, 32 * GIB, 2 * GIB, 2 * GIB},
         {GPU_MEMORY_HOST, 32 * GIB},
         32 * GIB / 100 * 25},
        {"NVIDIA, the total", {false, 128 * GIB, 80 * GIB, 0}, {GPU_MEMORY_TOTAL, 80 * GIB}, 80 * GIB / 100 * 70},
        {"radeonsi, both",
         {false, 64 * GIB, 16 * GIB, 15 * GIB},
         {GPU_MEMORY_TOTAL, 16 * GIB},
         16 * GIB / 100 * 70},
        {"AMD, what is free", {false, 64 * GIB, 0, 8 * GIB}, {GPU_MEMORY_FREE, 8 * GIB}, 8 * GIB / 100 * 85},
        {"one that tells nothing", {false, 64 * GIB, 0, 0}, {GPU_MEMORY_UNTOLD, 0}, 2 * GIB},
        {"the same in a small machine", {false, 4 * GIB, 0, 0}, {GPU_MEMORY_UNTOLD, 0}, GIB},
    };
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        const struct gpu_memory memory = gpu_memory_from(&rows[i].answers);
        const uint64_t limit = gpu_memory_default_limit(&memory, rows[i].answers.host_bytes);
        if (memory.source != rows[i].memory.source || memory.bytes != rows[i].memory.bytes)
            fail_msg("%s: %llu MiB, %s", rows[i].driver, (unsigned long long)(memory.bytes / MIB),
                     gpu_memory_source_text(memory.source));
        if (limit != rows[i].limit)
            fail_msg("%s: a limit of %llu MiB, expected %llu", rows[i].driver, (unsigned long long)(limit / MIB),
                     (unsigned long long)(rows[i].limit / MIB));
    }
}
