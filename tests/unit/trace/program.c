/* SPDX-License-Identifier: MIT */
/* How many rays a dispatch has, by what they can take at most. */
#include "trace/program.h"

#include "tests/harness/test.h"

ALL_TESTS(NULL, NULL)

TEST(rays_that_may_take_long_go_in_small_dispatches)
{
    struct gpu_device hardware = {0}, software = {0};
    gpu_facts_choose(&hardware.facts, false);
    gpu_facts_choose(&software.facts, true);
    assert_int_equal(trace_rays_a_dispatch(&software, UINT64_MAX / 2), 0);
    /* Structures as they are usual fill any GPU. */
    assert_in_range(trace_rays_a_dispatch(&hardware, 0), 1u << 17, 1u << 18);
    assert_in_range(trace_rays_a_dispatch(&hardware, 1u << 17), 1u << 17, 1u << 18);
    for (uint64_t rounds = 1; rounds < (uint64_t)1 << 40; rounds *= 3) {
        const uint32_t rays = trace_rays_a_dispatch(&hardware, rounds);
        assert_int_equal(rays % 192, 0); /* a multiple of all packets' sizes */
        assert_true(rays == 192 || rays * rounds <= (uint64_t)1 << 35);
    }
}
