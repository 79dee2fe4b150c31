/* SPDX-License-Identifier: MIT */
/* Several frames of one scene at the same time: what may go on beside others, and what waits for whom. */
#include "tests/unit/engine/engine_fake.h"
#include "tests/harness/test.h"

EACH_TEST(start_engine, stop_engine)

/* A job of one frame, whose steps have the number of the request. */
static struct engine_command *still(uint32_t request, uint32_t steps, uint32_t depth)
{
    struct engine_command *made = render(1, request, 0, 0);
    made->job.frame.sampling.samples = steps;
    made->job.frame.sampling.seed = request;
    made->job.frame.light.depth = depth;
    return made;
}

static int steps_of(uint32_t request)
{
    int count = 0;
    for (int i = 0; i < atomic_load(&fake.step_count) && i < STEPS_MAX; i++)
        count += fake.step_seeds[i] == request;
    return count;
}

/* Answers of jobs of one frame each, and of commits; in any order. */
static void expect_answers(const uint32_t *requests, size_t count)
{
    bool seen[16] = {false};
    for (size_t left = count; left > 0;) {
        struct engine_event *event = next_event();
        size_t i = 0;
        while (i < count && requests[i] != event->request)
            i++;
        assert_true(i < count && !seen[i]);
        if (event->kind != ENGINE_FRAME) {
            assert_int_equal(event->kind, ENGINE_DONE);
            seen[i] = true;
            left--;
        }
        engine_event_destroy(event);
    }
}

TEST(frames_of_one_scene_take_turns_by_slices)
{
    clock_stop();
    atomic_store(&fake.holds_steps, true); /* until all are there */
    open_scene(1, 1);
    for (uint32_t request = 2; request <= 4; request++) {
        struct engine_command *made = still(request, 100, 0);
        made->job.frame.light.ao_rays = 1000;
        submit(made);
    }
    atomic_store(&fake.holds_steps, false);
    wait_until(&fake.frames_begun, 3);
    assert_int_equal(atomic_load(&fake.scenes), 1); /* they share it */
    expect_answers((const uint32_t[]){2, 3, 4}, 3);
    expect_shares(2, 1, 3, 1);
    expect_shares(2, 1, 4, 1);
}

TEST(an_edit_waits_for_all_frames_and_lets_none_begin)
{
    open_scene(1, 1);
    submit(still(2, 1, GATED_DEPTH));
    submit(still(3, 1, GATED_DEPTH));
    wait_until(&fake.frames_begun, 2);
    /* Beside a long frame others come and go. */
    submit(still(4, 3, 0));
    take_frame(1, 4, 0);
    expect_done(1, 4);
    struct engine_command *many = render(1, 5, 0, 9);
    many->job.credit = 1;
    submit(many);
    take_frame(1, 5, 0);
    expect_silence(); /* the maximum number in flight is rendered */
    int begun = atomic_load(&fake.frames_begun);
    submit_commit(1, 6, 1);
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 5, 3);
    take_frame(1, 5, 1);
    take_frame(1, 5, 2);
    atomic_store(&fake.gate_seed, 2);
    take_frame(1, 2, 0);
    expect_done(1, 2);
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), begun);
    atomic_store(&fake.gate_open, true);
    bool applied = false, rendered = false;
    while (!applied || !rendered) {
        struct engine_event *event = next_event();
        if (event->request == 6)
            applied = true;
        else
            assert_int_equal(event->request, 3);
        if (event->kind == ENGINE_FRAME)
            assert_int_equal(event->frame->result.revision, 0);
        rendered |= event->kind == ENGINE_DONE && event->request == 3;
        engine_event_destroy(event);
    }
    submit_target(ENGINE_JOB_CREDIT, 1, 0, 5, 100);
    for (uint32_t frame = 3; frame <= 9; frame++) {
        struct engine_event *event = expect_frame(1, 5, frame);
        /* Those that were rendered before it are on their way still. */
        assert_int_equal(event->frame->result.revision, frame > 3);
        engine_event_destroy(event);
    }
    expect_done(1, 5);
}

TEST(a_frame_that_changes_what_is_shared_is_alone_and_not_overtaken)
{
    open_scene(1, 1);
    submit(still(2, 20, GATED_DEPTH));
    submit(still(3, 20, GATED_DEPTH));
    wait_until(&fake.frames_begun, 2);
    submit(still(4, 20, CHANGING_DEPTH));
    expect_silence(); /* the frame is postponed */
    submit(still(5, 20, 0));
    submit(still(6, 20, 0));
    expect_silence();
    assert_int_equal(atomic_load(&fake.frames_begun), 2);
    atomic_store(&fake.step_count, 0);
    atomic_store(&fake.gate_open, true);
    expect_answers((const uint32_t[]){2, 3, 4, 5, 6}, 5);
    /* 2 and 3 together, then 4 alone, then, as it has to be changed back, 5 or 6 as the first of the others. */
    for (int i = 0; i < 40; i++)
        assert_in_range(fake.step_seeds[i], 2, 3);
    for (int i = 40; i < 60; i++)
        assert_int_equal(fake.step_seeds[i], 4);
    assert_int_equal(atomic_load(&fake.step_count), 100);
    assert_int_equal(steps_of(5), 20);
}

TEST(a_postponed_frame_that_is_cancelled_delays_no_client)
{
    open_scene(1, 1);
    submit(still(2, 20, GATED_DEPTH));
    wait_until(&fake.frames_begun, 1);
    submit(still(4, 20, CHANGING_DEPTH));
    expect_silence();
    submit(still(5, 20, 0));
    expect_silence();
    submit_target(ENGINE_JOB_CANCEL, 1, 6, 4, 0);
    expect_failed(1, 4, ERROR_CANCELLED, "");
    expect_done(1, 6);
    take_frame(1, 5, 0);
    expect_done(1, 5);
    atomic_store(&fake.gate_open, true);
    take_frame(1, 2, 0);
    expect_done(1, 2);
}

TEST(a_lost_device_loses_all_frames_of_a_scene_and_all_are_rendered_again)
{
    open_scene(1, 1);
    for (uint32_t request = 2; request <= 3; request++)
        submit(still(request, 20, GATED_DEPTH));
    wait_until(&fake.frames_begun, 2);
    submit(still(4, 20, CHANGING_DEPTH));
    expect_silence();
    atomic_store(&fake.fail_kind, ERROR_DEVICE_LOST);
    atomic_store(&fake.fail_steps, 1);
    wait_until(&fake.devices_made, 2);
    atomic_store(&fake.gate_open, true);
    expect_answers((const uint32_t[]){2, 3, 4}, 3);
}

TEST(the_renderer_of_a_clients_job_serves_its_next_job)
{
    open_scene(1, 1);
    for (uint32_t request = 2; request <= 4; request++) {
        submit(still(request, 1, 0));
        take_frame(1, request, 0);
        expect_done(1, request);
        assert_int_equal(atomic_load(&fake.renderers), 1);
    }
    assert_int_equal(atomic_load(&fake.renderers_made), 1);
    /* Jobs at the same time leave one renderer. */
    for (uint32_t request = 5; request <= 6; request++)
        submit(still(request, 10, GATED_DEPTH));
    wait_until(&fake.frames_begun, 5);
    assert_int_equal(atomic_load(&fake.renderers), 2);
    atomic_store(&fake.gate_open, true);
    expect_answers((const uint32_t[]){5, 6}, 2);
    submit(still(7, 1, 0));
    take_frame(1, 7, 0);
    expect_done(1, 7);
    assert_int_equal(atomic_load(&fake.renderers), 1);
    assert_int_equal(atomic_load(&fake.renderers_made), 2);
}
