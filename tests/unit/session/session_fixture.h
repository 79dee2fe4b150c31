/* SPDX-License-Identifier: MIT */
/* A daemon on a thread of its own, whose engine the including test stands in for, and a client of it here. Tests
 * run with the system calls as they are and with each of them cut short and interrupted, open and sealed. */
#ifndef FARLIGHT_TESTS_SESSION_FIXTURE_H
#define FARLIGHT_TESTS_SESSION_FIXTURE_H

#include "tests/unit/session/client.h"

#include "base/sys.h"

#include <errno.h>
#include <fcntl.h>
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

static const struct sealed_key session_key = {.bytes = "whoever knows this may come in!"};

/* The one client hears all of these. */
#define send_bytes(...) send_bytes(&client, __VA_ARGS__)
#define send_plainly(...) send_plainly(&client, __VA_ARGS__)
#define send_sealed() send_sealed(&client)
#define send_message(...) send_message(&client, __VA_ARGS__)
#define receive_sealed() receive_sealed(&client)
#define receive_now() receive_now(&client)
#define receive() receive(&client)
#define expect(...) expect(&client, __VA_ARGS__)
#define expect_error(...) expect_error(&client, __VA_ARGS__)
#define expect_end() expect_end(&client)
#define expect_alive(...) expect_alive(&client, __VA_ARGS__)
#define greet_with(...) greet_with(&client, __VA_ARGS__)
#define begin_edit(...) begin_edit(&client, __VA_ARGS__)
#define send_node(...) send_node(&client, __VA_ARGS__)
#define commit(...) commit(&client, __VA_ARGS__)
#define offer(...) offer(&client, __VA_ARGS__)

static inline void greet(void)
{
    assert_true(greet_with(HANDSHAKE_CAN_ABANDON) & HANDSHAKE_CAN_ABANDON);
    assert_int_equal(client.limits.requests_in_flight, 64);
}

/* A client of this user, or one that has proved to a front that it has the key. */
static inline void hand_over(int fd, const struct sealed_key *key)
{
    struct error error = {0};
    struct handover handover = {
        .identity = {.known = true, .has_key = true, .key = sealed_key_number(key), .name = "key, user 0"},
        .peer = {.storage.ss_family = AF_UNIX, .storage_bytes = sizeof(sa_family_t)},
        .is_owner = true};
    seal_with(&client, key, &handover.saved);
    assert_true(hub_add_client(&served.hub, fd, &handover, &error));
    free(handover.saved.bytes);
}

static inline void start_sealed(const struct connection_limits *connection_limits, const struct sealed_key *key)
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
    };
    struct error error = {0};
    int pair[2];
    if (key)
        options.keys = (struct auth_key_numbers){.numbers = {sealed_key_number(key)}, .count = 1};
    assert_int_equal(socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, pair), 0);
    daemon_init(&served);
    assert_true(daemon_start(&served, &options, &error));
    memset(&client, 0, sizeof(client));
    client.fd = pair[1];
    if (key) {
        assert_int_equal(fcntl(pair[0], F_SETFL, O_NONBLOCK), 0);
        hand_over(pair[0], key);
    } else {
        assert_true(daemon_serve_fd(&served, pair[0], &error));
    }
    assert_int_equal(pthread_create(&thread, NULL, run, NULL), 0);
}

static inline void start(const struct connection_limits *connection_limits)
{
    start_sealed(connection_limits, NULL);
}

static const struct connection_limits patient = {
    .handshake_ms = 600000,
    .progress_grace_ms = 600000,
    .progress_bytes_per_s = 1,
    .idle_ms = 600000,
    .queued_soft_ms = 600000,
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
    start_sealed(&patient, sealed ? &session_key : NULL);
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

static inline void cancel(uint32_t request, uint32_t target)
{
    struct message message = made(MESSAGE_CANCEL);
    message.cancel.target_request = target;
    send_message(request, 0, &message);
}

static inline void open_scene(uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = scene;
    send_message(request, 0, &message);
    expect(MESSAGE_OK, request);
}

#endif
