/* SPDX-License-Identifier: MIT */
/* How large the slices are that are queued on a GPU. */
#include "render/slices_ahead.h"
#include "tests/harness/test.h"
#include "trace/step.h"

/* Whatever the device and the scene: a driver ends what takes seconds, and of the first slice nothing is known. */
TEST(the_first_slice_is_small_and_the_next_ones_grow_by_what_it_took)
{
    const struct slices_ahead unknown = {0};
    const uint32_t first = slices_ahead_rays(&unknown, 1u << 20);
    assert_int_equal(first, 1u << 14);
    assert_int_equal(slices_ahead_rays(&unknown, 1000), 1000);
    assert_int_equal(slices_ahead_next_rays(first, 1000, STEP_NS), 8 * first);    /* at most */
    assert_int_equal(slices_ahead_next_rays(first, 1200000, STEP_NS), 4 * first); /* about half a step */
    assert_int_equal(slices_ahead_next_rays(first, 5000000, STEP_NS), first);
}

TEST(a_slice_that_took_too_long_is_followed_by_one_that_fits)
{
    assert_int_equal(slices_ahead_next_rays(1u << 20, 2 * STEP_NS, STEP_NS), 1u << 19);
    assert_int_equal(slices_ahead_next_rays(1u << 20, 30 * STEP_NS, STEP_NS), 1u << 15);
    assert_int_equal(slices_ahead_next_rays(1u << 20, 100000 * STEP_NS, STEP_NS), 1u << 12); /* the least */
}
