/* SPDX-License-Identifier: MIT */
/* The number of lights that the hits of a slice ask. */
#include "render/frame/choices.h"

#include "tests/harness/test.h"

ALL_TESTS(NULL, NULL)

TEST(hits_of_a_slice_look_at_a_bounded_number_of_lights)
{
    for (int software = 0; software < 2; software++) {
        struct gpu_device device = {0};
        gpu_facts_choose(&device.facts, software);
        device.facts.texture_buffer_texels_max = 1u << 27;
        const uint32_t usual = choices_slice_rays(&device, false, 1);
        assert_int_equal(choices_slice_rays(&device, false, 500), usual);
        for (uint32_t lights = 1; lights < 1u << 24; lights *= 3) {
            const uint32_t rays = choices_slice_rays(&device, false, lights);
            assert_true(rays == 64 || (uint64_t)rays * lights <= device.facts.list_tests_max);
            assert_true(rays == usual || (uint64_t)rays * lights > device.facts.list_tests_max / 2 - 1);
        }
    }
}
