/* SPDX-License-Identifier: MIT */
/* Views as a session serves them, with an engine that keeps what it is told for the test to see, and says what the
 * test has it say. */
#include "tests/fixtures/engine_port.h"
#include "tests/fixtures/stopped_clock.h"
#include "tests/unit/session/session_fixture.h"

#include "encode/stream.h"

#include "base/clock.h"
#include "engine/view_mailbox.h"
#include "tests/harness/test.h"

#include <linux/sockios.h>
#include <sys/ioctl.h>

#define CHANNEL 5u
#define FRAME_BYTES ((size_t)300001)        /* two pieces, the last of odd size */
#define LARGE_FRAME_BYTES ((size_t)5 << 20) /* more than sockets and queues hold */
/* Frames of a view of that size may take 5.4 MiB, of the 10 MiB that all may. */
#define LESS_THAN_ALL_EDGE 448

#define MS UINT64_C(1000000)

/* ---- an engine --------------------------------------------------------------------------------------- */

static struct {
    struct queue *commands;
    struct engine_command *told[64]; /* until the test ends */
    size_t described_count;
    atomic_uint gone;
} engine;

static void say(enum engine_event_kind kind, uint32_t request, enum error_code error)
{
    struct engine_event *made = port_event(kind, 1, request);
    if (error)
        error_set(&made->error, error, "fake", "as the test wants");
    port_say(made);
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

static struct engine_port engine_begin(void)
{
    clock_start();
    engine.commands = queue_create(ENGINE_PORT_EVENTS_MAX, false);
    atomic_store(&engine.gone, 0);
    return port_begin(submit);
}

static void drop_command(void *item)
{
    engine_command_destroy(item);
}

static void engine_end(void)
{
    port_end();
    while (engine.described_count)
        engine_command_destroy(engine.told[--engine.described_count]);
    queue_destroy(engine.commands, drop_command);
}

/* The next command, which is to be of that kind; it stays until the test ends. */
static struct engine_command *told(enum engine_command_kind kind)
{
    struct engine_command *command = queue_pop(engine.commands, UINT64_C(20000000000));
    if (!command)
        fail_msg("the engine was told nothing; command %d was to come", kind);
    if (command->kind != kind)
        fail_msg("the engine was told command %d instead of %d", command->kind, kind);
    assert_true(engine.described_count < sizeof(engine.told) / sizeof(engine.told[0]));
    return engine.told[engine.described_count++] = command;
}

/* So much and no more; on a busy machine, where the first frame was slow to come, in several steps. */
static void told_credit(uint32_t request, uint64_t credit)
{
    uint64_t reached;
    do {
        struct engine_command *command = told(ENGINE_JOB_CREDIT);
        assert_int_equal(command->target_request, request);
        reached = command->credit;
    } while (reached < credit);
    assert_int_equal(reached, credit);
}

static void told_nothing(void)
{
    struct engine_command *command = queue_pop(engine.commands, UINT64_C(50000000));
    if (command)
        fail_msg("the engine was told command %d", command->kind);
}

/* A frame of a view, that shows a command and was taken up, read back and encoded at 100, 200 and 300 ns. */
static struct engine_event *frame_of(uint32_t request, uint32_t number, uint64_t command, size_t bytes)
{
    struct engine_event *made = port_frame(1, request, number, bytes);
    struct engine_frame *frame = made->frame;
    memset(frame->bytes, (int)number, bytes);
    frame->command = command;
    frame->received_ns = command ? 50 : 0;
    frame->moving = command % 2;
    frame->applied_ns = 100;
    frame->rendered_ns = 200;
    frame->encoded_ns = 300;
    frame->key_frame = true;
    frame->quality = 77;
    return made;
}

static void say_frame_of(uint32_t request, uint32_t number, uint64_t command, size_t bytes)
{
    port_say(frame_of(request, number, command, bytes));
}

static void say_frame_with(uint32_t request, uint32_t number, size_t depth_bytes, size_t normal_bytes,
                           size_t sticking_bytes)
{
    struct engine_event *made = frame_of(request, number, 0, FRAME_BYTES);
    made->frame->result.attachments = (1u << ATTACHMENT_COUNT) - 1;
    made->frame->depth_bytes = depth_bytes;
    made->frame->normal_bytes = normal_bytes;
    made->frame->sticking_bytes = sticking_bytes;
    made->frame->depth_step = 0.25f;
    made->frame->margin_x = 7;
    made->frame->margin_y = 5;
    port_say(made);
}

static void say_frame(uint32_t request, uint32_t number, uint64_t command)
{
    say_frame_of(request, number, command, FRAME_BYTES);
}

static void say_large_frame(uint32_t request, uint32_t number)
{
    say_frame_of(request, number, 0, LARGE_FRAME_BYTES);
}

/* ---- steps ------------------------------------------------------------------------------------------- */

static struct message view_message(uint32_t credit)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.kind = PROTOCOL_JOB_VIEW;
    message.render.scene = 1;
    message.render.channel = CHANNEL;
    message.render.credit = credit;
    message.render.picture.width = message.render.picture.height = 1;
    message.render.sampling.samples = 16;
    message.render.frames_per_second = 1; /* the link is never what holds frames back */
    message.render.encoding = PROTOCOL_ENCODING_JPEG;
    message.render.view.still_encoding = PROTOCOL_ENCODING_ZSTD;
    return message;
}

static void expect_told_start(uint32_t request, enum job_kind kind)
{
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->request, request);
    assert_int_equal(command->job.kind, kind);
}

/* Opens scene 1 as request 1 and a view of it. */
static struct engine_command *start_view(uint32_t request, uint32_t credit)
{
    open_scene(1, 1);
    struct message message = view_message(credit);
    send_message(request, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->request, request);
    assert_int_equal(command->job.kind, JOB_VIEW);
    assert_non_null(command->job.mailbox);
    return command;
}

static void send_camera_on(uint32_t channel, uint64_t number, bool moving)
{
    struct message message = made(MESSAGE_VIEW_CAMERA);
    message.view_camera.channel = channel;
    message.view_camera.command = number;
    message.view_camera.moving = moving;
    message.view_camera.time_s = 0.25f;
    message.view_camera.eye_world[1] = (float)number;
    message.view_camera.look_at_world[2] = -1;
    message.view_camera.up_world[1] = 1;
    message.view_camera.fov_y = 0.5f;
    message.view_camera.node = 4;
    send_message(0, 0, &message);
}

static void send_camera(uint64_t number, bool moving)
{
    send_camera_on(CHANNEL, number, moving);
}

static void send_credit(uint64_t total)
{
    struct message message = made(MESSAGE_CREDIT);
    message.credit.channel = CHANNEL;
    message.credit.total = total;
    send_message(0, 0, &message);
}

static void send_ack_on(uint32_t channel, uint32_t frame)
{
    struct message message = made(MESSAGE_FRAME_ACK);
    message.frame_ack.channel = channel;
    message.frame_ack.frame = frame;
    message.frame_ack.whole = 1;
    send_message(0, 0, &message);
}

static void send_ack(uint32_t frame, bool whole, bool want_key_frame)
{
    struct message message = made(MESSAGE_FRAME_ACK);
    message.frame_ack.channel = CHANNEL;
    message.frame_ack.frame = frame;
    message.frame_ack.whole = whole;
    message.frame_ack.want_key_frame = want_key_frame;
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

SESSION_TEST(a_frame_names_the_camera_that_it_shows)
{
    struct engine_command *start = start_view(2, 8);
    assert_int_equal(start->job.view.pass_samples, 1);
    assert_int_equal(start->job.frame.sampling.samples, 16);
    assert_int_equal(start->job.encoding, ENCODING_JPEG);
    assert_int_equal(start->job.view.still_encoding, ENCODING_ZSTD);
    uint64_t before_ns = clock_now_ns();
    send_camera(7, true);
    told(ENGINE_VIEW_CHANGED);
    struct view_camera camera = view_mailbox_begin_frame(start->job.mailbox).camera;
    assert_int_equal(camera.command, 7);
    assert_true(camera.moving);
    assert_true(before_ns <= camera.received_ns && camera.received_ns <= clock_now_ns());
    assert_true(camera.key.time_s == 0.25f && camera.key.eye_world[1] == 7 && camera.key.fov_y == 0.5f);
    assert_int_equal(camera.node, 4);
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
}

/* Frame 0 shows command 0 and is acknowledged; from then on three frames are in hand, as far as credit goes. */
static struct engine_command *start_acknowledged_view(uint32_t request, uint32_t credit)
{
    struct engine_command *start = start_view(request, credit);
    assert_int_equal(start->job.credit, 1);
    say_frame(request, 0, 0);
    take_frame(request, 0);
    send_ack(0, true, false);
    return start;
}

/* View 2, which has shown a frame, with credit for whatever is to come. */
static void start_view_with_credit(void)
{
    start_acknowledged_view(2, 100);
    told_credit(2, 4);
}

SESSION_TEST(frames_are_begun_ahead_of_those_sent_and_not_beyond_credit)
{
    clock_stop(); /* over a slow link, the next frame would wait for an acknowledgement */
    start_acknowledged_view(2, 5);
    told_credit(2, 4);
    say_frame(2, 1, 0);
    take_frame(2, 1);
    told_credit(2, 5);
    say_frame(2, 2, 0);
    say_frame(2, 3, 0);
    say_frame(2, 4, 0);
    take_frame(2, 2);
    send_ack(1, true, false);
    send_ack(2, true, false);
    take_frame(2, 3);
    take_frame(2, 4);
    send_ack(4, true, false);
    told_nothing();
    send_credit(6);
    told_credit(2, 6);
    send_credit(6); /* absolute: the same again is nothing new */
    told_nothing();
}

SESSION_TEST(a_flood_of_cameras_wakes_the_engine_once)
{
    struct engine_command *start = start_view(2, 1);
    for (uint64_t number = 1; number <= 1000; number++)
        send_camera(number, true);
    expect_alive(9);
    told(ENGINE_VIEW_CHANGED);
    told_nothing();
    assert_int_equal(view_mailbox_begin_frame(start->job.mailbox).camera.command, 1000);
    send_camera(1001, false);
    told(ENGINE_VIEW_CHANGED);
    assert_false(view_mailbox_begin_frame(start->job.mailbox).camera.moving);
}

SESSION_TEST(a_camera_of_no_view_is_ignored_and_one_out_of_order_is_not)
{
    send_camera(5, false); /* the view may just have ended */
    send_ack(3, true, true);
    expect_alive(9);
    start_view(2, 1);
    send_camera(5, false);
    told(ENGINE_VIEW_CHANGED);
    send_camera(5, false);
    expect_error(0, PROTOCOL_ERROR_PROTOCOL);
    assert_string_equal(client.message.error.field, "view_camera.command");
    expect(MESSAGE_GOODBYE, 0);
}

SESSION_TEST(a_request_for_a_key_frame_reaches_the_engine)
{
    struct engine_command *start = start_acknowledged_view(2, 1);
    send_ack(0, true, true);
    told(ENGINE_VIEW_CHANGED);
    assert_true(view_mailbox_begin_frame(start->job.mailbox).key_frame);
    assert_false(view_mailbox_begin_frame(start->job.mailbox).key_frame);
}

/* Frame 1 is on its way and not acknowledged, and the link was slow before, so that frame 2 has waited for it when
 * a newer camera has long come. The client's credit ends there: on a busy machine, where that takes long, another
 * frame would be begun meanwhile. */
static struct engine_command *let_a_frame_wait(enum encoding encoding)
{
    open_scene(1, 1);
    struct message message = view_message(3);
    message.render.frames_per_second = 100000;
    send_message(2, 0, &message);
    struct engine_command *start = told(ENGINE_JOB_START);
    clock_stop();
    say_frame(2, 0, 0);
    take_frame(2, 0);
    clock_let_pass(50 * MS);
    send_ack(0, true, false); /* so long it took */
    told_credit(2, 2);
    say_frame(2, 1, 0);
    take_frame(2, 1);
    /* The next one is begun when that one is expected to have come, and waits for it. */
    clock_let_pass(50 * MS);
    told_credit(2, 3);
    struct engine_event *late = frame_of(2, 2, 0, FRAME_BYTES);
    late->frame->encoding = encoding;
    port_say(late);
    send_camera(8, true);
    told(ENGINE_VIEW_CHANGED);
    clock_let_pass(20 * MS);
    send_ack(1, true, false);
    return start;
}

SESSION_TEST(a_frame_that_waits_for_the_link_is_dropped_for_a_newer_camera)
{
    let_a_frame_wait(ENCODING_JPEG);
    told_credit(2, 4); /* instead of frame 2 */
    say_frame(2, 3, 8);
    take_frame(2, 3);
}

/* Those behind it tell what is different from it, key frame or not. */
SESSION_TEST(a_frame_of_a_stream_comes_however_long_it_waits)
{
    let_a_frame_wait(ENCODING_H264);
    take_frame(2, 2);
    send_credit(4);
    say_frame(2, 3, 8);
    send_ack(2, true, false);
    take_frame(2, 3);
}

/* Until the session has read what was sent: what this client reads before that lets the frame under way go on. */
static void wait_until_read(void)
{
    int unread_bytes = 1;
    for (unsigned ms = 0; unread_bytes > 0 && ms < 20000; ms++) {
        usleep(1000);
        assert_int_equal(ioctl(client.fd, SIOCOUTQ, &unread_bytes), 0);
    }
    assert_int_equal(unread_bytes, 0);
}

/* Takes the pieces of the large frame that was begun, and its end; whether that was abandoned. */
static bool take_rest_of_large_frame(uint32_t request, uint32_t number)
{
    size_t came_bytes = 0;
    while (receive()->type == MESSAGE_FRAME_DATA) {
        assert_int_equal(client.message.frame_data.offset_bytes, came_bytes);
        came_bytes += client.message.frame_data.data_bytes;
    }
    assert_int_equal(client.message.type, MESSAGE_FRAME_END);
    assert_int_equal(client.header.request, request);
    assert_int_equal(client.message.frame_end.frame, number);
    bool abandoned = client.message.frame_end.abandoned;
    assert_true(abandoned ? came_bytes < LARGE_FRAME_BYTES : came_bytes == LARGE_FRAME_BYTES);
    return abandoned;
}

/* A frame that shows that command is on its way when the camera comes; whether it is abandoned. */
static bool is_abandoned(uint32_t number, uint64_t command, enum encoding encoding, uint64_t camera, bool moving)
{
    struct engine_event *made = frame_of(2, number, command, LARGE_FRAME_BYTES);
    made->frame->encoding = encoding;
    port_say(made);
    expect(MESSAGE_FRAME_BEGIN, 2);
    send_camera(camera, moving);
    wait_until_read();
    return take_rest_of_large_frame(2, number);
}

SESSION_TEST(a_picture_at_rest_that_motion_overtakes_is_abandoned_and_uses_no_credit)
{
    start_view(2, 1);
    say_large_frame(2, 0);
    expect(MESSAGE_FRAME_BEGIN, 2);
    send_camera(7, true);
    told(ENGINE_VIEW_CHANGED);
    assert_true(take_rest_of_large_frame(2, 0));
    told_credit(2, 2);
    say_frame(2, 1, 7);
    take_frame(2, 1); /* though nothing was acknowledged */
}

/* Nothing is acknowledged, so that all of them take long as far as is known. */
SESSION_TEST(a_frame_that_is_still_needed_is_not_abandoned)
{
    start_view(2, 100);
    assert_false(is_abandoned(0, 0, ENCODING_ZSTD, 2, false)); /* rest after rest */
    assert_false(is_abandoned(1, 3, ENCODING_JPEG, 5, true));  /* motion */
    send_camera(6, false);
    assert_false(is_abandoned(2, 6, ENCODING_H264, 7, true)); /* a stream's */
    send_camera(8, false);
    assert_true(is_abandoned(3, 8, ENCODING_JPEG, 9, true));
}

TEST_WITH(a_client_that_does_not_allow_abandoned_frames_gets_complete_frames, set_up_ungreeted, tear_down)
{
    assert_int_equal(greet_with(0) & HANDSHAKE_CAN_ABANDON, 0);
    start_view(2, 100);
    assert_false(is_abandoned(0, 0, ENCODING_ZSTD, 1, true));
}

/* ---- parts ---- */

/* Adds the bytes of a frame that come before the answer with that error. */
static void expect_error_within_frame(uint32_t request, enum protocol_error_code code, uint64_t *bytes)
{
    while (receive()->type == MESSAGE_FRAME_DATA)
        *bytes += client.message.frame_data.data_bytes;
    assert_int_equal(client.message.type, MESSAGE_ERROR);
    assert_int_equal(client.header.request, request);
    assert_int_equal(client.message.error.code, code);
}

/* Colours, coarse depth and the colours that refine them; the last part is most of it. */
static void say_parts(uint32_t request, uint32_t number, uint64_t command, size_t second_bytes)
{
    struct engine_event *made = frame_of(request, number, command, LARGE_FRAME_BYTES);
    struct engine_frame *frame = made->frame;
    const size_t first_bytes = 1000, coarse_bytes = 200;
    frame->coarse_bytes = coarse_bytes;
    frame->parts = (struct part_list){
        .parts = {{FRAME_PART_COLOURS, first_bytes},
                  {FRAME_PART_COARSE_DEPTH, coarse_bytes},
                  {FRAME_PART_COLOURS, second_bytes},
                  {FRAME_PART_COLOURS, LARGE_FRAME_BYTES - first_bytes - coarse_bytes - second_bytes}},
        .count = 4};
    port_say(made);
}

static struct engine_command *start_view_in_parts(uint32_t credit)
{
    open_scene(1, 1);
    struct message message = view_message(credit);
    message.render.view.parts = 1;
    send_message(2, 0, &message);
    return told(ENGINE_JOB_START);
}

static void expect_parts(uint32_t request, uint32_t number)
{
    expect(MESSAGE_FRAME_BEGIN, request);
    expect(MESSAGE_FRAME_PARTS, request);
    const struct message_frame_parts *parts = &client.message.frame_parts;
    assert_int_equal(parts->frame, number);
    assert_int_equal(parts->parts_count, 4);
    assert_int_equal(parts->parts[1].kind, PROTOCOL_FRAME_PART_COARSE_DEPTH);
    assert_int_equal(parts->parts[1].size_bytes, 200);
}

/* The data of a frame that ends early, and its end; how many bytes came. */
static size_t take_cut(uint32_t number)
{
    size_t came_bytes = 0;
    while (receive()->type == MESSAGE_FRAME_DATA) {
        assert_int_equal(client.message.frame_data.offset_bytes, came_bytes);
        came_bytes += client.message.frame_data.data_bytes;
    }
    assert_int_equal(client.message.type, MESSAGE_FRAME_END);
    assert_int_equal(client.message.frame_end.frame, number);
    assert_int_equal(client.message.frame_end.abandoned, came_bytes < LARGE_FRAME_BYTES);
    return came_bytes;
}

/* The kept picture is shown, so it uses credit; and the motion that overtakes it does not wait. Where calls
 * are cut short it is chance whether the first parts have left by then. */
TEST_WITH(a_picture_at_rest_in_parts_that_motion_overtakes_keeps_what_has_come, set_up, tear_down)
{
    struct engine_command *start = start_view_in_parts(1);
    assert_true(start->job.view.parts);
    say_parts(2, 0, 0, 10000);
    expect_parts(2, 0);
    send_camera(7, true);
    told(ENGINE_VIEW_CHANGED);
    wait_until_read();
    assert_in_range(take_cut(0), 1200, LARGE_FRAME_BYTES - 1);
    told_nothing();
    send_credit(2);
    told_credit(2, 2);
    say_frame(2, 1, 7);
    take_frame(2, 1); /* though nothing was acknowledged */
}

/* The second colours are more than sockets and queues hold, so that they are under way. */
TEST_WITH(a_picture_of_motion_that_a_newer_one_overtakes_ends_with_the_part_under_way, set_up, tear_down)
{
    const size_t second_bytes = LARGE_FRAME_BYTES - (1 << 20);
    start_view_in_parts(8);
    say_parts(2, 0, 1, second_bytes);
    expect_parts(2, 0);
    say_frame(2, 1, 3);
    struct message message = made(MESSAGE_STATS);
    send_message(4, 0, &message);
    told(ENGINE_STATS);
    say(ENGINE_FAILED, 4, ERROR_OUT_OF_MEMORY); /* so that it is known when the frame before it has come */
    uint64_t bytes = 0;
    expect_error_within_frame(4, PROTOCOL_ERROR_OUT_OF_MEMORY, &bytes);
    while (receive()->type == MESSAGE_FRAME_DATA)
        bytes += client.message.frame_data.data_bytes;
    assert_int_equal(client.message.type, MESSAGE_FRAME_END);
    assert_int_equal(client.message.frame_end.abandoned, 1);
    assert_int_equal(bytes, 1200 + second_bytes);
    send_ack(0, true, false);
    take_frame(2, 1);
}

/* Refinement that nothing better waits for is sent. */
SESSION_TEST(a_frame_in_parts_comes_whole_if_nothing_overtakes_it)
{
    start_view_in_parts(8);
    say_parts(2, 0, 1, 10000);
    expect_parts(2, 0);
    send_camera(5, true); /* no picture of it is there */
    assert_int_equal(take_cut(0), LARGE_FRAME_BYTES);
}

SESSION_TEST(frames_are_requested_in_parts_where_the_link_takes_long_for_them)
{
    struct engine_command *start = start_view_in_parts(100);
    clock_stop();
    say_frame(2, 0, 1);
    take_frame(2, 0);
    clock_let_pass(100 * MS);
    send_ack(0, true, false); /* so long it took, as far as the daemon knows */
    told(ENGINE_JOB_CREDIT);
    assert_false(view_mailbox_latest(start->job.mailbox).effort.parts);
    say_frame(2, 1, 3);
    take_frame(2, 1);
    assert_true(view_mailbox_latest(start->job.mailbox).effort.parts);
    assert_false(view_mailbox_latest(start->job.mailbox).effort.still_parts);
}

/* Who moves on each time just before the picture at rest is there sees one now and then. */
SESSION_TEST(not_every_picture_at_rest_is_abandoned)
{
    start_view(2, 100);
    uint64_t command = 0;
    uint32_t number = 0;
    while (number < 20 && is_abandoned(number, command, ENCODING_ZSTD, command + 1, true)) {
        send_camera(command += 2, false);
        number++;
    }
    assert_in_range(number, 1, 10);
}

SESSION_TEST(a_picture_at_rest_that_has_not_begun_is_dropped_when_motion_goes_on)
{
    start_view(2, 100);
    say_large_frame(2, 0);
    expect(MESSAGE_FRAME_BEGIN, 2);
    say_large_frame(2, 1); /* waits behind it, or comes too late */
    send_camera(7, true);
    wait_until_read();
    assert_true(take_rest_of_large_frame(2, 0));
    say_frame(2, 2, 7);
    take_frame(2, 2);
}

/* A view that adapts, as fast as can be, whose first frame of 300 KB takes so long on its way. In 0.1 s that is a
 * link of 3 MB a second, or 3 KB in a millisecond. The clock stays where it is then. */
static struct engine_command *start_view_on_a_slow_link(float margin, uint64_t way_ns)
{
    open_scene(1, 1);
    struct message message = view_message(100);
    message.render.view.adapt = 1;
    message.render.view.still_encoding = PROTOCOL_ENCODING_RAW;
    message.render.quality = 90;
    message.render.frames_per_second = 1000;
    message.render.view.margin = margin;
    send_message(2, 0, &message);
    struct engine_command *start = told(ENGINE_JOB_START);
    assert_true(start->job.view.adapt);
    clock_stop();
    say_frame(2, 0, 1); /* moving */
    take_frame(2, 0);
    clock_let_pass(way_ns);
    send_ack(0, true, false);
    return start;
}

SESSION_TEST(a_view_that_adapts_tells_the_engine_what_the_link_carries)
{
    struct engine_command *start = start_view_on_a_slow_link(0.0f, 100 * MS);
    told_credit(2, 2);
    say_frame(2, 1, 3);
    take_frame(2, 1);
    const struct view_effort effort = view_mailbox_latest(start->job.mailbox).effort;
    assert_true(effort.scale_32nds < 32);
    assert_true(effort.quality < 90);
    assert_true(effort.bytes < FRAME_BYTES);
    assert_false(effort.sparing);
    say_frame(2, 2, 2); /* at rest; 100 ms are not too long for it */
    clock_let_pass(100 * MS);
    send_ack(1, true, false);
    take_frame(2, 2);
    assert_false(view_mailbox_latest(start->job.mailbox).effort.sparing);
    say_large_frame(2, 3); /* more than a second */
    for (unsigned i = 0; !view_mailbox_latest(start->job.mailbox).effort.sparing && i < 2000; i++)
        usleep(10000);
    assert_true(view_mailbox_latest(start->job.mailbox).effort.sparing);
}

/* A frame of 100 ns is in time for no rate that can be asked for; this one took a second. */
SESSION_TEST(a_view_that_keeps_a_rate_tells_the_engine_what_to_go_without)
{
    open_scene(1, 1);
    struct message message = view_message(100);
    message.render.view.moving_rate = 20;
    message.render.quality = 90;
    message.render.light.depth = 8;
    send_message(2, 0, &message);
    struct engine_command *start = told(ENGINE_JOB_START);
    assert_true(start->job.view.moving_rate > 0.0f && !start->job.view.adapt);
    struct engine_event *slow = frame_of(2, 0, 1, FRAME_BYTES);
    slow->frame->rendered_ns = slow->frame->applied_ns + UINT64_C(2000000000);
    slow->frame->encoded_ns = slow->frame->rendered_ns + 100;
    port_say(slow);
    take_frame(2, 0);
    struct view_effort effort = view_mailbox_latest(start->job.mailbox).effort;
    assert_int_equal(effort.scale_32nds, 5); /* 49 ms of 85 % of 50, so bounces go as well */
    assert_int_equal(effort.depth_less, 6);
    assert_int_equal(effort.quality, 0); /* the link is not followed */
    assert_true(effort.bytes == 0);
}

/* 300 KB in 0.1 s: neither a picture of 300 KB with what it hides fits twenty a second, nor one with its margin.
 */
SESSION_TEST(the_engine_is_told_what_a_client_with_its_own_views_goes_without)
{
    struct engine_command *start = start_view_on_a_slow_link(0.1f, 150 * MS);
    told(ENGINE_JOB_CREDIT);
    say_frame(2, 1, 3);
    take_frame(2, 1);
    const struct view_effort effort = view_mailbox_latest(start->job.mailbox).effort;
    assert_int_equal(effort.margin_halves_less, 2);
    assert_true(effort.bytes > FRAME_BYTES / 4); /* at twenty a second */
    assert_true(effort.quality < 90);
    assert_int_equal(effort.scale_32nds, 32);
}

/* ---- one view in the place of another ---------------------------------------------------------------- */

static struct engine_command *replace_view(uint32_t request, uint32_t width)
{
    struct message message = view_message(0);
    message.render.picture.width = width;
    send_message(request, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->request, request);
    assert_int_equal(command->job.frame.picture.width, width);
    return command;
}

SESSION_TEST(a_view_takes_the_place_of_another_on_its_channel)
{
    clock_stop();
    struct engine_command *start = start_acknowledged_view(2, 100);
    told_credit(2, 4);
    send_camera(7, true);
    told(ENGINE_VIEW_CHANGED);
    struct engine_command *change = replace_view(3, 17);
    assert_ptr_equal(change->job.mailbox, start->job.mailbox);
    say_frame(2, 1, 7); /* the engine has not seen it yet */
    take_frame(2, 1);
    told_credit(2, 5);
    say(ENGINE_DONE, 2, ERROR_NONE);
    told_credit(3, 3); /* the engine counts anew */
    say_frame(3, 2, 7);
    expect(MESSAGE_OK, 2);
    take_frame(3, 2);
    told_credit(3, 4);
    /* Both renders are one job: there is room for another one, but not for the third. */
    struct message message = view_message(1);
    message.render.channel = CHANNEL + 1;
    send_message(4, 0, &message);
    told(ENGINE_JOB_START);
    message.render.channel = CHANNEL + 2;
    send_message(5, 0, &message);
    expect_error(5, PROTOCOL_ERROR_LIMIT);
}

SESSION_TEST(a_frame_being_sent_is_completed_before_the_answer)
{
    start_view_with_credit();
    replace_view(3, 17);
    /* Large enough that the socket does not take it at once: it is under way when it is replaced. */
    say_large_frame(2, 1);
    expect(MESSAGE_FRAME_BEGIN, 2);
    say_frame(2, 2, 0); /* not begun on the wire: it is dropped */
    say(ENGINE_DONE, 2, ERROR_NONE);
    say_frame(3, 3, 0);
    uint64_t bytes = 0;
    while (bytes < LARGE_FRAME_BYTES) {
        expect(MESSAGE_FRAME_DATA, 2);
        assert_int_equal(client.message.frame_data.offset_bytes, bytes);
        bytes += client.message.frame_data.data_bytes;
    }
    expect(MESSAGE_FRAME_END, 2);
    expect(MESSAGE_OK, 2);
    send_ack(1, true, false); /* else the next one waits where the link was found to be slow */
    take_frame(3, 3);
}

SESSION_TEST(a_frame_under_way_of_a_view_that_was_replaced_still_takes_room)
{
    start_acknowledged_view(2, 100);
    told_credit(2, 4);
    replace_view(3, 17);
    struct message message = made(MESSAGE_STATS);
    send_message(4, 0, &message);
    told(ENGINE_STATS);
    say_large_frame(2, 1);
    expect(MESSAGE_FRAME_BEGIN, 2);
    say(ENGINE_DONE, 2, ERROR_NONE);
    say(ENGINE_FAILED, 4, ERROR_OUT_OF_MEMORY); /* so that it is known when the one before is done */
    uint64_t bytes = 0;
    expect_error_within_frame(4, PROTOCOL_ERROR_OUT_OF_MEMORY, &bytes);
    message = view_message(1); /* room for its frames is there but for that one */
    message.render.channel = CHANNEL + 1;
    message.render.picture.width = message.render.picture.height = LESS_THAN_ALL_EDGE;
    send_message(5, 0, &message);
    wait_until_read();
    expect_error_within_frame(5, PROTOCOL_ERROR_BUSY, &bytes);
    while (bytes < LARGE_FRAME_BYTES) {
        expect(MESSAGE_FRAME_DATA, 2);
        bytes += client.message.frame_data.data_bytes;
    }
    expect(MESSAGE_FRAME_END, 2);
    expect(MESSAGE_OK, 2);
    send_message(6, 0, &message);
    struct engine_command *command;
    while ((command = queue_pop(engine.commands, UINT64_C(20000000000))) && command->kind == ENGINE_JOB_CREDIT)
        engine_command_destroy(command);
    assert_non_null(command);
    assert_int_equal(command->kind, ENGINE_JOB_START);
    assert_int_equal(command->request, 6);
    engine_command_destroy(command);
}

SESSION_TEST(a_refused_view_leaves_the_running_one_unchanged)
{
    clock_stop();
    start_view_with_credit();
    struct message message = view_message(0);
    message.render.picture.width = 4096; /* more than the limit: the session says so itself */
    send_message(3, 0, &message);
    expect_error(3, PROTOCOL_ERROR_LIMIT);
    replace_view(4, 17);
    replace_view(5, 18);
    say(ENGINE_FAILED, 4, ERROR_UNSUPPORTED); /* the engine's answer here */
    expect_error(4, PROTOCOL_ERROR_UNSUPPORTED);
    say_frame(2, 1, 0);
    take_frame(2, 1);
    say(ENGINE_DONE, 2, ERROR_NONE);
    expect(MESSAGE_OK, 2);
    say_frame(5, 2, 0);
    take_frame(5, 2);
}

SESSION_TEST(a_view_that_fails_leaves_its_channel_to_the_next)
{
    start_view_with_credit();
    replace_view(3, 17);
    say(ENGINE_FAILED, 2, ERROR_OUT_OF_MEMORY);
    expect_error(2, PROTOCOL_ERROR_OUT_OF_MEMORY);
    say_frame(3, 0, 0);
    take_frame(3, 0);
    say(ENGINE_FAILED, 3, ERROR_OUT_OF_MEMORY);
    expect_error(3, PROTOCOL_ERROR_OUT_OF_MEMORY);
    /* The channel is free. */
    while (queue_length(engine.commands))
        told(ENGINE_JOB_CREDIT);
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.picture.width = message.render.picture.height = 1;
    message.render.channel = CHANNEL;
    send_message(4, 0, &message);
    expect_told_start(4, JOB_BATCH);
}

SESSION_TEST(a_cancelled_view_is_answered_and_nothing_follows)
{
    start_view_with_credit();
    cancel(3, 2);
    struct engine_command *cancel = told(ENGINE_JOB_CANCEL);
    assert_int_equal(cancel->target_request, 2);
    say_frame(2, 1, 0); /* was on its way */
    say(ENGINE_FAILED, 2, ERROR_CANCELLED);
    say(ENGINE_DONE, 3, ERROR_NONE);
    expect_error(2, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 3);
    send_camera(1, false);
    expect_alive(9);
    told_nothing();
}

SESSION_TEST(a_view_may_be_cancelled_while_another_takes_its_place)
{
    start_view_with_credit();
    replace_view(3, 17);
    cancel(4, 3);
    told(ENGINE_JOB_CANCEL);
    say(ENGINE_DONE, 2, ERROR_NONE);
    say_frame(3, 1, 0); /* dropped */
    say(ENGINE_FAILED, 3, ERROR_CANCELLED);
    say(ENGINE_DONE, 4, ERROR_NONE);
    expect(MESSAGE_OK, 2);
    expect_error(3, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 4);
}

SESSION_TEST(a_client_that_vanishes_takes_its_view_along)
{
    start_view_with_credit();
    replace_view(3, 17);
    say_large_frame(2, 1);
    expect(MESSAGE_FRAME_BEGIN, 2);
    close(client.fd);
    for (unsigned i = 0; !atomic_load(&engine.gone) && i < 2000; i++)
        usleep(10000);
    assert_int_equal(atomic_load(&engine.gone), 1);
}

/* ---- what cannot be ---------------------------------------------------------------------------------- */

static void expect_refused(uint32_t request, const struct message *message, enum protocol_error_code code,
                           const char *field)
{
    send_message(request, 0, message);
    expect_error(request, code);
    if (strcmp(client.message.error.field, field) != 0)
        fail_msg("request %u: %s is refused, not %s", request, client.message.error.field, field);
}

/* Rows have the fields of a job that are not 0; the refusal names one of them. */
SESSION_TEST(a_job_that_cannot_be_is_refused_by_its_field)
{
    static const struct {
        enum protocol_job_kind kind;
        struct message_render wrong;
        const char *field;
        enum protocol_error_code code;
    } rows[] = {
        {PROTOCOL_JOB_VIEW,
         {.picture.layers = 1u << PROTOCOL_LAYER_DEPTH},
         "render.layers",
         PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_VIEW, {.encoding = PROTOCOL_ENCODING_H264}, "render.encoding", PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_VIEW,
         {.view.still_encoding = PROTOCOL_ENCODING_H264},
         "render.still_encoding",
         PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_VIEW,
         {.view.hidden_layers = 1, .view.attachments = 2},
         "render.hidden_layers",
         PROTOCOL_ERROR_INVALID},
        {PROTOCOL_JOB_VIEW,
         {.view.hidden_layers = 1, .view.attachments = 1, .camera.aperture = 0.1f},
         "render.hidden_layers",
         PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_VIEW,
         {.view.hidden_layers = 1, .view.attachments = 1, .camera.shutter = 0.5f},
         "render.hidden_layers",
         PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_BATCH, {.view.attachments = 1}, "render.attachments", PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_BATCH, {.view.margin = 0.1f}, "render.margin", PROTOCOL_ERROR_UNSUPPORTED},
        {PROTOCOL_JOB_BATCH, {.view.hidden_layers = 1}, "render.hidden_layers", PROTOCOL_ERROR_UNSUPPORTED},
    };
    uint32_t request = 2;
    open_scene(1, 1);
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        struct message message = view_message(1);
        struct message_render *render = &message.render;
        const struct message_render *wrong = &rows[i].wrong;
        render->kind = rows[i].kind;
        render->picture.layers = wrong->picture.layers ? wrong->picture.layers : render->picture.layers;
        render->encoding = wrong->encoding ? wrong->encoding : render->encoding;
        render->view.still_encoding =
            wrong->view.still_encoding ? wrong->view.still_encoding : render->view.still_encoding;
        render->view.attachments = wrong->view.attachments;
        render->view.hidden_layers = wrong->view.hidden_layers;
        render->camera.aperture = wrong->camera.aperture;
        render->camera.shutter = wrong->camera.shutter;
        render->view.margin = wrong->view.margin;
        expect_refused(request++, &message, rows[i].code, rows[i].field);
        assert_true(rows[i].code == PROTOCOL_ERROR_INVALID || client.message.error.remedy[0] != '\0');
    }
    /* Frames without loss while the view moves leave no quality to raise at rest, of 16 bits or 8. */
    struct message message = view_message(1);
    message.render.encoding = PROTOCOL_ENCODING_RAW;
    message.render.view.still_encoding = PROTOCOL_ENCODING_JPEG;
    expect_refused(request++, &message, PROTOCOL_ERROR_UNSUPPORTED, "render.still_encoding");
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA16F;
    expect_refused(request++, &message, PROTOCOL_ERROR_UNSUPPORTED, "render.still_encoding");
    message = made(MESSAGE_RENDER); /* a batch has its channel to itself */
    message.render.scene = 1;
    message.render.picture.width = message.render.picture.height = 1;
    message.render.channel = CHANNEL;
    send_message(request, 0, &message);
    expect_told_start(request++, JOB_BATCH);
    message = view_message(1);
    expect_refused(request, &message, PROTOCOL_ERROR_INVALID, "render.channel");
}

TEST_WITH(video_needs_the_word_of_both_sides_and_a_view_of_8_bits, set_up_ungreeted, tear_down)
{
    struct message message;
    uint64_t both = greet_with(HANDSHAKE_CAN_H264 | (UINT64_C(1) << 63)); /* an unknown bit */
    if (!encoder_stream_supports(ENCODING_H264, 4)) {
        print_message("skipped: no encoder of H.264 is here\n");
        return;
    }
    assert_int_equal(both, HANDSHAKE_CAN_H264);
    open_scene(1, 1);
    message = view_message(1);
    message.render.picture.format = PROTOCOL_PIXEL_FORMAT_RGBA16F;
    message.render.encoding = PROTOCOL_ENCODING_H264;
    expect_refused(2, &message, PROTOCOL_ERROR_UNSUPPORTED, "render.encoding");
    message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.picture.width = message.render.picture.height = 1;
    message.render.channel = CHANNEL;
    message.render.encoding = PROTOCOL_ENCODING_H264;
    expect_refused(3, &message, PROTOCOL_ERROR_UNSUPPORTED, "render.encoding");
    assert_true(strlen(client.message.error.remedy) > 0);
    message = view_message(1);
    message.render.encoding = message.render.view.still_encoding = PROTOCOL_ENCODING_H264;
    send_message(4, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->job.encoding, ENCODING_H264);
}

SESSION_TEST(what_a_view_asks_to_be_attached_is_forwarded_and_announced)
{
    open_scene(1, 1);
    struct message message = view_message(4);
    message.render.view.attachments = 7;
    message.render.view.depth_form = PROTOCOL_DEPTH_FORM_INVERSE;
    message.render.view.depth_pixels = 2;
    message.render.view.depth_radius = 0.5f;
    message.render.view.hidden_layers = 2;
    message.render.view.margin = 0.25f;
    send_message(3, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_int_equal(command->job.view.depth_form, DEPTH_FORM_INVERSE);
    assert_true(command->job.view.depth_pixels == 2.0f && command->job.view.depth_radius == 0.5f);
    assert_int_equal(command->job.frame.attachments,
                     1u << ATTACHMENT_DEPTH | 1u << ATTACHMENT_NORMALS | 1u << ATTACHMENT_STICKING);
    assert_true(command->job.view.hidden_layers == 2 && command->job.view.margin == 0.25f);
    say_frame_with(3, 1, 30, 20, 10);
    struct message_frame_begin begin;
    expect_frame(3, 1, &begin);
    assert_int_equal(begin.attachments, 7);
    assert_int_equal(begin.size_bytes, FRAME_BYTES - 60);
    assert_int_equal(begin.depth_bytes, 30);
    assert_int_equal(begin.normal_bytes, 20);
    assert_int_equal(begin.sticking_bytes, 10);
    assert_int_equal(begin.depth_form, PROTOCOL_DEPTH_FORM_INVERSE);
    assert_true(begin.depth_step == 0.25f && begin.margin_x == 7 && begin.margin_y == 5);
}

SESSION_TEST(a_margin_goes_with_several_views)
{
    open_scene(1, 1);
    struct message message = view_message(4);
    message.render.view.margin = 0.25f;
    message.render.picture.views_across = 2;
    message.render.picture.baseline = 1;
    send_message(4, 0, &message);
    struct engine_command *command = told(ENGINE_JOB_START);
    assert_true(command->job.view.margin == 0.25f && command->job.frame.picture.views_across == 2);
}

/* Frames of 512 x 512 may use 7 places; the limit is 10 MiB. */
SESSION_TEST(views_have_room_for_their_frames_or_are_refused)
{
    open_scene(1, 1);
    struct message message = view_message(1);
    message.render.picture.width = message.render.picture.height = 512;
    send_message(2, 0, &message);
    expect_told_start(2, JOB_VIEW);
    message.render.channel = CHANNEL + 1;
    expect_refused(3, &message, PROTOCOL_ERROR_BUSY, "render");
    message.render.channel = CHANNEL; /* in the place of the first it fits */
    send_message(4, 0, &message);
    expect_told_start(4, JOB_VIEW);
    say(ENGINE_DONE, 2, ERROR_NONE);
    expect(MESSAGE_OK, 2);
    say(ENGINE_FAILED, 4, ERROR_CANCELLED);
    expect_error(4, PROTOCOL_ERROR_CANCELLED);
    message.render.channel = CHANNEL + 1;
    send_message(5, 0, &message);
    expect_told_start(5, JOB_VIEW);
}

/* ---- anything at any time ---------------------------------------------------------------------------- */

#define REQUESTS 300
#define VIEWS 2

/* An engine that does what engine.h says, at times that chance decides, and what its client has heard. */
static struct {
    uint64_t chance;
    struct {
        struct view_mailbox *mailbox; /* not owned; NULL: there is no view */
        uint32_t request, next_frame;
        uint64_t credit, made;
    } views[VIEWS];
    bool asked[REQUESTS], answered[REQUESTS];
    unsigned view_of[REQUESTS]; /* where it asks for a view */
    uint32_t under_way[VIEWS];  /* request whose frame is coming on a channel; 0: none */
    uint64_t frame_bytes[VIEWS], credit[VIEWS], frames[VIEWS];
    uint64_t camera;
} play;

static unsigned roll(unsigned sides)
{
    /* Numerical Recipes' 64-bit congruential generator; its upper bits are good enough for dice. */
    play.chance = play.chance * UINT64_C(3202034522624059733) + UINT64_C(4354685564936845319);
    return (unsigned)(play.chance >> 33) % sides;
}

static void start_or_refuse(struct engine_command *command)
{
    unsigned place = VIEWS, empty = VIEWS;
    for (unsigned i = 0; i < VIEWS; i++) {
        if (play.views[i].mailbox == command->job.mailbox)
            place = i;
        else if (!play.views[i].mailbox)
            empty = i;
    }
    if (!roll(4)) {
        say(ENGINE_FAILED, command->request, ERROR_UNSUPPORTED);
        return;
    }
    if (place < VIEWS)
        say(ENGINE_DONE, play.views[place].request, ERROR_NONE);
    else
        place = empty;
    assert_true(place < VIEWS);
    play.views[place].mailbox = command->job.mailbox;
    play.views[place].request = command->request;
    play.views[place].credit = command->job.credit;
    play.views[place].made = 0;
}

static void end_view(uint32_t request, enum error_code why)
{
    for (unsigned i = 0; i < VIEWS; i++) {
        if (play.views[i].mailbox && play.views[i].request == request) {
            say(ENGINE_FAILED, request, why);
            play.views[i].mailbox = NULL;
        }
    }
}

static void play_engine(void)
{
    for (struct engine_command *command; roll(8) && (command = queue_try_pop(engine.commands));) {
        if (command->kind == ENGINE_JOB_START) {
            start_or_refuse(command);
        } else if (command->kind == ENGINE_JOB_CANCEL) {
            end_view(command->target_request, ERROR_CANCELLED);
            say(ENGINE_DONE, command->request, ERROR_NONE);
        }
        for (unsigned i = 0; i < VIEWS && command->kind == ENGINE_JOB_CREDIT; i++) {
            if (play.views[i].mailbox && play.views[i].request == command->target_request)
                play.views[i].credit = command->credit;
        }
        engine_command_destroy(command);
    }
    for (unsigned i = 0; i < VIEWS; i++) {
        if (!play.views[i].mailbox)
            continue;
        if (!roll(40)) {
            end_view(play.views[i].request, ERROR_OUT_OF_MEMORY);
        } else if (play.views[i].made < play.views[i].credit && roll(2)) {
            play.views[i].made++;
            say_frame_of(play.views[i].request, play.views[i].next_frame++, 0, roll(3) ? 1000 : 1000000);
        }
    }
}

/* Takes all that has come: one answer to each request, whole frames, nothing after an answer. */
static void play_client(void)
{
    for (const struct message *message; (message = receive_now());) {
        const uint32_t request = client.header.request, view = client.header.channel - CHANNEL;
        switch (message->type) {
        case MESSAGE_OK:
        case MESSAGE_ERROR:
            assert_true(request < REQUESTS && play.asked[request]);
            assert_false(play.answered[request]);
            play.answered[request] = true;
            /* Another view may follow on its channel, with all the credit that was ever given there. */
            if (message->type == MESSAGE_ERROR)
                play.frames[play.view_of[request]] = 0;
            break;
        case MESSAGE_FRAME_BEGIN:
            assert_true(view < VIEWS && request < REQUESTS && !play.answered[request]);
            /* A frame that is not finished belongs to a request that was answered: it is void. */
            assert_true(!play.under_way[view] || play.answered[play.under_way[view]]);
            play.under_way[view] = request;
            play.frame_bytes[view] = message->frame_begin.size_bytes;
            assert_true(++play.frames[view] <= play.credit[view]);
            break;
        case MESSAGE_FRAME_DATA:
            assert_true(view < VIEWS && play.under_way[view] == request && !play.answered[request]);
            play.frame_bytes[view] -= message->frame_data.data_bytes;
            break;
        case MESSAGE_FRAME_END:
            assert_true(view < VIEWS && play.under_way[view] == request && !play.answered[request]);
            assert_int_equal(play.frame_bytes[view] > 0, message->frame_end.abandoned);
            play.under_way[view] = 0;
            play.frames[view] -= message->frame_end.abandoned;
            if (!message->frame_end.abandoned)
                send_ack_on(client.header.channel, message->frame_end.frame);
            break;
        default:
            fail_msg("%s came", message_type_text(message->type));
        }
    }
}

static void ask(uint32_t request)
{
    unsigned view = roll(VIEWS);
    struct message message = view_message(0);
    play.asked[request] = true;
    play.view_of[request] = view;
    if (roll(3)) {
        message.render.channel = CHANNEL + view;
        message.render.credit = roll(4);
        play.credit[view] += message.render.credit; /* at most: it may be refused, or no more than there was */
    } else {
        message = made(MESSAGE_CANCEL);
        message.cancel.target_request = request > 6 ? request - 1 - roll(5) : 1;
    }
    send_message(request, 0, &message);
    message = made(MESSAGE_CREDIT);
    message.credit.channel = CHANNEL + view;
    message.credit.total = play.credit[view] += roll(3);
    if (roll(2))
        send_message(0, 0, &message);
    if (roll(2))
        send_camera_on(CHANNEL + view, ++play.camera, roll(2));
}

static bool all_answered(void)
{
    for (uint32_t request = 2; request < REQUESTS; request++) {
        if (play.asked[request] && !play.answered[request])
            return false;
    }
    return true;
}

static void play_from(uint64_t chance)
{
    memset(&play, 0, sizeof(play));
    play.chance = chance;
    uint32_t request = 2;
    for (; request < REQUESTS / 2; request++) {
        ask(request);
        for (unsigned i = roll(4); i; i--) {
            play_engine();
            play_client();
        }
        /* Not more than may be in flight. */
        for (unsigned i = 0; i < 2000 && request % 40 == 0; i++) {
            play_engine();
            play_client();
        }
    }
    /* Each view that is left is cancelled. */
    for (uint32_t target = 2; target < REQUESTS / 2; target++) {
        if (!play.asked[target] || play.answered[target])
            continue;
        struct message message = made(MESSAGE_CANCEL);
        message.cancel.target_request = target;
        play.asked[request] = true;
        send_message(request++, 0, &message);
    }
    uint64_t give_up_ns = clock_now_ns() + UINT64_C(60000000000);
    while (!all_answered() && clock_now_ns() < give_up_ns) {
        play_engine();
        play_client();
        usleep(100);
    }
    for (uint32_t i = 2; i < request; i++) {
        if (!play.answered[i])
            fail_msg("request %u has no answer; chance began with %d", i, (int)chance);
    }
    assert_int_equal(served.hub.frame_bytes, 0);
}

SESSION_TEST(whatever_happens_each_request_has_one_answer)
{
    open_scene(1, 1);
    for (uint64_t chance = 1; chance <= 10; chance++)
        play_from(chance);
}
