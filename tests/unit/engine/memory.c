/* SPDX-License-Identifier: MIT */
/* The device's memory among owners, with frames that take as much of it as the tests say: of 100,000 bytes an
 * owner may have 75,000 while others render. Client n belongs to owner 100 n. */
#include "tests/unit/engine/engine_fake.h"

#include "engine/engine_private.h"
#include "tests/harness/test.h"

#define LIMIT_BYTES 100000

static int begin(void **state)
{
    (void)state;
    start((struct engine_options){.device_bytes_limit = LIMIT_BYTES, .limits = {.device_share_percent = 75}});
    atomic_store(&fake.takes_memory, true);
    for (uint64_t client = 1; client <= 3; client++) {
        struct engine_command *made = command(ENGINE_SCENE_OPEN, client, 1);
        made->owner = 100 * client;
        submit(made);
        expect_done(client, 1);
    }
    return 0;
}

EACH_TEST(begin, stop_engine)

static struct engine_command *taking(uint64_t client, uint32_t request, uint64_t bytes)
{
    struct engine_command *made = render(client, request, 0, 0);
    made->job.frame.width = 1000;
    made->job.frame.height = (uint32_t)(bytes / 1000);
    return made;
}

/* Until the gate is opened, what is begun goes on. */
static void submit_lasting(uint64_t client, uint32_t request, uint64_t bytes)
{
    submit(gated(taking(client, request, bytes)));
}

static void open_gate(unsigned jobs)
{
    atomic_store(&fake.gate_open, true);
    for (unsigned i = 0; i < 2 * jobs; i++) { /* a frame and an answer each */
        struct engine_event *event = next_event();
        assert_true(event->kind == ENGINE_FRAME || event->kind == ENGINE_DONE);
        engine_event_destroy(event);
    }
}

TEST(frames_of_one_owner_leave_memory_for_those_of_others)
{
    submit_lasting(2, 20, 1000);
    for (uint32_t request = 10; request < 13; request++)
        submit_lasting(1, request, 30000);
    wait_until(&fake.frames_begun, 3);
    expect_silence(); /* the third one waits, though memory is left */
    submit(taking(2, 21, 30000));
    take_frame(2, 21, 0);
    expect_done(2, 21);
    assert_int_equal(atomic_load(&fake.frames_abandoned), 0);
    open_gate(4);
}

TEST(an_owner_who_is_alone_has_all_the_memory)
{
    submit(taking(1, 10, 99000));
    take_frame(1, 10, 0);
    expect_done(1, 10);
}

TEST(a_frame_beyond_the_share_of_its_owner_is_refused_for_now_while_others_render)
{
    submit_lasting(2, 20, 1000);
    wait_until(&fake.frames_begun, 1);
    submit(taking(1, 10, 80000));
    struct engine_event *event = expect_event(ENGINE_FAILED, 1, 10);
    assert_int_equal(event->error.kind, ERROR_OUT_OF_MEMORY);
    assert_true(event->error.retryable);
    assert_non_null(strstr(event->error.remedy, "limits.share"));
    engine_event_destroy(event);
    open_gate(1);
}

TEST(frames_beyond_the_share_of_their_owner_are_given_up_for_a_newcomer)
{
    submit_lasting(1, 10, 40000);
    submit_lasting(1, 11, 40000);
    wait_until(&fake.frames_begun, 2);
    submit(taking(2, 20, 30000));
    take_frame(2, 20, 0);
    expect_done(2, 20);
    assert_int_equal(atomic_load(&fake.frames_abandoned), 1);
    open_gate(2); /* it is rendered again */
}

/* Two owners within their shares have no memory for both their frames: the later one waits, and a third one, who
 * only looks, does not wait with it. */
TEST(views_go_on_while_batches_wait_for_memory)
{
    submit_lasting(1, 10, 50000);
    wait_until(&fake.frames_begun, 1);
    submit(taking(2, 20, 60000));
    expect_silence();
    struct view_wishes *wishes = view_wishes_create();
    struct engine_command *view = render(3, 30, 0, UINT32_MAX);
    view->job.pass_samples = 1;
    view->job.kind = JOB_VIEW;
    view->job.still_encoding = ENCODING_RAW;
    view->job.wishes = view_wishes_ref(wishes);
    submit(view);
    const struct view_camera camera = {.command = 7,
                                       .key = {.eye_world = {0, 0, 5}, .up_world = {0, 1, 0}, .fov_y = 1}};
    assert_true(view_wishes_look(wishes, &camera));
    submit(command(ENGINE_VIEW_LOOK, 3, 0));
    engine_event_destroy(expect_event(ENGINE_FRAME, 3, 30));
    submit_target(ENGINE_JOB_CANCEL, 3, 31, 30, 0);
    for (int i = 0; i < 2; i++)
        engine_event_destroy(next_event());
    open_gate(2);
    view_wishes_unref(wishes);
}
