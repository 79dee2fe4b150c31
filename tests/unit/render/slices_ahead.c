/* SPDX-License-Identifier: MIT */
/* How large the slices are that are queued on a GPU. */
#include "render/frame/slices_ahead.h"
#include "tests/harness/test.h"
#include "trace/step.h"

static uint32_t next_rays(uint32_t rays, uint64_t took_ns)
{
    return slices_ahead_next_rays((struct slice_cost){rays, took_ns}, 0, STEP_NS);
}

/* Whatever the device and the scene: a driver ends what takes seconds, and of the first slice nothing is known. */
TEST(the_first_slice_is_small_and_the_next_ones_grow_by_what_it_took)
{
    const struct slices_ahead unknown = {0};
    const uint32_t first = slices_ahead_rays(&unknown, 1u << 20);
    assert_int_equal(first, 1u << 14);
    assert_int_equal(slices_ahead_rays(&unknown, 1000), 1000);
    assert_int_equal(next_rays(first, 1000), 8 * first);    /* at most */
    assert_int_equal(next_rays(first, 1200000), 4 * first); /* about half a step */
    assert_int_equal(next_rays(first, 5000000), first);
}

TEST(a_slice_that_took_too_long_is_followed_by_one_that_fits)
{
    assert_int_equal(next_rays(1u << 20, 2 * STEP_NS), 1u << 19);
    assert_int_equal(next_rays(1u << 20, 30 * STEP_NS), 1u << 15);
    assert_int_equal(next_rays(1u << 20, 100000 * STEP_NS), 1u << 12); /* the least */
}

/* A device that takes so long for a slice of any size, and so long for a ray besides: what becomes of its slices.
 */
static struct slice_cost settled(uint64_t fixed_ns, double a_ray_ns, uint64_t *longest_ns)
{
    struct slices_ahead ahead = {0};
    struct slice_cost cost = {0};
    *longest_ns = 0;
    for (int i = 0; i < 40; i++) {
        const uint32_t rays = slices_ahead_rays(&ahead, 1u << 20);
        cost = (struct slice_cost){rays, fixed_ns + (uint64_t)(a_ray_ns * (double)rays)};
        slices_ahead_note(&ahead, cost, false, STEP_NS);
        if (cost.took_ns > *longest_ns)
            *longest_ns = cost.took_ns;
    }
    return cost;
}

/* Smaller slices would make a picture take longer and each of them no less: on a GPU nine waves of a small part of
 * a picture took two steps, so that slices became ever smaller and a frame took ten seconds in place of one. */
TEST(slices_do_not_shrink_for_what_a_slice_takes_anyway)
{
    const uint64_t fixed_ns[] = {0, 1000000, STEP_NS / 2, STEP_NS, 3 * STEP_NS, 10 * STEP_NS};
    const double a_ray_ns[] = {1, 10, 100, 1000};
    for (size_t i = 0; i < sizeof(fixed_ns) / sizeof(fixed_ns[0]); i++)
        for (size_t k = 0; k < sizeof(a_ray_ns) / sizeof(a_ray_ns[0]); k++) {
            uint64_t longest_ns;
            const struct slice_cost cost = settled(fixed_ns[i], a_ray_ns[k], &longest_ns);
            const double of_rays_ns = a_ray_ns[k] * cost.rays;
            const uint64_t wanted_ns = STEP_NS > 2 * fixed_ns[i] ? STEP_NS : 2 * fixed_ns[i];
            assert_true(cost.took_ns <= wanted_ns + wanted_ns / 100);
            /* Half of the device's time, or all rays that fit; sizes are powers of two, and a quarter is good
             * enough. */
            assert_true(cost.rays == 1u << 20 || of_rays_ns >= 0.24 * (double)(wanted_ns - fixed_ns[i]));
            /* The first slice aside, none is longer than twice what is wanted. */
            const uint64_t first_ns = fixed_ns[i] + (uint64_t)(a_ray_ns[k] * (1u << 14));
            assert_true(longest_ns <= (first_ns > 2 * wanted_ns ? first_ns : 2 * wanted_ns));
        }
}

TEST(the_rest_of_a_band_says_nothing_of_whole_slices)
{
    struct slices_ahead ahead = {0};
    for (int i = 0; i < 20; i++)
        slices_ahead_note(&ahead, (struct slice_cost){slices_ahead_rays(&ahead, 1u << 20), 3 * STEP_NS}, false,
                          STEP_NS);
    const uint32_t rays = slices_ahead_rays(&ahead, 1u << 20);
    assert_int_equal(rays, 1u << 20); /* rays cost nothing */
    slices_ahead_note(&ahead, (struct slice_cost){100, 3 * STEP_NS}, true, STEP_NS);
    assert_int_equal(slices_ahead_rays(&ahead, 1u << 20), rays);
}
