/* SPDX-License-Identifier: MIT */
/* A recorded session that is cut after every byte in both directions, gets its bytes in pieces and late, meets a
 * system that interrupts and refuses, and runs out of memory at every place. Each time the hub is left with
 * nothing of it, and serves the next one. */
#include "tests/fuzz/engine_recorder.h"
#include "tests/fuzz/recorded_session.h"
#include "tests/fuzz/serving.h"

#include "base/log.h"
#include "base/sys.h"
#include "protocol/handshake.h"
#include "tests/harness/test.h"

#include <dirent.h>
#include <errno.h>
#include <malloc.h>
#include <stdlib.h>
#include <string.h>

/* ---- the recording ----------------------------------------------------------------------------------- */

static struct {
    uint8_t bytes[16384];
    size_t count;
    size_t ends[128]; /* end of each message, the hello first */
    size_t message_count;
} recording;

static void record(void *context, uint32_t request, uint32_t channel, const struct message *message)
{
    (void)context;
    struct writer writer;
    writer_init(&writer, recording.bytes + recording.count, sizeof(recording.bytes) - recording.count);
    assert_true(message_write(&writer, request, channel, message));
    recording.count += writer.used_bytes;
    recording.ends[recording.message_count++] = recording.count;
}

static int make_recording(void **state)
{
    (void)state;
    struct handshake_hello hello = {
        .version_min = HANDSHAKE_VERSION_MIN, .version_max = HANDSHAKE_VERSION_MAX, .name = "recorded"};
    recording.count = handshake_hello_encode(recording.bytes, &hello);
    recording.ends[recording.message_count++] = recording.count;
    recorded_session(record, NULL);
    log_set_level(LOG_ERROR);
    return 0;
}

/* Plays a client that waits for the answer to each message. False: the daemon has closed the connection. */
static bool play(unsigned client)
{
    size_t begin = 0;
    for (size_t i = 0; i < recording.message_count; i++) {
        if (!serving_send(client, recording.bytes + begin, recording.ends[i] - begin))
            return false;
        serving_settle();
        begin = recording.ends[i];
    }
    return true;
}

/* Expects the daemon's messages of an undisturbed session. */
static void expect_whole(unsigned client)
{
    const uint32_t *answers = serving_clients[client].answers;
    /* Open, 2 blobs, commit, batch, the first view, cancel, commit, close. */
    assert_int_equal(answers[MESSAGE_OK], 9);
    assert_int_equal(answers[MESSAGE_ERROR], 1);
    assert_int_equal(serving_clients[client].errors, 1u << PROTOCOL_ERROR_CANCELLED);
    assert_int_equal(answers[MESSAGE_BLOB_NEED], 1);
    assert_int_equal(answers[MESSAGE_STATS_REPLY], 1);
    assert_int_equal(answers[MESSAGE_PONG], 1);
    assert_true(answers[MESSAGE_FRAME_BEGIN] >= 6);
    assert_int_equal(answers[MESSAGE_FRAME_BEGIN], answers[MESSAGE_FRAME_END]);
}

ALL_TESTS(make_recording, NULL)

TEST(a_session_that_nothing_happens_to_is_answered)
{
    serving_begin();
    assert_true(serving_connect(0));
    play(0);
    expect_whole(0);
    serving_end();
}

/* ---- what is left ------------------------------------------------------------------------------------ */

static size_t open_descriptors(void)
{
    size_t count = 0;
    DIR *folder = opendir("/proc/self/fd");
    assert_non_null(folder);
    while (readdir(folder))
        count++;
    closedir(folder);
    return count;
}

/* Nobody is connected, or is to be any more. */
static void expect_nothing_left(size_t descriptors)
{
    for (unsigned i = 0; i < SERVING_CLIENTS; i++)
        serving_disconnect(i);
    serving_settle();
    serving_check_empty();
    assert_int_equal(open_descriptors(), descriptors);
}

/* ---- cuts -------------------------------------------------------------------------------------------- */

TEST(a_session_cut_after_every_byte_that_is_sent_leaves_nothing)
{
    serving_begin();
    size_t descriptors = open_descriptors();
    for (size_t count = 0; count < recording.count; count++) {
        assert_true(serving_connect(1));
        serving_send(1, recording.bytes, count);
        serving_settle();
        expect_nothing_left(descriptors);
    }
    serving_check_next();
    serving_end();
}

/* Other messages are in flight at a cut if each message is answered before the next one. */
TEST(a_session_cut_within_every_message_leaves_nothing)
{
    serving_begin();
    size_t descriptors = open_descriptors();
    for (size_t last = 0; last < recording.message_count; last++) {
        size_t begin = 0;
        assert_true(serving_connect(1));
        for (size_t i = 0; i <= last; i++) {
            size_t end = i < last ? recording.ends[i] : recording.ends[i] - 1;
            serving_send(1, recording.bytes + begin, end - begin);
            serving_settle();
            begin = end;
        }
        expect_nothing_left(descriptors);
    }
    serving_end();
}

static uint64_t sendable_bytes;
static size_t piece_bytes;
static struct sys_calls real;

/* The client is gone when it has got so much. */
static ssize_t send_until_cut(int fd, const struct msghdr *message, int flags)
{
    struct iovec part = message->msg_iov[0];
    struct msghdr shorter = {.msg_iov = &part, .msg_iovlen = 1};
    if (!sendable_bytes) {
        errno = EPIPE;
        return -1;
    }
    part.iov_len = part.iov_len < sendable_bytes ? part.iov_len : (size_t)sendable_bytes;
    ssize_t sent = real.sendmsg(fd, &shorter, flags);
    sendable_bytes -= sent > 0 ? (uint64_t)sent : 0;
    return sent;
}

TEST(a_session_cut_after_every_byte_that_comes_leaves_nothing)
{
    serving_begin();
    assert_true(serving_connect(0));
    play(0);
    uint64_t received_bytes = serving_clients[0].received_bytes;
    assert_true(received_bytes > 1000);
    serving_disconnect(0);
    serving_settle();
    size_t descriptors = open_descriptors();
    real = sys;
    for (uint64_t count = 0; count < received_bytes; count++) {
        sys.sendmsg = send_until_cut;
        sendable_bytes = count;
        assert_true(serving_connect(1));
        play(1);
        sys.sendmsg = real.sendmsg;
        assert_int_equal(serving_clients[1].received_bytes, count);
        expect_nothing_left(descriptors);
    }
    serving_check_next();
    serving_end();
}

/* ---- a difficult system ------------------------------------------------------------------------------ */

static unsigned calls;

static bool interrupted(void)
{
    if (++calls % 2)
        return false;
    errno = EINTR;
    return true;
}

static ssize_t read_pieces(int fd, void *data, size_t bytes)
{
    return interrupted() ? -1 : real.read(fd, data, bytes < piece_bytes ? bytes : piece_bytes);
}

/* Every third time the socket's buffer is full. */
static ssize_t send_pieces(int fd, const struct msghdr *message, int flags)
{
    struct iovec part = message->msg_iov[0];
    struct msghdr shorter = {.msg_iov = &part, .msg_iovlen = 1};
    if (interrupted())
        return -1;
    if (calls % 3 == 0) {
        errno = EAGAIN;
        return -1;
    }
    part.iov_len = part.iov_len < piece_bytes ? part.iov_len : piece_bytes;
    return real.sendmsg(fd, &shorter, flags);
}

TEST(pieces_interruptions_and_full_buffers_change_nothing)
{
    for (piece_bytes = 1; piece_bytes < 40; piece_bytes++) {
        serving_begin();
        size_t descriptors = open_descriptors();
        real = sys;
        sys.read = read_pieces;
        sys.sendmsg = send_pieces;
        assert_true(serving_connect(0));
        play(0);
        expect_whole(0);
        expect_nothing_left(descriptors);
        sys.read = real.read;
        sys.sendmsg = real.sendmsg;
        serving_end();
    }
}

TEST(a_slow_reader_gets_everything_later)
{
    serving_begin();
    assert_true(serving_connect(0));
    recorder_set_mood(RECORDER_LARGE);
    serving_clients[0].stalled = true;
    /* The session without the cancel and what follows: a message that was sent by then stays sent. */
    size_t cancel = recording.message_count - 6;
    serving_send(0, recording.bytes, recording.ends[cancel - 1]);
    serving_settle();
    assert_int_equal(serving_clients[0].received_bytes, 0);
    serving_clients[0].stalled = false;
    serving_settle();
    serving_wait(1000000000);
    const uint32_t *answers = serving_clients[0].answers;
    assert_int_equal(answers[MESSAGE_FRAME_BEGIN], answers[MESSAGE_FRAME_END]);
    assert_true(answers[MESSAGE_FRAME_END] >= 4);
    assert_true(serving_clients[0].received_bytes > 4 * (uint64_t)RECORDER_LARGE_FRAME_BYTES);
    serving_end();
}

/* ---- memory ------------------------------------------------------------------------------------------ */

void *__real_malloc(size_t bytes);
void *__real_calloc(size_t count, size_t bytes);
void *__real_realloc(void *data, size_t bytes);
void *__wrap_malloc(size_t bytes);
void *__wrap_calloc(size_t count, size_t bytes);
void *__wrap_realloc(void *data, size_t bytes);

static uint64_t allocations, failing; /* which of them fails, and `failing_too` behind it; 0: none */
static uint64_t failing_too;

static bool fails(void)
{
    if (recorder_at_work)
        return false;
    allocations++;
    return failing && allocations >= failing && allocations <= failing + failing_too;
}

void *__wrap_malloc(size_t bytes)
{
    return fails() ? NULL : __real_malloc(bytes);
}

void *__wrap_calloc(size_t count, size_t bytes)
{
    return fails() ? NULL : __real_calloc(count, bytes);
}

void *__wrap_realloc(void *data, size_t bytes)
{
    return fails() ? NULL : __real_realloc(data, bytes);
}

/* Without those of what it comes to. */
static uint64_t allocations_of_a_session(void)
{
    serving_begin();
    uint64_t before = allocations;
    assert_true(serving_connect(0));
    play(0);
    uint64_t count = allocations - before;
    serving_end();
    return count;
}

static void play_without_memory(uint64_t which)
{
    serving_begin();
    size_t descriptors = open_descriptors();
    uint64_t first = allocations;
    failing = first + which;
    /* Whoever does not get in has no session. */
    if (serving_connect(0))
        play(0);
    failing = 0;
    bool told = serving_clients[0].errors & 1u << PROTOCOL_ERROR_OUT_OF_MEMORY;
    bool closed = serving_hub.sessions.count == 0 || serving_clients[0].answers[MESSAGE_GOODBYE] == 1;
    if (!told && !closed)
        expect_whole(0);
    expect_nothing_left(descriptors);
    serving_end();
}

TEST(each_allocation_fails_in_turn_and_nothing_is_left)
{
    uint64_t count = allocations_of_a_session();
    assert_true(count > 100);
    for (failing_too = 0; failing_too <= 3; failing_too += 3) {
        for (uint64_t which = 1; which <= count; which++)
            play_without_memory(which);
    }
}

/* ---- nothing grows ----------------------------------------------------------------------------------- */

TEST(a_thousand_sessions_take_no_more_memory_than_a_hundred)
{
    enum { WARM = 99 };
    serving_begin();
    size_t descriptors = open_descriptors(), held_bytes = 0;
    for (int i = 0; i < 1000; i++) {
        assert_true(serving_connect(0));
        play(0);
        expect_whole(0);
        expect_nothing_left(descriptors);
        if (i == WARM) /* the allocator's own lists are full */
            held_bytes = mallinfo2().uordblks;
    }
    /* Under a sanitizer, which looks for leaks itself, both are 0. */
    assert_int_equal(mallinfo2().uordblks, held_bytes);
    serving_end();
}
