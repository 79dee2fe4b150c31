/* SPDX-License-Identifier: MIT */
/* Frames of several clients that lack memory beside each other, of 100,000 bytes. */
#include "tests/unit/engine/engine_fake.h"

#include "engine/engine_private.h"
#include "tests/harness/test.h"

#define LIMIT_BYTES 100000

static int begin(void **state)
{
    (void)state;
    start((struct engine_options){.device_bytes_limit = LIMIT_BYTES});
    atomic_store(&fake.takes_memory, true);
    for (uint64_t client = 1; client <= 3; client++) {
        submit(command(ENGINE_SCENE_OPEN, client, 1));
        expect_done(client, 1);
    }
    return 0;
}

EACH_TEST(begin, stop_engine)

static struct engine_command *taking(uint64_t client, uint32_t request, uint64_t bytes)
{
    struct engine_command *made = render(client, request, 0, 0);
    made->job.frame.picture.width = 1000;
    made->job.frame.picture.height = (uint32_t)(bytes / 1000);
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

/* There is no memory for both frames: the later one waits, and a view does not wait with it. */
TEST(views_go_on_while_batches_wait_for_memory)
{
    submit_lasting(1, 10, 50000);
    wait_until(&fake.frames_begun, 1);
    submit(taking(2, 20, 60000));
    expect_silence();
    struct view_mailbox *mailbox = view_mailbox_create();
    struct engine_command *view = render(3, 30, 0, UINT32_MAX);
    view->job.view.pass_samples = 1;
    view->job.kind = JOB_VIEW;
    view->job.view.still_encoding = ENCODING_RAW;
    view->job.mailbox = view_mailbox_ref(mailbox);
    submit(view);
    const struct view_camera camera = {.command = 7,
                                       .key = {.eye_world = {0, 0, 5}, .up_world = {0, 1, 0}, .fov_y = 1}};
    assert_true(view_mailbox_set_camera(mailbox, &camera));
    submit(command(ENGINE_VIEW_CHANGED, 3, 0));
    engine_event_destroy(expect_event(ENGINE_FRAME, 3, 30));
    submit_target(ENGINE_JOB_CANCEL, 3, 31, 30, 0);
    for (int i = 0; i < 2; i++)
        engine_event_destroy(next_event());
    open_gate(2);
    view_mailbox_unref(mailbox);
}
