/* SPDX-License-Identifier: MIT */
/* base/prefault: memory prefaulted by a background thread. */
#include <stddef.h>
#include <stdint.h>

#include "base/allocator.h"
#include "base/clock.h"
#include "base/prefault.h"
#include "tests/harness/test.h"

#include <sched.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>

#define BLOCK_BYTES ((size_t)64 << 20)
#define LONG_NS UINT64_C(60000000000)

static long faults_of_this_thread(void)
{
    struct rusage usage;
    getrusage(RUSAGE_THREAD, &usage);
    return usage.ru_minflt;
}

TEST(a_block_that_was_prefaulted_is_filled_without_faults)
{
    if (!allocator_keeps_pages()) {
        print_message("SKIP: sanitizers have an allocator of their own\n");
        skip();
    }
    struct prefault *prefault = prefault_create();
    assert_non_null(prefault);
    assert_true(prefault_is_ready(prefault, BLOCK_BYTES, clock_now_ns() + LONG_NS));
    long before = faults_of_this_thread();
    void *block = malloc(BLOCK_BYTES);
    assert_non_null(block);
    memset(block, 1, BLOCK_BYTES);
    /* The block has 16,384 pages, or 32 huge ones; a few of the allocator's own may be new. */
    assert_in_range(faults_of_this_thread() - before, 0, 8);
    free(block);
    prefault_destroy(prefault);
}

TEST(what_is_not_ready_is_put_off_and_ready_later)
{
    struct prefault *prefault = prefault_create();
    assert_non_null(prefault);
    assert_false(prefault_is_ready(prefault, BLOCK_BYTES, 0));
    while (prefault_goes_on(prefault, BLOCK_BYTES))
        sched_yield();
    assert_true(prefault_is_ready(prefault, BLOCK_BYTES, 0));
    assert_false(prefault_goes_on(prefault, BLOCK_BYTES));
    assert_false(prefault_is_ready(prefault, BLOCK_BYTES, 0)); /* each block serves one reservation */
    prefault_destroy(prefault);                                /* also with an unfinished block */
}

TEST(a_small_block_does_not_wait_for_a_large_one)
{
    struct prefault *prefault = prefault_create();
    assert_non_null(prefault);
    assert_false(prefault_is_ready(prefault, PREFAULT_BYTES_MAX / 2, 0));
    assert_false(prefault_is_ready(prefault, PREFAULT_BYTES_MIN, 0));
    while (prefault_goes_on(prefault, PREFAULT_BYTES_MAX / 2))
        sched_yield();
    assert_false(prefault_goes_on(prefault, PREFAULT_BYTES_MIN));
    prefault_destroy(prefault);
}

TEST(what_is_not_worth_it_or_too_much_does_not_wait)
{
    struct prefault *prefault = prefault_create();
    assert_non_null(prefault);
    assert_true(prefault_is_ready(NULL, BLOCK_BYTES, 0));
    assert_true(prefault_is_ready(prefault, PREFAULT_BYTES_MIN - 1, 0));
    assert_true(prefault_is_ready(prefault, PREFAULT_BYTES_MAX + 1, 0));
    assert_false(prefault_is_ready(prefault, PREFAULT_BYTES_MAX, 0));
    assert_true(prefault_is_ready(prefault, BLOCK_BYTES, 0)); /* together they would be too much */
    prefault_destroy(prefault);
}
