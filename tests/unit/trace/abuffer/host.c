/* SPDX-License-Identifier: MIT */
/* What the host draws and sorts (software GL) is what the passes of a GPU leave. */
#include "tests/unit/trace/abuffer/fixture.h"
#include "tests/unit/trace/abuffer/scenes.h"
#include "tests/unit/trace/stack_scene.h"

#include "tests/harness/test.h"

#define RESOLUTION 72u
#define VOXELS 16u

static void build_by(struct fixture *fixture, struct contents *contents, bool on_device, bool in_steps)
{
    struct error error = {0};
    enum tracer_progress progress;
    const bool builds_on_host = device->facts.builds_on_host;
    device->facts.builds_on_host = builds_on_host && !on_device;
    place(fixture, RESOLUTION, VOXELS);
    expect_ok(abuffer_build_begin(fixture->builder, &fixture->store, &fixture->gpu, fixture->instances,
                                  fixture->instance_count, &fixture->options, &error),
              &error);
    do {
        progress = abuffer_build_step(fixture->builder, in_steps ? 0 : STEP_WITHOUT_END, &error);
    } while (progress == TRACER_MORE);
    device->facts.builds_on_host = builds_on_host;
    expect_ok(progress == TRACER_DONE, &error);
    contents_read(contents, &fixture->store);
    expect_consistent(contents);
}

static struct scene *too_many_for_a_device(void)
{
    return stack_scene(ABUFFER_LIST_MAX + 1, SHUFFLED, false);
}

ALL_TESTS(open_device, close_device)

/* The host's arithmetic is llvmpipe's. Other drivers add the three parts of a depth in another order, or round a
 * product and a sum once. Each part may be some times the resolution, and each of three roundings is half a unit
 * of its 24 bits: 2^-24 * 3 * 72 is 1.3e-5 cells. */
#define DEPTHS_WITHIN_ELSEWHERE 1e-4f

TEST_LONG(host_and_device_make_the_same_runs)
{
    const float within = strncmp(device->info.name, "llvmpipe", 8) == 0 ? 0.0f : DEPTHS_WITHIN_ELSEWHERE;
    struct scene *(*const scenes[])(void) = {scene_of_bodies_and_others, test_scene_translucent,
                                             too_many_for_a_device};
    for (size_t i = 0; i < sizeof(scenes) / sizeof(scenes[0]); i++)
        for (unsigned form = TRACER_FORM_FAST; form <= TRACER_FORM_PAPER; form++) {
            struct fixture fixture;
            struct contents by_host, by_device;
            fixture_init(&fixture, scenes[i]());
            fixture.options.abuffer.form = form;
            build_by(&fixture, &by_host, false, true);
            assert_in_range(by_host.store.sample_count, 1000, UINT32_MAX);
            build_by(&fixture, &by_device, true, false);
            expect_same_within(&by_host, &by_device, within);
            contents_free(&by_device);
            contents_free(&by_host);
            fixture_finish(&fixture);
        }
}
