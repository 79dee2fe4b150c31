/* SPDX-License-Identifier: MIT */
/* A session from hello to goodbye, over a socketpair, with an engine that answers what it is told to: requests and
 * their answers, whom the daemon waits for how long, keys. */
#include "tests/unit/session/answering_engine.h"

#include "session/dispatch.h"
#include "session/session.h"
#include "tests/harness/test.h"

/* ---- requests ---------------------------------------------------------------------------------------- */

static int real_calls(void **state)
{
    (void)state;
    real = sys;
    return 0;
}
EACH_TEST(real_calls, tear_down)

SESSION_TEST(a_ping_and_a_request_for_stats_are_answered)
{
    expect_alive(7);
    struct message message = made(MESSAGE_STATS);
    send_message(8, 0, &message);
    expect(MESSAGE_STATS_REPLY, 8);
    assert_int_equal(client.message.stats_reply.clients_count, 1);
    assert_non_null(
        strstr(client.message.stats_reply.clients[0].name, client.link ? "test (key, user " : "test (user "));
    assert_string_equal(client.message.stats_reply.device, "none");
}

SESSION_TEST(cancels_of_cancels_are_answered_in_their_order)
{
    atomic_store(&engine.keep_commits, true);
    open_scene(1, 1);
    begin_edit(2, 1);
    commit(2);
    for (uint32_t request = 3; request <= 60; request++) {
        struct message message = made(MESSAGE_CANCEL);
        message.cancel.target_request = request - 1;
        send_message(request, 0, &message);
    }
    expect_alive(61);
    release_commit();
    for (uint32_t request = 2; request <= 60; request++)
        expect(MESSAGE_OK, request);
}

SESSION_TEST(a_full_engine_makes_clients_wait_and_loses_nothing)
{
    atomic_store(&engine.full, true);
    struct message message = made(MESSAGE_SCENE_OPEN);
    for (uint32_t scene = 1; scene <= 2; scene++) {
        message.scene_open.scene = scene;
        send_message(scene, 0, &message);
    }
    usleep(20000);
    atomic_store(&engine.full, false);
    expect(MESSAGE_OK, 1);
    expect(MESSAGE_OK, 2);
    expect_alive(3);
}

/* A client with many commands that the engine has no room for is not read from, others are. */
SESSION_TEST(a_client_is_read_on_once_the_engine_has_taken_its_commands)
{
    enum { COMMANDS = 64, PINGS = 100, LAST = 1 + COMMANDS + PINGS };
    atomic_store(&engine.full, true);
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = 1;
    send_message(1, 0, &message);
    expect_alive(LAST + 1);
    message = made(MESSAGE_EDIT_COMMIT);
    for (uint32_t request = 2; request <= COMMANDS; request++) {
        begin_edit(request, 1);
        send_message(request, 0, &message);
    }
    usleep(20000);
    message = made(MESSAGE_PING);
    for (uint32_t request = COMMANDS + 1; request <= LAST; request++)
        send_message(request, 0, &message);
    usleep(20000);
    assert_null(receive_now());
    atomic_store(&engine.full, false);
    /* Pings are answered beside the engine. */
    for (uint32_t answered = 1, pong = COMMANDS + 1; answered <= COMMANDS || pong <= LAST;) {
        bool is_pong = receive()->type == MESSAGE_PONG;
        assert_int_equal(client.header.request, is_pong ? pong : answered);
        pong += is_pong;
        answered += !is_pong;
    }
}

SESSION_TEST(garbage_is_answered_by_an_error_and_closes_the_connection)
{
    uint8_t bytes[64];
    memset(bytes, 0xff, sizeof(bytes));
    send_bytes(bytes, sizeof(bytes));
    expect_error(0, PROTOCOL_ERROR_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

SESSION_TEST(a_request_number_in_flight_cannot_be_used_again)
{
    open_scene(1, 1);
    begin_edit(2, 1);
    begin_edit(2, 1);
    expect_error(0, PROTOCOL_ERROR_PROTOCOL);
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}

SESSION_TEST(the_65th_request_in_flight_is_refused_and_can_be_retried)
{
    open_scene(1, 1);
    for (uint32_t request = 2; request <= 65; request++)
        begin_edit(request, 1);
    begin_edit(66, 1);
    expect_error(66, PROTOCOL_ERROR_LIMIT);
    assert_int_equal(client.message.error.retryable, 1);
    send_node(66, 1, 0);
    commit(66);
    commit(2);
    expect(MESSAGE_OK, 2);
}

SESSION_TEST(a_client_that_vanishes_is_forgotten)
{
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    expect(MESSAGE_FRAME_BEGIN, 2);
    shutdown(client.fd, SHUT_RDWR);
    pthread_join(thread, NULL); /* the daemon of a single client ends with it */
    assert_int_equal(atomic_load(&engine.gone), 1);
    assert_int_equal(pthread_create(&thread, NULL, run, NULL), 0);
}

TEST_WITH(every_message_of_a_client_has_a_row, NULL, NULL)
{
    for (uint32_t type = 0; type <= UINT16_MAX; type++) {
        const struct message_info *info = message_lookup(type);
        bool from_client = info && (info->from & MESSAGE_FROM_CLIENT);
        if (from_client != (dispatch_find(type) != NULL))
            fail_msg("%s (%u): from a client: %d, row: %d", message_type_text(type), type, from_client,
                     !from_client);
    }
}

/* ---- patience ---------------------------------------------------------------------------------------- */

/* Sooner than anything but what the test limits would close it. */
static void expect_closed(void)
{
    struct pollfd fd = {.fd = client.fd, .events = POLLIN};
    uint8_t bytes[4096];
    ssize_t got;
    do
        assert_int_equal(poll(&fd, 1, 20000), 1);
    while ((got = recv(client.fd, bytes, sizeof(bytes), 0)) > 0);
}

TEST(a_client_without_a_hello_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.handshake_ms = 50;
    start(&limits);
    send_bytes("FARL", 4);
    expect_closed();
}

TEST(a_client_with_an_unfinished_message_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 50;
    limits.progress_bytes_per_s = 1000000;
    start(&limits);
    greet();
    uint8_t header[FRAMING_HEADER_BYTES];
    framing_header_encode(header,
                          &(struct framing_header){.type = MESSAGE_PING, .payload_bytes = 10, .request = 1});
    send_bytes(header, sizeof(header));
    expect_error(0, PROTOCOL_ERROR_TIMEOUT);
    expect(MESSAGE_GOODBYE, 0);
    expect_closed();
}

TEST(a_client_that_the_daemon_does_not_read_has_its_time_later)
{
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 100;
    limits.progress_bytes_per_s = 1000000;
    limits.queued_soft_bytes = 1000;
    start(&limits);
    greet();
    open_scene(1, 1);
    uint8_t bytes[1024];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    struct message message = render_message(5, 6);
    assert_true(message_write(&writer, 2, 0, &message));
    size_t begun_bytes = writer.used_bytes + 20;
    message = made(MESSAGE_PING);
    assert_true(message_write(&writer, 3, 0, &message));
    send_bytes(bytes, begun_bytes); /* the frames fill the way back, the ping is cut off */
    usleep(400000);
    send_bytes(bytes + begun_bytes, writer.used_bytes - begun_bytes);
    bool pong = false, done = false;
    while (!pong || !done) {
        const struct message *got = receive();
        if (got->type == MESSAGE_ERROR || got->type == MESSAGE_GOODBYE)
            fail_msg("%s", got->type == MESSAGE_ERROR ? got->error.text : got->goodbye.text);
        pong = pong || got->type == MESSAGE_PONG;
        done = done || got->type == MESSAGE_OK;
    }
}

TEST(a_silent_client_is_disconnected_unless_it_waits)
{
    struct connection_limits limits = patient;
    limits.idle_ms = 3000; /* longer than a busy machine takes to send two messages */
    start(&limits);
    greet();
    atomic_store(&engine.keep_jobs, true);
    open_scene(1, 1);
    struct message message = render_message(5, 10);
    send_message(2, 0, &message);
    usleep(4300000); /* past the idle time, and past the second in between two looks */
    expect_alive(3);
    cancel(4, 2);
    expect_error(2, PROTOCOL_ERROR_CANCELLED);
    expect(MESSAGE_OK, 4);
    expect_error(0, PROTOCOL_ERROR_TIMEOUT);
    expect(MESSAGE_GOODBYE, 0);
    expect_closed();
}

static void answer_ping(void)
{
    const unsigned before = client.pings;
    while (client.pings == before) {
        struct pollfd fd = {.fd = client.fd, .events = POLLIN};
        assert_int_equal(poll(&fd, 1, 60000), 1);
        if (receive_now())
            fail_msg("%s came in place of a ping", message_type_text(client.message.type));
    }
    struct message message = made(MESSAGE_PONG);
    send_message(0, 0, &message);
}

/* Two pings without an answer, each a third of the time after the one before. */
TEST(a_client_that_waits_and_answers_no_ping_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.lost_ms = 3000; /* longer than a busy machine takes to answer */
    start(&limits);
    greet();
    atomic_store(&engine.keep_jobs, true);
    open_scene(1, 1);
    struct message message = render_message(5, 10);
    send_message(2, 0, &message);
    answer_ping();
    answer_ping();
    expect_error(0, PROTOCOL_ERROR_TIMEOUT);
    assert_non_null(strstr(client.message.error.text, "3 seconds"));
    assert_int_equal(client.pings, 4);
    expect(MESSAGE_GOODBYE, 0);
    expect_closed();
}

TEST(a_client_that_waits_for_nothing_is_not_pinged)
{
    struct connection_limits limits = patient;
    limits.lost_ms = 90;
    start(&limits);
    greet();
    usleep(400000);
    expect_alive(1);
    assert_int_equal(client.pings, 0);
}

/* Its own pings wait with its commands. */
TEST(a_client_that_is_not_read_from_hears_that_the_daemon_is_there)
{
    enum { COMMANDS = 64 };
    start(&patient);
    greet();
    atomic_store(&engine.full, true);
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = 1;
    send_message(1, 0, &message);
    message = made(MESSAGE_EDIT_COMMIT);
    for (uint32_t request = 2; request <= COMMANDS; request++) {
        begin_edit(request, 1);
        send_message(request, 0, &message);
    }
    answer_ping();
    answer_ping();
    atomic_store(&engine.full, false);
    for (uint32_t request = 1; request <= COMMANDS; request++)
        expect(MESSAGE_OK, request);
    expect_alive(COMMANDS + 1);
}

TEST(a_client_that_does_not_read_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.queued_soft_bytes = 1000;
    limits.queued_soft_ms = 100;
    start(&limits);
    greet();
    open_scene(1, 1);
    struct message message = render_message(50, 51);
    send_message(2, 0, &message);
    for (unsigned tries = 0; atomic_load(&engine.gone) == 0 && tries < 60000; tries++)
        usleep(1000);
    expect_closed();
    assert_int_equal(atomic_load(&engine.gone), 1);
}

/* ---- keys ---------------------------------------------------------------------------------------------- */

TEST(a_sealed_client_without_a_hello_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.handshake_ms = 200;
    start_sealed(&limits, &session_key);
    expect_closed();
}

TEST(a_client_with_an_unfinished_record_is_disconnected)
{
    struct connection_limits limits = patient;
    limits.progress_grace_ms = 50;
    limits.progress_bytes_per_s = 1000000;
    start_sealed(&limits, &session_key);
    greet();
    const uint8_t length_and_a_byte[5] = {200};
    send_plainly(length_and_a_byte, sizeof(length_and_a_byte));
    expect_closed();
}

TEST(a_changed_record_is_reported_and_closes_the_connection)
{
    start_sealed(&patient, &session_key);
    greet();
    uint8_t record[21] = {17};
    send_plainly(record, sizeof(record));
    expect_error(0, PROTOCOL_ERROR_PROTOCOL);
    assert_string_equal(client.message.error.field, "record");
    expect(MESSAGE_GOODBYE, 0);
    expect_end();
}
