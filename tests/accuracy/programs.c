/* SPDX-License-Identifier: MIT */
/* Which programs frames have compiled: those that they need, each once. */
#include "gpu/program.h"
#include "gpu/program_ahead.h"
#include "protocol/tracers.h"
#include "tests/accuracy/render_fixture.h"
#include "tests/fixtures/frame_hooks.h"
#include "tests/harness/test.h"

#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static char home[] = "/tmp/farlight-programs-XXXXXX";

static int setup_cold(void **state)
{
    assert_non_null(mkdtemp(home));
    setenv("XDG_CACHE_HOME", home, 1);
    return fixture_setup(state);
}

static int teardown_cold(void **state)
{
    char command[128];
    fixture_teardown(state);
    snprintf(command, sizeof(command), "rm -r '%s'", home);
    return system(command);
}

ALL_TESTS(setup_cold, teardown_cold)
EACH_TEST(fixture_clear, NULL)

static size_t count_programs(void)
{
    struct gpu_program_stat stat;
    size_t count = 0;
    while (gpu_program_stat(device, count, &stat))
        count++;
    return count;
}

static const struct {
    unsigned tracer, integrator, depth;
} forms[] = {
    {TRACER_BVH, INTEGRATOR_WHITTED, 4}, {TRACER_BVH, INTEGRATOR_WHITTED, 0},
    {TRACER_BVH, INTEGRATOR_PATH, 4},    {TRACER_BVH, INTEGRATOR_DISTRIBUTED, 4},
    {TRACER_BVH, INTEGRATOR_AO, 1},      {TRACER_ABUFFER, INTEGRATOR_PATH, 4},
};
enum { FORMS_SHORT = 1 }; /* others add programs, not another way to announce them */

TEST(a_second_frame_compiles_nothing_and_no_program_that_no_frame_needs_is_compiled)
{
    struct fixture *fixture = *state;
    fixture_mixture(fixture);
    fixture->request.picture.width = fixture->request.picture.height = 128;
    const size_t count = getenv("FARLIGHT_TEST_LONG") ? sizeof(forms) / sizeof(forms[0]) : FORMS_SHORT;
    for (size_t i = 0; i < count; i++) {
        fixture->request.tracing.tracer = forms[i].tracer;
        fixture->request.light.integrator = forms[i].integrator;
        fixture->request.light.depth = forms[i].depth;
        fixture->request.sampling.samples = 1;
        struct frame_result first = fixture_render(fixture);
        const size_t after_first = count_programs();
        assert_int_equal(gpu_ahead_left(device->ahead), 0);
        struct frame_result second = fixture_render(fixture);
        frame_result_finish(&first);
        frame_result_finish(&second);
        assert_int_equal(count_programs(), after_first);
        assert_int_equal(gpu_ahead_left(device->ahead), 0);
    }
}

/* Programs that are announced, and compiled by the driver's threads, are those that the waves run: with
 * counts that only the device knows, and with a stopped slice. */
TEST(a_frame_on_a_gpu_compiles_no_program_that_it_does_not_need)
{
    struct fixture *fixture = *state;
    const struct gpu_facts facts = device->facts;
    fixture_mixture(fixture);
    fixture->request.tracing.tracer = TRACER_BVH;
    fixture->request.light.integrator = INTEGRATOR_WHITTED;
    fixture->request.light.depth = 4;
    gpu_facts_choose(&device->facts, false);
    device->facts.compiles_at_dispatch = false;
    frame_renderer_queue_ahead(fixture->renderer, true);
    struct frame_result result = fixture_render(fixture);
    frame_renderer_queue_ahead(fixture->renderer, !facts.software);
    const size_t left = gpu_ahead_left(device->ahead);
    device->facts = facts;
    frame_result_finish(&result);
    assert_int_equal(left, 0);
}
