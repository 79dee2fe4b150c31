/* SPDX-License-Identifier: MIT */
/* net: addresses, listeners, the loop, limits of time, the out-queue. Sessions over real sockets are in
 * unit/session/session.c. */
#include <stddef.h>
#include <stdint.h>

#include "base/clock.h"
#include "base/sys.h"
#include "net/address.h"
#include "net/auth.h"
#include "net/connection.h"
#include "net/listen.h"
#include "net/loop.h"
#include "net/out_queue.h"
#include "net/timeouts.h"
#include "session/blob_store.h"
#include "tests/fixtures/stopped_clock.h"
#include "tests/harness/test.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

/* ---- addresses --------------------------------------------------------------------------------------- */

TEST(addresses_are_read_and_printed_as_they_are_written)
{
    static const char *const good[] = {"unix:/run/farlight/farlight.sock", "tcp:127.0.0.1:4170", "tcp:[::1]:80"};
    for (size_t i = 0; i < 3; i++) {
        struct address address;
        struct error error = {0};
        char text[ADDRESS_TEXT_BYTES];
        if (!address_parse(&address, good[i], &error))
            fail_msg("%s: %s", good[i], error.text);
        address_print(&address, text);
        assert_string_equal(text, good[i]);
        assert_int_equal(address_is_loopback(&address), i > 0);
    }
}

TEST(bad_addresses_are_refused)
{
    static const char *const bad[] = {
        "",
        "farlight.sock",
        "unix:relative",
        "tcp:127.0.0.1",
        "tcp::1",
        "tcp:::1:80",
        "tcp:127.0.0.1:",
        "tcp:127.0.0.1:http-or-so",
        "udp:1",
        "tcp:[::1:80",
        "unix:/"
        "aaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaaa"
        "aaaaaa",
    };
    for (size_t i = 0; i < sizeof(bad) / sizeof(bad[0]); i++) {
        struct address address;
        struct error error = {0};
        if (address_parse(&address, bad[i], &error))
            fail_msg("\"%s\" was taken", bad[i]);
        assert_string_equal(error.field, bad[i]);
    }
}

TEST(only_loopback_is_loopback)
{
    static const struct {
        const char *text;
        bool loopback;
    } cases[] = {{"tcp:127.9.9.9:1", true},          {"tcp:128.0.0.1:1", false},
                 {"tcp:0.0.0.0:1", false},           {"tcp:[::]:1", false},
                 {"tcp:[::ffff:127.0.0.1]:1", true}, {"tcp:[::ffff:10.0.0.1]:1", false}};
    for (size_t i = 0; i < sizeof(cases) / sizeof(cases[0]); i++) {
        struct address address;
        struct error error = {0};
        assert_true(address_parse(&address, cases[i].text, &error));
        if (address_is_loopback(&address) != cases[i].loopback)
            fail_msg("%s", cases[i].text);
    }
}

/* ---- listeners --------------------------------------------------------------------------------------- */

static char folder[64], socket_path[128];

static int make_folder(void **state)
{
    (void)state;
    const char *base = getenv("TMPDIR");
    snprintf(folder, sizeof(folder), "%.40s/farlight-XXXXXX", base ? base : P_tmpdir);
    assert_non_null(mkdtemp(folder));
    setenv("XDG_RUNTIME_DIR", folder, 1);
    snprintf(socket_path, sizeof(socket_path), "%s/farlight/s", folder);
    return 0;
}

static int remove_folder(void **state)
{
    (void)state;
    char inner[96];
    snprintf(inner, sizeof(inner), "%s/farlight", folder);
    unlink(socket_path);
    rmdir(inner);
    rmdir(folder);
    unsetenv("XDG_RUNTIME_DIR");
    return 0;
}

static struct address unix_address(void)
{
    struct address address;
    struct error error = {0};
    char text[160];
    snprintf(text, sizeof(text), "unix:%s", socket_path);
    assert_true(address_parse(&address, text, &error));
    return address;
}

TEST_WITH(a_unix_listener_makes_its_folder_and_lets_only_the_group_in, make_folder, remove_folder)
{
    struct listener listener;
    struct error error = {0};
    struct address address = unix_address();
    if (!listener_open(&listener, &address, false, &error))
        fail_msg("%s", error.text);
    struct stat status;
    assert_int_equal(stat(socket_path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0660);
    socket_path[strlen(socket_path) - 2] = '\0';
    assert_int_equal(stat(socket_path, &status), 0);
    assert_int_equal(status.st_mode & 0777, 0750);
    strcat(socket_path, "/s");

    /* Who comes is known. */
    int fd = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(connect(fd, (struct sockaddr *)&address.storage, address.storage_bytes), 0);
    struct address peer;
    bool retry_later;
    int accepted = listener_accept(&listener, &peer, &retry_later);
    assert_true(accepted >= 0);
    struct auth_identity identity;
    assert_true(auth_identify(&identity, accepted, &peer, false, &error));
    assert_true(identity.known);
    assert_int_equal(identity.user, getuid());
    assert_int_equal(listener_accept(&listener, &peer, &retry_later), -1);
    assert_false(retry_later);
    close(accepted);
    close(fd);
    listener_close(&listener);
    assert_int_equal(stat(socket_path, &status), -1);
}

TEST(a_host_that_is_gone_is_noticed)
{
    struct listener listener;
    struct address address, peer;
    struct error error = {0};
    bool retry_later;
    assert_true(address_parse(&address, "tcp:127.0.0.1:0", &error));
    assert_true(listener_open(&listener, &address, false, &error));
    int fd = socket(AF_INET, SOCK_STREAM, 0), on = 0;
    assert_int_equal(connect(fd, (struct sockaddr *)&listener.address.storage, listener.address.storage_bytes), 0);
    int accepted = listener_accept(&listener, &peer, &retry_later);
    assert_true(accepted >= 0);
    assert_int_equal(getsockopt(accepted, SOL_SOCKET, SO_KEEPALIVE, &on, &(socklen_t){sizeof(on)}), 0);
    assert_int_equal(on, 1);
    close(accepted);
    close(fd);
    listener_close(&listener);
}

TEST_WITH(a_listener_makes_no_folder_that_is_not_the_daemons_own, make_folder, remove_folder)
{
    struct listener listener;
    struct error error = {0};
    struct stat status;
    snprintf(socket_path, sizeof(socket_path), "%s/farlihgt/s", folder);
    struct address address = unix_address();
    assert_false(listener_open(&listener, &address, false, &error));
    assert_non_null(strstr(error.text, "No such file"));
    assert_non_null(strstr(error.remedy, "make the folder"));
    *strrchr(socket_path, '/') = '\0';
    assert_int_equal(stat(socket_path, &status), -1);
}

TEST_WITH(a_live_daemon_is_left_alone_and_a_stale_socket_replaced, make_folder, remove_folder)
{
    struct listener first, second;
    struct error error = {0};
    struct address address = unix_address();
    assert_true(listener_open(&first, &address, false, &error));
    assert_false(listener_open(&second, &address, false, &error));
    assert_int_equal(error.kind, ERROR_BUSY);
    assert_non_null(strstr(error.text, "another daemon"));
    close(first.fd); /* after a kill: the file stays */
    error = (struct error){0};
    if (!listener_open(&second, &address, false, &error))
        fail_msg("%s", error.text);
    listener_close(&second);
}

TEST_WITH(a_file_that_is_no_socket_is_not_touched, make_folder, remove_folder)
{
    struct listener listener;
    struct error error = {0};
    struct address address = unix_address();
    socket_path[strlen(socket_path) - 2] = '\0';
    assert_int_equal(mkdir(socket_path, 0700), 0);
    strcat(socket_path, "/s");
    FILE *file = fopen(socket_path, "w");
    assert_non_null(file);
    fclose(file);
    assert_false(listener_open(&listener, &address, false, &error));
    assert_non_null(strstr(error.text, "not a socket"));
    assert_int_equal(access(socket_path, F_OK), 0);
}

TEST(tcp_tells_its_port_and_stays_on_loopback)
{
    struct listener listener;
    struct error error = {0};
    struct address address;
    char text[ADDRESS_TEXT_BYTES];
    assert_true(address_parse(&address, "tcp:127.0.0.1:0", &error));
    assert_true(listener_open(&listener, &address, false, &error));
    address_print(&listener.address, text);
    assert_string_not_equal(text, "tcp:127.0.0.1:0");
    listener_close(&listener);
    assert_true(address_parse(&address, "tcp:0.0.0.0:0", &error));
    assert_false(listener_open(&listener, &address, false, &error));
    assert_int_equal(error.kind, ERROR_DENIED);
    assert_non_null(strstr(error.remedy, "--key-file"));
    assert_non_null(strstr(error.remedy, "--insecure"));
    assert_true(listener_open(&listener, &address, true, &error));
    listener_close(&listener);
}

static int failing_errno;

static int fail_accept4(int fd, struct sockaddr *address, socklen_t *bytes, int flags)
{
    (void)fd, (void)address, (void)bytes, (void)flags;
    errno = failing_errno;
    failing_errno = failing_errno == EINTR ? EMFILE : failing_errno;
    return -1;
}

static int fail_socket(int domain, int type, int protocol)
{
    (void)domain, (void)type, (void)protocol;
    errno = EMFILE;
    return -1;
}

static int fail_bind(int fd, const struct sockaddr *address, socklen_t bytes)
{
    (void)fd, (void)address, (void)bytes;
    errno = EADDRINUSE;
    return -1;
}

static int fail_listen(int fd, int backlog)
{
    (void)fd, (void)backlog;
    errno = EOPNOTSUPP;
    return -1;
}

TEST_WITH(each_call_of_a_listener_may_fail_and_leaves_nothing_behind, make_folder, remove_folder)
{
    struct sys_calls real = sys;
    struct address address = unix_address();
    struct listener listener;
    for (int i = 0; i < 3; i++) {
        struct error error = {0};
        sys = real;
        if (i == 0)
            sys.socket = fail_socket;
        else if (i == 1)
            sys.bind = fail_bind;
        else
            sys.listen = fail_listen;
        assert_false(listener_open(&listener, &address, false, &error));
        assert_int_not_equal(error.kind, ERROR_NONE);
        assert_int_equal(access(socket_path, F_OK), -1);
    }
    sys = real;
    struct error error = {0};
    assert_true(listener_open(&listener, &address, false, &error));
    sys.accept4 = fail_accept4;
    failing_errno = EINTR; /* and then out of descriptors */
    struct address peer;
    bool retry_later;
    assert_int_equal(listener_accept(&listener, &peer, &retry_later), -1);
    assert_true(retry_later);
    failing_errno = ECONNABORTED;
    assert_int_equal(listener_accept(&listener, &peer, &retry_later), -1);
    assert_false(retry_later);
    sys = real;
    listener_close(&listener);
}

/* ---- the loop ---------------------------------------------------------------------------------------- */

struct scene_of_loop {
    struct loop *loop;
    struct loop_timer early, late;
    struct loop_deferred deferred;
    struct loop_watch *watches[2];
    char order[16];
    int ready_calls;
};

static void note(struct scene_of_loop *scene, char what)
{
    scene->order[strlen(scene->order)] = what;
}

static void on_early(void *context)
{
    struct scene_of_loop *scene = context;
    note(scene, 'e');
    loop_defer(scene->loop, &scene->deferred);
    loop_defer(scene->loop, &scene->deferred);
}

static void on_deferred(void *context)
{
    note(context, 'd');
}

static void on_late(void *context)
{
    struct scene_of_loop *scene = context;
    note(scene, 'l');
    loop_stop(scene->loop);
}

TEST(timers_come_in_their_order_and_deferred_calls_once)
{
    struct error error = {0};
    struct scene_of_loop scene = {.loop = loop_create(&error)};
    scene.early = (struct loop_timer){.call = on_early, .context = &scene};
    scene.late = (struct loop_timer){.call = on_late, .context = &scene};
    scene.deferred = (struct loop_deferred){.call = on_deferred, .context = &scene};
    clock_stop();
    loop_timer_start(scene.loop, &scene.late, 30000000);
    loop_timer_start(scene.loop, &scene.early, 10000000);
    clock_let_pass(10000000);
    assert_true(loop_turn(scene.loop, &error));
    assert_string_equal(scene.order, "e");
    clock_let_pass(20000000);
    assert_true(loop_run(scene.loop, &error));
    assert_string_equal(scene.order, "edl");
    clock_start();
    loop_destroy(scene.loop);
}

/* Both are ready in the same turn; the first to be called removes the other. */
static void on_pipe(void *context, uint32_t events)
{
    (void)events;
    struct scene_of_loop *scene = context;
    scene->ready_calls++;
    loop_watch_remove(scene->watches[0]);
    loop_watch_remove(scene->watches[1]);
    loop_timer_start(scene->loop, &scene->late, 5000000);
}

TEST(a_watch_that_was_removed_is_not_called_even_in_the_same_turn)
{
    struct error error = {0};
    struct scene_of_loop scene = {.loop = loop_create(&error)};
    scene.late = (struct loop_timer){.call = on_late, .context = &scene};
    int pipes[2][2];
    for (int i = 0; i < 2; i++) {
        assert_int_equal(pipe(pipes[i]), 0);
        assert_int_equal(write(pipes[i][1], "x", 1), 1);
        scene.watches[i] = loop_watch_add(scene.loop, pipes[i][0], EPOLLIN, on_pipe, &scene, &error);
        assert_non_null(scene.watches[i]);
    }
    assert_true(loop_run(scene.loop, &error));
    assert_int_equal(scene.ready_calls, 1);
    for (int i = 0; i < 2; i++) {
        close(pipes[i][0]);
        close(pipes[i][1]);
    }
    loop_destroy(scene.loop);
}

static int interrupted_wait(int fd, struct epoll_event *events, int count, int timeout_ms)
{
    (void)fd, (void)events, (void)count, (void)timeout_ms;
    sys.epoll_wait = epoll_wait;
    errno = EINTR;
    return -1;
}

static void on_message(void *context, uint32_t events)
{
    (void)events;
    struct scene_of_loop *scene = context;
    note(scene, 'm');
    loop_watch_remove(scene->watches[0]);
}

TEST(messages_that_came_while_the_process_was_stopped_are_read_before_timers_are_due)
{
    struct error error = {0};
    struct scene_of_loop scene = {.loop = loop_create(&error)};
    int ends[2];
    scene.late = (struct loop_timer){.call = on_late, .context = &scene};
    assert_int_equal(pipe(ends), 0);
    assert_int_equal(write(ends[1], "x", 1), 1);
    scene.watches[0] = loop_watch_add(scene.loop, ends[0], EPOLLIN, on_message, &scene, &error);
    assert_non_null(scene.watches[0]);
    loop_timer_start(scene.loop, &scene.late, 0);
    sys.epoll_wait = interrupted_wait;
    assert_true(loop_run(scene.loop, &error));
    assert_string_equal(scene.order, "ml");
    close(ends[0]);
    close(ends[1]);
    loop_destroy(scene.loop);
}

/* ---- limits of time ---------------------------------------------------------------------------------- */

static void on_turn_end(void *context)
{
    (void)context;
}

TEST(a_client_is_charged_for_slow_progress_only_while_it_is_read_from)
{
    const uint64_t later_ns = UINT64_C(10000000000);
    const struct connection_limits limits = {
        .progress_grace_ms = 100, .progress_bytes_per_s = 1000, .queued_hard_bytes = 1000};
    struct error error = {0};
    struct connection connection = {.loop = loop_create(&error),
                                    .limits = &limits,
                                    .state = CONNECTION_OPEN,
                                    .turn_end = {.call = on_turn_end},
                                    .in_used = 1,
                                    .message_began_ns = 1};
    out_queue_init(&connection.out);
    connection_hold(&connection, true);
    timeouts_check(&connection, later_ns);
    assert_int_equal(connection.state, CONNECTION_OPEN);
    connection_hold(&connection, false); /* from here on it has all its time */
    timeouts_check(&connection, later_ns);
    assert_int_equal(connection.state, CONNECTION_OPEN);
    connection.message_began_ns = 1;
    timeouts_check(&connection, later_ns);
    assert_int_equal(connection.state, CONNECTION_FLUSHING);
    out_queue_finish(&connection.out);
    loop_destroy(connection.loop);
}

/* ---- the out-queue ----------------------------------------------------------------------------------- */

static int released, sent_calls;

static void on_release(struct out_chunk *chunk)
{
    (void)chunk;
    released++;
}

static void on_sent(void *context, uint64_t begun_ns, uint64_t now_ns)
{
    (void)context;
    /* Every call to the kernel is replaced by the tests. */
    assert_int_equal(begun_ns, 1);
    assert_int_equal(now_ns, 2);
    sent_calls++;
}

/* A queue, and a body that several of its messages send "bcd" of. */
struct queue_scene {
    struct out_queue queue;
    struct out_chunk body;
};

static void queue_begin(struct queue_scene *scene)
{
    *scene = (struct queue_scene){
        .body = {.references = 1, .data = (const uint8_t *)"abcdef", .size_bytes = 6, .release = on_release}};
    released = sent_calls = 0;
    out_queue_init(&scene->queue);
}

/* Nothing of it is left. */
static void queue_end(struct queue_scene *scene)
{
    out_queue_finish(&scene->queue);
    assert_int_equal(released, 0);
    out_chunk_unref(&scene->body);
    assert_int_equal(released, 1);
}

static void expect_nothing_queued(const struct out_queue *queue)
{
    assert_int_equal(queue->queued_bytes, 0);
    assert_int_equal(queue->queued_bulk_bytes, 0);
    assert_int_equal(queue->sending_bytes, 0);
}

static void push(struct out_queue *queue, const char *head, uint32_t request, struct out_chunk *body, bool bulk)
{
    struct out_message *message = out_message_create(strlen(head));
    assert_non_null(message);
    memcpy(message->head, head, strlen(head));
    message->request = request;
    if (body) {
        message->body = body;
        message->body_offset_bytes = 1;
        message->body_bytes = 3;
        message->padding_bytes = 2;
        message->sent = on_sent;
        out_chunk_ref(body);
    }
    out_queue_push(queue, message, bulk);
}

/* Sends everything in steps of so many bytes; what was sent, with '.' for zeros. */
static void drain(struct out_queue *queue, size_t step, char *text)
{
    struct iovec parts[3];
    size_t count;
    while ((count = out_queue_gather(queue, parts, 3))) {
        size_t left = step;
        for (size_t i = 0; i < count && left; i++) {
            size_t bytes = parts[i].iov_len < left ? parts[i].iov_len : left;
            for (size_t j = 0; j < bytes; j++) {
                char byte = ((const char *)parts[i].iov_base)[j];
                *text++ = byte ? byte : '.';
            }
            left -= bytes;
        }
        out_queue_advance(queue, step - left, 1, 2);
    }
    *text = '\0';
}

TEST(control_data_is_sent_first_and_partial_writes_lose_nothing)
{
    for (size_t step = 1; step < 30; step++) {
        struct queue_scene scene;
        char text[64];
        queue_begin(&scene);
        push(&scene.queue, "B1", 1, &scene.body, true);
        push(&scene.queue, "B2", 2, &scene.body, true);
        push(&scene.queue, "C1", 0, NULL, false);
        assert_int_equal(scene.queue.queued_bytes, 16);
        assert_int_equal(scene.queue.queued_bulk_bytes, 14);
        drain(&scene.queue, step, text);
        assert_string_equal(text, "C1B1bcd..B2bcd..");
        assert_int_equal(scene.queue.queued_bytes, 0);
        assert_int_equal(sent_calls, 2);
        queue_end(&scene);
    }
}

TEST(what_is_dropped_is_not_sent_but_what_was_begun_is_finished)
{
    struct queue_scene scene;
    struct iovec parts[16];
    char text[64];
    queue_begin(&scene);
    push(&scene.queue, "B1", 7, &scene.body, true);
    push(&scene.queue, "B2", 7, &scene.body, true);
    push(&scene.queue, "B3", 8, &scene.body, true);
    out_queue_gather(&scene.queue, parts, 16);
    out_queue_advance(&scene.queue, 3, 1, 2); /* "B1b" is with the kernel */
    push(&scene.queue, "C1", 7, NULL, false);
    out_queue_drop_bulk(&scene.queue, 7);
    drain(&scene.queue, 100, text);
    assert_string_equal(text, "cd..B3bcd..C1");
    assert_int_equal(sent_calls, 1);
    expect_nothing_queued(&scene.queue);
    push(&scene.queue, "B4", 8, &scene.body, true);
    queue_end(&scene);
}

TEST(a_begun_item_is_sent_and_reported_when_the_rest_is_dropped)
{
    struct queue_scene scene;
    struct iovec parts[16];
    char text[64];
    queue_begin(&scene);
    push(&scene.queue, "B1", 7, &scene.body, true); /* 7 bytes each */
    push(&scene.queue, "B2", 7, &scene.body, true);
    push(&scene.queue, "O1", 8, &scene.body, true);
    out_queue_gather(&scene.queue, parts, 16);
    out_queue_advance(&scene.queue, 3, 1, 2);
    push(&scene.queue, "B3", 7, &scene.body, true);
    assert_int_equal(out_queue_drop_unbegun(&scene.queue, 7, 0), 14);
    assert_int_equal(out_queue_drop_unbegun(&scene.queue, 7, 0), 0);
    push(&scene.queue, "C1", 7, NULL, false);
    drain(&scene.queue, 100, text);
    assert_string_equal(text, "cd..O1bcd..C1");
    assert_int_equal(sent_calls, 2); /* B1 and O1 */
    expect_nothing_queued(&scene.queue);
    queue_end(&scene);
}

/* Bytes that a sealed connection has copied, but the kernel has not accepted yet. */
TEST(copied_bytes_count_as_begun_and_not_as_sent)
{
    struct queue_scene scene;
    struct iovec parts[16];
    char text[64];
    queue_begin(&scene);
    push(&scene.queue, "B1", 7, &scene.body, true); /* 7 bytes each */
    push(&scene.queue, "B2", 7, &scene.body, true);
    push(&scene.queue, "B3", 7, &scene.body, true);
    out_queue_gather(&scene.queue, parts, 16);
    out_queue_take(&scene.queue, 9); /* B1 and the head of B2 */
    assert_int_equal(out_queue_gather(&scene.queue, parts, 16), 5);
    assert_int_equal(parts[0].iov_len, 3);
    assert_memory_equal(parts[0].iov_base, "bcd", 3);
    assert_int_equal(scene.queue.queued_bytes, 21);
    push(&scene.queue, "C1", 7, NULL, false);
    out_queue_drop_bulk(&scene.queue, 7); /* B3 only: the others are under way */
    assert_int_equal(scene.queue.queued_bytes, 16);
    out_queue_advance(&scene.queue, 4, 1, 2);
    assert_int_equal(scene.queue.queued_bytes, 12);
    assert_int_equal(scene.queue.taken_bytes, 5);
    assert_int_equal(sent_calls, 0);
    out_queue_advance(&scene.queue, 5, 1, 2);
    assert_int_equal(scene.queue.taken_bytes, 0);
    drain(&scene.queue, 100, text);
    assert_string_equal(text, "bcd..C1");
    assert_int_equal(sent_calls, 0); /* call of a request that was dropped */
    expect_nothing_queued(&scene.queue);
    queue_end(&scene);
}

/* A client may ask for a great many short answers and then read them all at once. */
TEST(many_short_messages_are_sent_without_looking_at_all_of_them_each_time)
{
    enum { MESSAGES = 400000, PARTS = 64 };
    struct out_queue queue;
    struct iovec parts[PARTS];
    size_t count, sent_bytes = 0;
    out_queue_init(&queue);
    for (int i = 0; i < MESSAGES; i++)
        push(&queue, "12345", 0, NULL, false);
    clock_t start = clock();
    while ((count = out_queue_gather(&queue, parts, PARTS))) {
        size_t bytes = 0;
        for (size_t i = 0; i < count; i++)
            bytes += parts[i].iov_len;
        out_queue_advance(&queue, bytes, 1, 2);
        sent_bytes += bytes;
    }
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    assert_int_equal(sent_bytes, 5 * MESSAGES);
    assert_int_equal(queue.sending_bytes, 0);
    out_queue_finish(&queue);
    if (seconds > 1) /* a few hundredths */
        fail_msg("%.2f s for %d messages", seconds, MESSAGES);
}

/* ---- blobs by principal ------------------------------------------------------------------------------ */

static struct blob *made_blob(uint8_t name, size_t bytes)
{
    struct blob *blob = blob_create(bytes);
    assert_non_null(blob);
    memset(blob->data, name, bytes);
    memset(blob->hash, 0x11, sizeof(blob->hash)); /* an equal head: both share a key of the map */
    blob->hash[31] = name;
    return blob;
}

static void put(struct blob_store *store, blob_principal principal, uint8_t name, size_t bytes)
{
    struct blob *blob = made_blob(name, bytes);
    struct blob *held = blob_store_add(store, principal, blob);
    assert_ptr_equal(held, blob);
    blob_unref(held);
    blob_unref(blob);
}

static bool has(struct blob_store *store, blob_principal principal, uint8_t name, size_t bytes)
{
    uint8_t hash[BLOB_HASH_BYTES];
    memset(hash, 0x11, sizeof(hash));
    hash[31] = name;
    struct blob *blob = blob_store_find(store, principal, hash, bytes);
    assert_true(!blob || blob->data[0] == name);
    blob_unref(blob);
    return blob != NULL;
}

TEST(a_hash_gives_no_access_to_another_clients_blob)
{
    struct blob_store *store = blob_store_create(10000, 10000);
    put(store, 1000, 1, 100);
    put(store, 1000, 2, 100);
    assert_true(has(store, 1000, 1, 100));
    assert_true(has(store, 1000, 2, 100));
    assert_false(has(store, 1000, 1, 99));
    assert_false(has(store, 1001, 1, 100));
    blob_store_forget(store, 1000);
    assert_false(has(store, 1000, 1, 100));
    assert_int_equal(blob_store_bytes(store), 0);
    blob_store_destroy(store);
}

#define KIB ((size_t)1 << 10)

TEST(the_cache_drops_what_was_used_longest_ago_and_never_what_is_in_use)
{
    struct error error = {0};
    struct blob_store *store = blob_store_create(1000 * KIB, 250 * KIB);
    for (uint8_t name = 1; name <= 4; name++)
        put(store, 7, name, 100 * KIB);
    assert_true(has(store, 7, 1, 100 * KIB)); /* 1 was used just now, 2 and 3 are the oldest */
    blob_store_trim(store);
    assert_true(has(store, 7, 1, 100 * KIB));
    assert_false(has(store, 7, 2, 100 * KIB));
    assert_false(has(store, 7, 3, 100 * KIB));
    assert_true(has(store, 7, 4, 100 * KIB));
    struct blob *used = made_blob(9, 600 * KIB);
    blob_unref(blob_store_add(store, 7, used));
    blob_store_trim(store);
    assert_true(has(store, 7, 9, 600 * KIB));
    assert_true(blob_store_reserve(store, 399 * KIB, &error)); /* at the cost of the cache */
    assert_false(has(store, 7, 1, 100 * KIB));
    assert_false(blob_store_reserve(store, KIB, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    blob_store_release(store, 399 * KIB);
    assert_int_equal(blob_store_bytes(store), 600 * KIB);
    assert_int_equal(blob_store_count(store), 1);
    blob_unref(used);
    blob_store_destroy(store);
}

TEST(small_blobs_count_with_what_they_take_beside_their_content)
{
    struct error error = {0};
    struct blob_store *store = blob_store_create(100 * BLOB_STORE_OVERHEAD_BYTES, 11 * BLOB_STORE_OVERHEAD_BYTES);
    for (uint8_t name = 1; name <= 100; name++)
        put(store, 7, name, 1);
    assert_int_equal(blob_store_bytes(store), 100);
    blob_store_trim(store);
    assert_int_equal(blob_store_count(store), 10);
    /* In use they cannot be dropped, and leave no room. */
    struct blob *used[100];
    for (uint8_t name = 1; name <= 100; name++)
        used[name - 1] = blob_store_add(store, 8, made_blob(name, 1));
    assert_false(blob_store_reserve(store, 1, &error));
    assert_int_equal(error.kind, ERROR_LIMIT);
    for (int i = 0; i < 100; i++) {
        blob_unref(used[i]);
        blob_unref(used[i]);
    }
    assert_true(blob_store_reserve(store, 1, &error));
    assert_int_equal(blob_store_count(store), 0);
    blob_store_destroy(store);
}
