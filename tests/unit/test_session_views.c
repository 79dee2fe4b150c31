/* SPDX-License-Identifier: MIT */
/* Views as a session serves them, with an engine that keeps what it is told for the test to see, and says what the
 * test has it say. */
#include "session_fixture.h"

#include "base/clock.h"
#include "base/queue.h"
#include "job/view_wishes.h"

#define CHANNEL 5u
#define FRAME_BYTES ((size_t)300001) /* two pieces, the last of odd size */

/* ---- an engine --------------------------------------------------------------------------------------- */

static struct {
    struct queue *events, *commands;
    atomic_uint gone;
} engine;

static void say(enum engine_event_kind kind, uint32_t request, enum error_kind error)
{
    struct engine_event *made = calloc(1, sizeof *made);
    assert_non_null(made);
    made->kind = kind;
    made->client = 1;
    made->request = request;
    if (error)
        error_set(&made->error, error, "fake", "as the test wants");
    assert_true(queue_push(engine.events, made));
}

static bool submit(void *context, struct engine_command *command, struct error *error)
{
    (void)context, (void)error;
    switch (command->kind) {
    case ENGINE_SCENE_OPEN:
        say(ENGINE_DONE, command->request, ERROR_NONE);
        engine_command_destroy(command);
        return true;
    case ENGINE_CLIENT_GONE:
        atomic_fetch_add(&engine.gone, 1);
        say(ENGINE_CLIENT_FORGOTTEN, 0, ERROR_NONE);
        engine_command_destroy(command);
        return true;
    default:
        return queue_push(engine.commands, command);
    }
}

static int event_fd(void *context)
{
    (void)context;
    return queue_event_fd(engine.events);
}

static struct engine_event *next_event(void *context)
{
    (void)context;
    return queue_try_pop(engine.events);
}

static void report_sent(void *context, uint64_t queue_ns, uint64_t send_ns)
{
    (void)context, (void)queue_ns, (void)send_ns;
}

static struct engine_port engine_begin(void)
{
    engine.events = queue_create(4096, true);
    engine.commands = queue_create(4096, false);
    atomic_store(&engine.gone, 0);
    return (struct engine_port){
        .submit = submit, .event_fd = event_fd, .next_event = next_event, .report_sent = report_sent};
}

static void drop_event(void *item)
{
    engine_event_destroy(item);
}

static void drop_command(void *item)
{
    engine_command_destroy(item);
}

static void engine_end(void)
{
    queue_destroy(engine.events, drop_event);
    queue_destroy(engine.commands, drop_command);
}

/* The next command, which is to be of that kind; the caller destroys it. */
static struct engine_command *told(enum engine_command_kind kind)
{
    struct engine_command *command = queue_pop(engine.commands, UINT64_C(20000000000));
    if (!command)
        fail_msg("the engine was told nothing; command %d was to come", kind);
    if (command->kind != kind)
        fail_msg("the engine was told command %d instead of %d", command->kind, kind);
    return command;
}

static void told_and_forgotten(enum engine_command_kind kind)
{
    engine_command_destroy(told(kind));
}

static void told_credit(uint32_t request, uint64_t credit)
{
    struct engine_command *command = told(ENGINE_JOB_CREDIT);
    assert_int_equal(command->target_request, request);
    assert_int_equal(command->credit, credit);
    engine_command_destroy(command);
}

static void told_nothing(void)
{
    struct engine_command *command = queue_pop(engine.commands, UINT64_C(50000000));
    if (command)
        fail_msg("the engine was told command %d", command->kind);
}

/* A frame of a view, that shows a command and was taken up, read back and encoded at 100, 200 and 300 ns. */
static void say_frame(uint32_t request, uint32_t number, uint64_t command)
{
    struct engine_event *made = calloc(1, sizeof *made);
    struct engine_frame *frame = calloc(1, sizeof *frame);
    assert_true(made && frame);
    made->kind = ENGINE_FRAME;
    made->client = 1;
    made->request = request;
    made->frame = frame;
    frame->frame = number;
    frame->request.width = frame->request.height = 1;
    frame->result.samples = frame->result.layers = 1;
    frame->size_bytes = FRAME_BYTES;
    frame->bytes = malloc(FRAME_BYTES);
    assert_non_null(frame->bytes);
    memset(frame->bytes, (int)number, FRAME_BYTES);
    frame->command = command;
    frame->received_ns = command ? 50 : 0;
    frame->moving = command % 2;
    frame->applied_ns = 100;
    frame->rendered_ns = 200;
    frame->encoded_ns = 300;
    frame->key_frame = true;
    frame->quality = 77;
    stage_times_begin(&frame->result.times);
    assert_true(queue_push(engine.events, made));
}

/* ---- steps ------------------------------------------------------------------------------------------- */

static struct message view_message(uint32_t credit)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.kind = PROTOCOL_JOB_KIND_VIEW;
    message.render.scene = 1;
    message.render.channel = CHANNEL;
    message.render.credit = credit;
    message.render.samples = 16;
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    message.render.still_encoding = PROTOCOL_ENCODING_ZSTD;
    return message;
}

/* Opens scene 1 as request 1 and a view of it; what the engine was told is the caller's. */
static struct engine_command *start_view(uint32_t request, uint32_t credit)
{
    open_scene(1, 1);
    struct message message = view_message(credit);
    send_message(request, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->request, request);
    assert_int_equal(command->job.kind, JOB_VIEW);
    assert_non_null(command->job.wishes);
    return command;
}

static void send_camera(uint64_t number, bool moving)
{
    struct message message = made(MESSAGE_VIEW_CAMERA);
    message.view_camera.channel = CHANNEL;
    message.view_camera.command = number;
    message.view_camera.moving = moving;
    message.view_camera.time_s = 0.25f;
    message.view_camera.eye_world[1] = (float)number;
    message.view_camera.look_at_world[2] = -1;
    message.view_camera.up_world[1] = 1;
    message.view_camera.fov_y = 0.5f;
    send_message(0, 0, &message);
}

static void send_credit(uint64_t total)
{
    struct message message = made(MESSAGE_CREDIT);
    message.credit.channel = CHANNEL;
    message.credit.total = total;
    send_message(0, 0, &message);
}

/* Whole; FRAME_BEGIN is *begin. */
static void expect_frame(uint32_t request, uint32_t number, struct message_frame_begin *begin)
{
    expect(MESSAGE_FRAME_BEGIN, request);
    assert_int_equal(client.header.channel, CHANNEL);
    assert_int_equal(client.message.frame_begin.frame, number);
    *begin = client.message.frame_begin;
    for (size_t offset = 0; offset < FRAME_BYTES; offset += client.message.frame_data.data_bytes) {
        expect(MESSAGE_FRAME_DATA, request);
        assert_int_equal(client.message.frame_data.offset_bytes, offset);
        assert_int_equal(client.message.frame_data.data[0], number);
    }
    expect(MESSAGE_FRAME_END, request);
    assert_int_equal(client.message.frame_end.frame, number);
}

static void take_frame(uint32_t request, uint32_t number)
{
    struct message_frame_begin begin;
    expect_frame(request, number, &begin);
}

/* ---- tests ------------------------------------------------------------------------------------------- */

static void a_frame_names_the_camera_that_it_shows(void **state)
{
    (void)state;
    struct engine_command *start = start_view(2, 8);
    assert_int_equal(start->job.pass_samples, 1);
    assert_int_equal(start->job.frame.samples, 16);
    assert_int_equal(start->job.encoding, ENCODING_JPEG);
    assert_int_equal(start->job.still_encoding, ENCODING_ZSTD);
    uint64_t before_ns = clock_now_ns();
    send_camera(7, true);
    told_and_forgotten(ENGINE_VIEW_LOOK);
    struct view_camera camera = view_wishes_take(start->job.wishes).camera;
    assert_int_equal(camera.command, 7);
    assert_true(camera.moving);
    assert_true(before_ns <= camera.received_ns && camera.received_ns <= clock_now_ns());
    assert_true(camera.key.time_s == 0.25f && camera.key.eye_world[1] == 7 && camera.key.fov_y == 0.5f);
    assert_true(camera.key.look_at_world[2] == -1 && camera.key.up_world[1] == 1);
    say_frame(2, 0, 7);
    struct message_frame_begin begin;
    expect_frame(2, 0, &begin);
    assert_int_equal(begin.command, 7);
    assert_int_equal(begin.received_ns, 50);
    assert_int_equal(begin.applied_ns, 100);
    assert_int_equal(begin.rendered_ns, 200);
    assert_int_equal(begin.moving, 1);
    assert_int_equal(begin.key_frame, 1);
    assert_int_equal(begin.quality, 77);
    engine_command_destroy(start);
}

static void frames_are_begun_one_ahead_of_those_sent_and_not_beyond_credit(void **state)
{
    (void)state;
    struct engine_command *start = start_view(2, 3);
    assert_int_equal(start->job.credit, 2);
    say_frame(2, 0, 0);
    take_frame(2, 0);
    told_credit(2, 3);
    say_frame(2, 1, 0);
    say_frame(2, 2, 0);
    take_frame(2, 1);
    take_frame(2, 2);
    told_nothing();
    send_credit(4);
    told_credit(2, 4);
    send_credit(4); /* absolute: the same again is nothing new */
    told_nothing();
    engine_command_destroy(start);
}

#define BOTH(name)                                                                                                \
    cmocka_unit_test_setup_teardown(name, set_up, tear_down),                                                     \
        cmocka_unit_test_setup_teardown(name, set_up_with_faults, tear_down)

int main(void)
{
    const struct CMUnitTest tests[] = {
        BOTH(a_frame_names_the_camera_that_it_shows),
        BOTH(frames_are_begun_one_ahead_of_those_sent_and_not_beyond_credit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
