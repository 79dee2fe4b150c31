/* SPDX-License-Identifier: MIT */
/* A daemon on a thread of its own, whose engine the including test stands in for, and a client of it here. Tests
 * run with the system calls as they are and with each of them cut short and interrupted, open and sealed. */
#ifndef FARLIGHT_TESTS_SESSION_FIXTURE_H
#define FARLIGHT_TESTS_SESSION_FIXTURE_H

#include "base/sys.h"
#include "protocol/sealed/link.h"
#include "session/daemon.h"

#include <errno.h>
#include <poll.h>
#include <pthread.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmocka.h>

/* The test's. */
static struct engine_port engine_begin(void);
static void engine_end(void);

/* ---- faults ------------------------------------------------------------------------------------------ */

static struct sys_calls real;
static atomic_uint calls;

static inline bool interrupted(void)
{
    if (atomic_fetch_add(&calls, 1) % 3)
        return false;
    errno = EINTR;
    return true;
}

static inline ssize_t short_read(int fd, void *data, size_t bytes)
{
    size_t minimum = atomic_load(&calls) % 5 + 1;
    size_t maximum = bytes > 65536 ? bytes - 12345 : minimum; /* small messages in tiny parts, bulk in odd ones */
    return interrupted() ? -1 : real.read(fd, data, bytes < maximum ? bytes : maximum);
}

static inline ssize_t short_sendmsg(int fd, const struct msghdr *message, int flags)
{
    struct iovec part = message->msg_iov[0];
    struct msghdr shorter = {.msg_iov = &part, .msg_iovlen = 1};
    size_t maximum = part.iov_len > 4096 ? part.iov_len - 777 : atomic_load(&calls) % 7 + 1;
    part.iov_len = part.iov_len < maximum ? part.iov_len : maximum;
    return interrupted() ? -1 : real.sendmsg(fd, &shorter, flags);
}

static inline int interrupted_wait(int fd, struct epoll_event *events, int max_events, int timeout_ms)
{
    return interrupted() ? -1 : real.epoll_wait(fd, events, max_events > 1 ? 1 : max_events, timeout_ms);
}

/* ---- the daemon on a thread, a client here ----------------------------------------------------------- */

struct client {
    int fd;
    struct sealed_link *link; /* NULL: it is not sealed */
    uint8_t in[2 * FRAMING_MESSAGE_MAX_BYTES];
    size_t in_used, consumed;
    uint8_t scratch_data[SCRATCH_BYTES];
    struct scratch scratch;
    struct framing_header header; /* of the last message */
    struct message message;
    uint64_t upload_credit;
    unsigned blocked; /* how often it was told so, and why the last time */
    char blocked_text[129];
};

static struct daemon served;
static pthread_t thread;
static struct client client;

static inline void *run(void *context)
{
    (void)context;
    struct error error = {0};
    bool device_gone;
    daemon_run(&served, &device_gone, &error);
    return NULL;
}

static const struct sealed_key session_key = {.bytes = "whoever knows this may come in!"},
                               session_reader_key = {.bytes = "whoever knows this may look on!"};
static struct auth_keys session_keys = {
    .refs = 1, /* never the last one */
    .keys = {{.bytes = "whoever knows this may come in!"}, {.bytes = "whoever knows this may look on!"}},
    .read_only = {false, true},
    .count = 2};

/* Opens what has come; how many bytes of plain text that was. */
static inline size_t open_records(void)
{
    struct decode_error error = {0};
    size_t before = client.in_used;
    enum sealed_result result = sealed_link_handshake(client.link, &error);
    while (result == SEALED_CONSUMED && !sealed_has_opened_last(client.link->sealed)) {
        size_t bytes = 0;
        result = sealed_link_open(client.link, client.in + client.in_used, sizeof(client.in) - client.in_used,
                                  &bytes, &error);
        client.in_used += bytes;
    }
    if (result == SEALED_FATAL || result == SEALED_REFUSED)
        fail_msg("%s: %s", error.field, error.text);
    return client.in_used - before;
}

/* False: the daemon has closed the connection. */
static inline bool receive_sealed(void)
{
    size_t free_bytes;
    uint8_t *space = sealed_link_space(client.link, &free_bytes);
    ssize_t got = recv(client.fd, space, free_bytes, 0);
    sealed_link_came(client.link, got > 0 ? (size_t)got : 0);
    return got > 0;
}

static inline void receive_some(void)
{
    memmove(client.in, client.in + client.consumed, client.in_used - client.consumed);
    client.in_used -= client.consumed;
    client.consumed = 0;
    if (client.link && open_records())
        return;
    struct pollfd fd = {.fd = client.fd, .events = POLLIN};
    if (poll(&fd, 1, 20000) != 1)
        fail_msg("nothing came for 20 s");
    if (client.link) {
        if (!receive_sealed())
            fail_msg("the connection is closed");
        open_records();
        return;
    }
    ssize_t got = recv(client.fd, client.in + client.in_used, sizeof(client.in) - client.in_used, 0);
    if (got <= 0)
        fail_msg("the connection is closed");
    client.in_used += (size_t)got;
}

static inline void send_plainly(const uint8_t *next, size_t bytes)
{
    while (bytes) {
        ssize_t sent = send(client.fd, next, bytes, MSG_NOSIGNAL);
        assert_true(sent > 0);
        next += sent;
        bytes -= (size_t)sent;
    }
}

/* What waits in the link. */
static inline void send_sealed(void)
{
    size_t bytes;
    const uint8_t *waiting = sealed_link_waiting(client.link, &bytes);
    send_plainly(waiting, bytes);
    sealed_link_sent(client.link, bytes);
}

static inline void send_bytes(const void *data, size_t bytes)
{
    const uint8_t *next = data;
    if (!client.link)
        send_plainly(next, bytes);
    for (size_t taken; client.link && bytes; next += taken, bytes -= taken) {
        taken = sealed_link_seal(client.link, next, bytes);
        send_sealed();
    }
}

/* Until both have proved that they have the key. */
static inline void seal_with(const struct sealed_key *key)
{
    client.link = sealed_link_client(key);
    assert_non_null(client.link);
    while (!sealed_is_open(client.link->sealed)) {
        send_sealed();
        receive_some();
    }
}

static inline void send_message(uint32_t request, uint32_t channel, const struct message *message)
{
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    if (!message_write(&writer, request, channel, message))
        fail_msg("%s: %s", writer.error.field, writer.error.text);
    send_bytes(bytes, writer.used_bytes);
}

/* The next message but credit and blocked, NULL: none is there; it stays until the next call. */
static inline const struct message *receive_now(void)
{
    for (;;) {
        struct frame frame;
        struct decode_error error = {0};
        enum framing_result result = framing_parse(&frame, client.in + client.consumed,
                                                   client.in_used - client.consumed, MESSAGE_FROM_SERVER, &error);
        if (result == FRAMING_NEED_MORE) {
            struct pollfd fd = {.fd = client.fd, .events = POLLIN};
            if (poll(&fd, 1, 0) != 1)
                return NULL;
            receive_some();
            continue;
        }
        if (result == FRAMING_FATAL)
            fail_msg("%s: %s", error.field, error.text);
        client.consumed += frame.consumed_bytes;
        client.header = frame.header;
        scratch_init(&client.scratch, client.scratch_data, sizeof(client.scratch_data));
        if (!message_decode(&client.message, frame.header.type, frame.payload, frame.header.payload_bytes,
                            &client.scratch, &error))
            fail_msg("%s: %s", error.field, error.text);
        if (client.message.type == MESSAGE_CREDIT)
            client.upload_credit = client.message.credit.total;
        else if (client.message.type == MESSAGE_BLOCKED && ++client.blocked)
            snprintf(client.blocked_text, sizeof(client.blocked_text), "%s", client.message.blocked.text);
        else
            return &client.message;
    }
}

/* The same, but waits for it. */
static inline const struct message *receive(void)
{
    const struct message *message;
    while (!(message = receive_now())) {
        struct pollfd fd = {.fd = client.fd, .events = POLLIN};
        if (poll(&fd, 1, 20000) != 1)
            fail_msg("nothing came for 20 s");
    }
    return message;
}

static inline void expect(enum message_type type, uint32_t request)
{
    const struct message *message = receive();
    if (message->type != type || client.header.request != request)
        fail_msg("%s of request %u came instead of %s of %u: %s", message_type_text(message->type),
                 client.header.request, message_type_text(type), request,
                 message->type == MESSAGE_ERROR ? message->error.text : "");
}

static inline void expect_error(uint32_t request, enum protocol_error_code code)
{
    expect(MESSAGE_ERROR, request);
    assert_int_equal(client.message.error.code, code);
}

static inline void expect_end(void)
{
    struct pollfd fd = {.fd = client.fd, .events = POLLIN};
    assert_int_equal(client.in_used, client.consumed);
    while (client.link && receive_sealed())
        assert_int_equal(open_records(), 0);
    assert_true(!client.link || sealed_has_opened_last(client.link->sealed));
    assert_int_equal(poll(&fd, 1, 20000), 1);
    assert_int_equal(recv(client.fd, client.in, 1, 0), 0);
}

static inline struct message made(enum message_type type)
{
    struct message message;
    message_init(&message, type);
    return message;
}

static inline void expect_alive(uint32_t request)
{
    struct message message = made(MESSAGE_PING);
    message.ping.sent_ns = 1234567;
    send_message(request, 0, &message);
    expect(MESSAGE_PONG, request);
    assert_int_equal(client.message.pong.sent_ns, 1234567);
}

/* The capabilities that both have. */
static inline uint64_t greet_with(uint64_t capabilities)
{
    struct handshake_hello hello = {
        .version_min = 1, .version_max = 1, .capabilities = capabilities, .name = "test"};
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    send_bytes(bytes, handshake_hello_encode(bytes, &hello));
    struct handshake_reply reply;
    struct decode_error error = {0};
    while (handshake_reply_parse(&reply, client.in, client.in_used, &client.consumed, &error) ==
           HANDSHAKE_NEED_MORE)
        receive_some();
    assert_int_equal(reply.version, 1);
    assert_int_equal(reply.limits.requests_in_flight, 64);
    return reply.capabilities;
}

static inline void greet(void)
{
    assert_true(greet_with(HANDSHAKE_CAN_ABANDON) & HANDSHAKE_CAN_ABANDON);
}

static inline void start(const struct connection_limits *connection_limits)
{
    struct hub_options options = {
        .limits = {.clients = 4,
                   .unauthenticated = 4,
                   .unauthenticated_per_address = 4,
                   .requests_in_flight = 64,
                   .scenes_per_client = 2,
                   .jobs_per_client = 2,
                   .tracers = {.ldc_layers = 7, .ldc_mebibytes = 3, .abuffer_mebibytes = 1},
                   .blobs_per_client = 8,
                   .transaction_edits = 10,
                   .transaction_bytes = 64 << 10,
                   .nodes = 100,
                   .texture_edge_texels = 64,
                   .width_pixels = 512,
                   .height_pixels = 512,
                   .samples = 64,
                   .blob_bytes = 8 << 20,
                   .blob_cache_bytes = 4 << 20,
                   .upload_window_bytes = 1 << 20,
                   .frame_bytes = 10 << 20,
                   .frames_in_flight = 3,
                   .frame_window_bytes = 64 << 20},
        .connection_limits = *connection_limits,
        .engine = engine_begin(),
        .keys = &session_keys,
    };
    struct error error = {0};
    int pair[2];
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    daemon_init(&served);
    assert_true(daemon_start(&served, &options, &error));
    assert_true(daemon_serve_fd(&served, pair[0], &error));
    memset(&client, 0, sizeof(client));
    client.fd = pair[1];
    assert_int_equal(pthread_create(&thread, NULL, run, NULL), 0);
}

static const struct connection_limits patient = {
    .handshake_ms = 10000,
    .progress_grace_ms = 10000,
    .progress_bytes_per_s = 1,
    .idle_ms = 60000,
    .queued_soft_ms = 10000,
    .queued_soft_bytes = 16 << 20,
    .queued_hard_bytes = 64 << 20,
};

static inline int set_up_with(bool sealed, bool calls_cut_short)
{
    real = sys;
    if (calls_cut_short) {
        sys.read = short_read;
        sys.sendmsg = short_sendmsg;
        sys.epoll_wait = interrupted_wait;
    }
    start(&patient);
    if (sealed)
        seal_with(&session_key);
    greet();
    return 0;
}

static inline int set_up(void **state)
{
    (void)state;
    return set_up_with(false, false);
}

static inline int set_up_with_faults(void **state)
{
    (void)state;
    return set_up_with(false, true);
}

static inline int set_up_sealed(void **state)
{
    (void)state;
    return set_up_with(true, false);
}

static inline int set_up_sealed_with_faults(void **state)
{
    (void)state;
    return set_up_with(true, true);
}

/* The test greets. */
static inline int set_up_ungreeted(void **state)
{
    (void)state;
    real = sys;
    start(&patient);
    return 0;
}

static inline int tear_down(void **state)
{
    (void)state;
    sealed_link_destroy(client.link);
    close(client.fd);
    pthread_join(thread, NULL);
    daemon_finish(&served);
    engine_end();
    sys = real;
    return 0;
}

/* A test that runs four times: open and sealed, and both with whole calls and with calls that are cut short. */
#define SESSION_TEST_WAY_(name, way, set_up_way)                                                                  \
    test_register(__FILE__, &(struct CMUnitTest){#name way, name, set_up_way, tear_down, NULL}, true)
#define SESSION_TEST(name)                                                                                        \
    static void name(void **state);                                                                               \
    __attribute__((constructor)) static void register_##name(void)                                                \
    {                                                                                                             \
        SESSION_TEST_WAY_(name, "", set_up);                                                                      \
        SESSION_TEST_WAY_(name, " (calls cut short)", set_up_with_faults);                                        \
        SESSION_TEST_WAY_(name, " (sealed)", set_up_sealed);                                                      \
        SESSION_TEST_WAY_(name, " (sealed, calls cut short)", set_up_sealed_with_faults);                         \
    }                                                                                                             \
    static void name(__attribute__((unused)) void **state)

/* ---- steps ------------------------------------------------------------------------------------------- */

static inline void open_scene(uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = scene;
    send_message(request, 0, &message);
    expect(MESSAGE_OK, request);
}

#endif
