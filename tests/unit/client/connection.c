/* SPDX-License-Identifier: MIT */
/* The library against a daemon that a thread of the test plays: right and wrong answers, half messages, ends. */
#include "tests/unit/client/played_daemon.h"
#include "tests/harness/test.h"

#include <stdatomic.h>
#include <sys/eventfd.h>
#include <xxhash.h>

EACH_TEST(NULL, end_played)

/* ---- connecting ---- */

static void play_pong(struct daemon *daemon)
{
    greet(daemon);
    while (take(daemon) && asked.type == MESSAGE_PING) {
        /* Things that concern the connection may come between. */
        struct message between = {.type = MESSAGE_CREDIT};
        between.credit.channel = 1;
        between.credit.total = 12345;
        tell(daemon, 0, &between);
        between = (struct message){.type = MESSAGE_BLOCKED};
        tell(daemon, 0, &between);
        between = (struct message){.type = MESSAGE_PING};
        tell(daemon, 77, &between);
        send_type(daemon, header.request, MESSAGE_PONG);
        if (!take(daemon) || asked.type != MESSAGE_PONG || header.request != 77)
            return;
    }
}

TEST(a_ping_comes_back_and_a_ping_is_answered)
{
    connect_to_played(play_pong);
    uint64_t ns = 0;
    assert_true(fl_connection_is_local(connection));
    assert_true(fl_ping(connection, &ns, &error));
    assert_true(fl_ping(connection, &ns, &error));
    assert_int_equal(connection->upload_credit, 12345);
    fl_connection_end(connection);
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_CONNECTION, "has been ended");
}

static void play_rubbish(struct daemon *daemon)
{
    put(daemon, "HTTP/1.1 400 Bad Request\r\n\r\n", 28);
    more(daemon);
}

TEST(a_peer_that_is_no_daemon_is_reported)
{
    struct daemon *daemon = start(play_rubbish);
    assert_null(connect_to(daemon));
    check_error(FL_ERROR_PROTOCOL, "not a farlight daemon");
    stop(daemon);
}

static void play_other_version(struct daemon *daemon)
{
    struct handshake_reply reply = {.version = 0, .text = "versions 7 to 9 are spoken here"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    more(daemon);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
    more(daemon);
}

TEST(a_daemon_of_another_version_is_reported_in_its_own_words)
{
    struct daemon *daemon = start(play_other_version);
    assert_null(connect_to(daemon));
    check_error(FL_ERROR_PROTOCOL, "versions 7 to 9");
    stop(daemon);
}

static void play_silence(struct daemon *daemon)
{
    while (more(daemon))
        continue;
}

TEST(a_silent_daemon_is_given_up_and_an_interruption_ends_the_wait)
{
    struct daemon *daemon = start(play_silence);
    error = (struct fl_error){0};
    assert_null(fl_connect(&(struct fl_connect_options){.server = daemon->address, .timeout_ms = 50}, &error));
    check_error(FL_ERROR_TIMEOUT, "does not answer");
    stop(daemon);
    daemon = start(play_silence);
    const int interrupt_fd = eventfd(1, EFD_CLOEXEC);
    assert_null(
        fl_connect(&(struct fl_connect_options){.server = daemon->address, .interrupt_fd = interrupt_fd}, &error));
    check_error(FL_ERROR_INTERRUPTED, "");
    close(interrupt_fd);
    stop(daemon);
}

/* ---- a daemon that falls silent ---- */

static unsigned pings;

static void connect_with(void (*play)(struct daemon *daemon), unsigned lost_after_ms)
{
    pings = 0;
    error = (struct fl_error){0};
    played = start(play);
    connection = fl_connect(
        &(struct fl_connect_options){.server = played->address, .lost_after_ms = lost_after_ms}, &error);
    assert_non_null(connection);
}

static void play_deaf(struct daemon *daemon)
{
    greet(daemon);
    while (take(daemon))
        pings += asked.type == MESSAGE_PING;
}

TEST(a_daemon_that_answers_no_ping_counts_as_lost)
{
    connect_with(play_deaf, 300);
    assert_false(fl_connection_wait(connection, 600000, &error));
    check_error(FL_ERROR_CONNECTION, "for 0.3 s");
    assert_true(error.retryable);
    leave_played(); /* from here on its thread counts no more */
    assert_int_equal(pings, 2);
}

TEST(a_program_that_waits_in_short_turns_finds_a_lost_daemon_too)
{
    connect_with(play_deaf, 300);
    while (fl_connection_wait(connection, 1, &error))
        continue;
    check_error(FL_ERROR_CONNECTION, "for 0.3 s");
}

static void play_only_pongs(struct daemon *daemon)
{
    greet(daemon);
    while (take(daemon)) {
        pings += asked.type == MESSAGE_PING;
        send_type(daemon, header.request, MESSAGE_PONG);
    }
}

TEST(a_daemon_that_answers_pings_is_waited_for)
{
    connect_with(play_only_pongs, 3000); /* longer than a busy machine takes to answer */
    assert_true(fl_connection_wait(connection, 3500, &error));
    leave_played();
    assert_in_range(pings, 1, 3);
}

TEST(time_in_which_nobody_listens_is_no_silence_of_the_daemons)
{
    connect_with(play_deaf, 900);
    usleep(1000000);
    assert_true(fl_connection_wait(connection, 0, &error));
}

TEST(wrong_addresses_are_reported)
{
    static const char *const wrong[] = {
        "",         "unix:",      "tcp:",           "tcp:host",    "tcp:host:",
        "tcp::1",   "tcp:host:0", "tcp:host:65536", "tcp:host:1x", "tcp:::1:5",
        "http://x", "ssh:",       "ssh:-oX",        "ssh:host:",   "ssh:host:/a;rm"};
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        error = (struct fl_error){0};
        struct fl_connection *made =
            fl_connect(&(struct fl_connect_options){.server = wrong[i], .timeout_ms = 100}, &error);
        if (made || error.code != FL_ERROR_ARGUMENT)
            fail_msg("'%s': error %d '%s'", wrong[i], (int)error.code, error.text);
    }
    assert_null(fl_connect(&(struct fl_connect_options){.server = "unix:/nonexistent/socket"}, &error));
    check_error(FL_ERROR_CONNECTION, "No such file");
    assert_null(fl_connect(&(struct fl_connect_options){.server = "unix:/dev/null/socket"}, &error));
    check_error(FL_ERROR_SYSTEM, "Not a directory");
}

/* ---- a connection that ends ---- */

static void play_half_message(struct daemon *daemon)
{
    struct message pong = {.type = MESSAGE_PONG};
    uint8_t bytes[128];
    greet(daemon);
    if (take(daemon))
        put(daemon, bytes, pack(bytes, sizeof(bytes), header.request, &pong) - 9);
}

TEST(half_an_answer_is_a_lost_connection_and_stays_one)
{
    connect_to_played(play_half_message);
    uint64_t ns = 0;
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_CONNECTION, "in the middle of a message");
    error = (struct fl_error){0};
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_CONNECTION, "in the middle of a message");
}

static void play_goodbye(struct daemon *daemon)
{
    struct message goodbye = {.type = MESSAGE_GOODBYE};
    goodbye.goodbye.code = PROTOCOL_ERROR_SHUTTING_DOWN;
    goodbye.goodbye.text = "maintenance";
    greet(daemon);
    take(daemon);
    tell(daemon, 0, &goodbye);
}

TEST(a_goodbye_is_reported_and_may_be_retried)
{
    connect_to_played(play_goodbye);
    uint64_t ns = 0;
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_CONNECTION, "maintenance");
    assert_true(error.retryable);
}

static void play_busy(struct daemon *daemon)
{
    struct message refusal = {.type = MESSAGE_ERROR};
    refusal.error.code = PROTOCOL_ERROR_BUSY;
    refusal.error.field = refusal.error.remedy = "";
    refusal.error.text = "no place";
    greet(daemon);
    take(daemon);
    tell(daemon, 0, &refusal);
}

static void play_turning_away(struct daemon *daemon)
{
    struct handshake_reply reply = {.capabilities = HANDSHAKE_TRY_AGAIN, .text = "all places are taken"};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    more(daemon);
    put(daemon, bytes, handshake_reply_encode(bytes, &reply));
    more(daemon);
}

static void play_hanging_up(struct daemon *daemon)
{
    more(daemon);
}

TEST(a_daemon_without_a_place_or_a_word_may_be_tried_again)
{
    connect_to_played(play_busy);
    uint64_t ns = 0;
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_REFUSED, "no place");
    assert_true(error.retryable);
    leave_played();
    struct daemon *daemon = start(play_turning_away);
    assert_null(connect_to(daemon));
    check_error(FL_ERROR_REFUSED, "all places are taken");
    assert_true(error.retryable);
    stop(daemon);
    daemon = start(play_hanging_up);
    assert_null(connect_to(daemon));
    check_error(FL_ERROR_CONNECTION, "closed the connection");
    assert_true(error.retryable);
    stop(daemon);
}

static void play_oversize(struct daemon *daemon)
{
    const struct framing_header wrong = {.payload_bytes = 0x7fffffff, .type = MESSAGE_PONG};
    uint8_t bytes[FRAMING_HEADER_BYTES];
    greet(daemon);
    take(daemon);
    framing_header_encode(bytes, &wrong);
    put(daemon, bytes, sizeof(bytes));
    more(daemon);
}

TEST(a_broken_protocol_is_reported)
{
    connect_to_played(play_oversize);
    uint64_t ns = 0;
    assert_false(fl_ping(connection, &ns, &error));
    check_error(FL_ERROR_PROTOCOL, "does not allow");
}

static void play_refusal(struct daemon *daemon)
{
    struct message refusal = {.type = MESSAGE_ERROR};
    refusal.error.code = PROTOCOL_ERROR_BUSY;
    refusal.error.retryable = 1;
    refusal.error.retry_after_ms = 250;
    refusal.error.field = "stats";
    refusal.error.text = "too many at once";
    refusal.error.remedy = "wait";
    greet(daemon);
    while (take(daemon) && asked.type == MESSAGE_STATS)
        tell(daemon, header.request, &refusal);
}

TEST(a_refusal_keeps_its_code_field_remedy_and_the_connection)
{
    connect_to_played(play_refusal);
    const struct message_stats_reply *reply = NULL;
    for (int i = 0; i < 2; i++) {
        error = (struct fl_error){0};
        assert_false(fl_stats(connection, &reply, &error));
        check_error(FL_ERROR_REFUSED, "too many at once");
        assert_int_equal(error.server_code, PROTOCOL_ERROR_BUSY);
        assert_true(error.retryable);
        assert_int_equal(error.retry_after_ms, 250);
        assert_string_equal(error.field, "stats");
        assert_string_equal(error.remedy, "wait");
    }
}

/* ---- jobs ---- */

#define EDGE 16u
static uint8_t pixels[EDGE * EDGE * 4];

static void send_frame(struct daemon *daemon, uint32_t request, uint32_t number)
{
    struct message message = {.type = MESSAGE_FRAME_BEGIN};
    message.frame_begin = (struct message_frame_begin){.frame = number,
                                                       .width = EDGE,
                                                       .height = EDGE,
                                                       .samples = 1,
                                                       .layers = 1,
                                                       .size_bytes = sizeof(pixels),
                                                       .digest = XXH3_64bits(pixels, sizeof(pixels))};
    tell(daemon, request, &message);
    message = (struct message){.type = MESSAGE_FRAME_DATA};
    message.frame_data.data = pixels;
    message.frame_data.data_bytes = sizeof(pixels);
    tell(daemon, request, &message);
    message = (struct message){.type = MESSAGE_FRAME_END};
    message.frame_end.frame = number;
    tell(daemon, request, &message);
}

static atomic_bool has_sent_frames;

/* Frames as far as credit goes, the answer after the last; a cancel is answered as the protocol says. */
static void play_job(struct daemon *daemon)
{
    uint32_t request = 0, next = 0, last = 0, step = 1;
    uint64_t credit = 0, sent = 0;
    greet(daemon);
    while (take(daemon)) {
        if (asked.type == MESSAGE_RENDER) {
            request = header.request;
            next = asked.render.first_frame;
            last = asked.render.last_frame;
            step = asked.render.frame_step;
            credit = asked.render.credit;
        } else if (asked.type == MESSAGE_CREDIT) {
            credit = asked.credit.total;
        } else if (asked.type == MESSAGE_CANCEL && asked.cancel.target_request == request) {
            struct message refusal = {.type = MESSAGE_ERROR}, done = {.type = MESSAGE_OK};
            refusal.error.code = PROTOCOL_ERROR_CANCELLED;
            tell(daemon, request, &refusal);
            tell(daemon, header.request, &done);
            request = 0;
        }
        for (; request != 0 && next <= last && sent < credit; next += step, sent++)
            send_frame(daemon, request, next);
        if (sent > 0)
            atomic_store(&has_sent_frames, true);
        if (request != 0 && next > last) {
            send_type(daemon, request, MESSAGE_OK);
            request = 0;
        }
    }
}

static struct fl_job *start_job(struct fl_scene *scene, uint32_t first, uint32_t last, uint32_t step)
{
    struct message_render wanted = fl_render_defaults();
    wanted.picture.width = wanted.picture.height = EDGE;
    wanted.first_frame = first;
    wanted.last_frame = last;
    wanted.frame_step = step;
    error = (struct fl_error){0};
    return fl_render_start(scene, &wanted, &error);
}

TEST(every_frame_of_a_job_comes_once_and_in_order)
{
    connect_to_played(play_job);
    struct fl_scene scene = {.connection = connection, .scene = 1};
    struct fl_job *job = start_job(&scene, 10, 30, 4);
    assert_non_null(job);
    assert_null(start_job(&scene, 0, 1, 1)); /* a second job is refused */
    for (uint32_t number = 10; number <= 30; number += 4) {
        struct fl_frame *frame = fl_render_next(job, &error);
        if (!frame)
            fail_msg("frame %u: %s", number, error.text);
        assert_int_equal(frame->frame, number);
        fl_frame_destroy(frame);
    }
    assert_null(fl_render_next(job, &error));
    assert_int_equal(error.code, FL_ERROR_NONE);
    fl_render_destroy(job);
}

TEST(an_interruption_is_seen_while_frames_are_there_without_a_wait)
{
    const int interrupt_fd = eventfd(0, EFD_CLOEXEC);
    atomic_store(&has_sent_frames, false);
    connect_to_played(play_job);
    fl_connection_set_interrupt(connection, interrupt_fd);
    struct fl_scene scene = {.connection = connection, .scene = 1};
    struct fl_job *job = start_job(&scene, 0, 1000, 1);
    while (!atomic_load(&has_sent_frames))
        usleep(1000);
    struct fl_frame *frame = fl_render_next(job, &error);
    assert_non_null(frame); /* and the next one came with it */
    fl_frame_destroy(frame);
    assert_int_equal(eventfd_write(interrupt_fd, 1), 0);
    assert_null(fl_render_next(job, &error));
    check_error(FL_ERROR_INTERRUPTED, "");
    fl_connection_set_interrupt(connection, 0);
    frame = fl_render_next(job, &error);
    assert_non_null(frame);
    assert_int_equal(frame->frame, 1);
    fl_frame_destroy(frame);
    fl_render_destroy(job);
    close(interrupt_fd);
}

TEST(after_a_cancel_the_connection_can_be_used_again)
{
    connect_to_played(play_job);
    struct fl_scene scene = {.connection = connection, .scene = 1};
    struct fl_job *job = start_job(&scene, 0, 1000, 1);
    struct fl_frame *frame = fl_render_next(job, &error);
    assert_non_null(frame);
    fl_frame_destroy(frame);
    if (!fl_render_cancel(job, &error))
        fail_msg("cancel: %s", error.text);
    assert_null(fl_render_next(job, &error));
    assert_int_equal(error.code, FL_ERROR_NONE);
    fl_render_destroy(job);
}

/* Expects a broken connection after a frame of a job of six. */
static void expect_broken_after_a_frame(void (*play)(struct daemon *daemon), const char *part)
{
    connect_to_played(play);
    struct fl_scene scene = {.connection = connection, .scene = 1};
    struct fl_job *job = start_job(&scene, 0, 5, 1);
    struct fl_frame *frame = fl_render_next(job, &error);
    assert_non_null(frame);
    fl_frame_destroy(frame);
    assert_null(fl_render_next(job, &error));
    check_error(FL_ERROR_PROTOCOL, part);
    fl_render_destroy(job);
}

static void play_wrong_frame(struct daemon *daemon)
{
    greet(daemon);
    if (!take(daemon))
        return;
    send_frame(daemon, header.request, 0);
    send_frame(daemon, header.request, 0); /* twice */
    while (more(daemon))
        continue;
}

TEST(a_repeated_frame_is_a_broken_protocol)
{
    expect_broken_after_a_frame(play_wrong_frame, "frame 0 arrived, but frame 1 was expected");
}

static void play_early_end(struct daemon *daemon)
{
    struct message done = {.type = MESSAGE_OK};
    greet(daemon);
    if (!take(daemon))
        return;
    send_frame(daemon, header.request, 0);
    tell(daemon, header.request, &done);
    while (more(daemon))
        continue;
}

TEST(a_job_that_ends_too_early_has_lost_frames)
{
    expect_broken_after_a_frame(play_early_end, "before its last frame");
}

TEST(a_camera_is_found_by_name_before_number)
{
    struct fl_camera_info cameras[3] = {
        {.node = 10, .name = "front"}, {.node = 11, .name = "0"}, {.node = 12, .name = ""}};
    const struct fl_scene scene = {.cameras = cameras, .camera_count = 3};
    uint32_t node = 0;
    assert_true(fl_scene_find_camera(&scene, "front", &node, &error));
    assert_int_equal(node, 10);
    assert_true(fl_scene_find_camera(&scene, "0", &node, &error));
    assert_int_equal(node, 11);
    assert_true(fl_scene_find_camera(&scene, "2", &node, &error));
    assert_int_equal(node, 12);
    assert_false(fl_scene_find_camera(&scene, "3", &node, &error));
    assert_false(fl_scene_find_camera(&scene, "-1", &node, &error));
    check_error(FL_ERROR_ARGUMENT, "'-1'");
}
