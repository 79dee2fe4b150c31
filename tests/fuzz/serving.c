/* SPDX-License-Identifier: MIT */
#include "tests/fuzz/serving.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/sys.h"
#include "protocol/handshake.h"
#include "session/session.h"
#include "tests/fuzz/engine_recorder.h"
#include "tests/fuzz/fuzz.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define IN_BYTES ((size_t)1 << 20)
/* A hub that has more to do than that without a byte coming or going never ends. */
#define TURNS_MAX 200

struct hub serving_hub;
struct serving_client serving_clients[SERVING_CLIENTS];

static struct loop *loop;
static bool nothing_ready;
static uint64_t now_ns;
static uint8_t scratch_data[SCRATCH_BYTES];

uint64_t __wrap_clock_now_ns(void);

/* Never the same twice, so that what is measured takes time. */
uint64_t __wrap_clock_now_ns(void)
{
    return now_ns += 1000;
}

static int epoll_without_waiting(int fd, struct epoll_event *events, int max_events, int timeout_ms)
{
    int count = epoll_wait(fd, events, max_events, 0);
    nothing_ready = count == 0 && timeout_ms != 0;
    return count;
}

/* ---- what clients receive --------------------------------------------------------------------------- */

/* The answer to bytes that begin as a sealed connection does: there is no key here. */
static bool is_refused_sealing(const struct serving_client *client)
{
    static const uint8_t begun[] = {'S', 'E', 'A', 'L', 2};
    return client->in_used >= SEALED_REFUSAL_BYTES && memcmp(client->in, begun, sizeof(begun)) == 0 &&
           client->in[sizeof(begun)] != 0;
}

static size_t take_reply(struct serving_client *client)
{
    if (is_refused_sealing(client))
        return SEALED_REFUSAL_BYTES;
    struct handshake_reply reply;
    struct decode_error error;
    size_t consumed = 0;
    enum handshake_result result = handshake_reply_parse(&reply, client->in, client->in_used, &consumed, &error);
    FUZZ_REQUIRE(result != HANDSHAKE_FATAL);
    client->greeted = result == HANDSHAKE_CONSUMED;
    return consumed;
}

static size_t take_message(struct serving_client *client)
{
    struct frame frame;
    struct decode_error error;
    enum framing_result result = framing_parse(&frame, client->in, client->in_used, MESSAGE_FROM_SERVER, &error);
    FUZZ_REQUIRE(result != FRAMING_FATAL);
    if (result == FRAMING_NEED_MORE)
        return 0;
    struct message message;
    struct scratch scratch;
    scratch_init(&scratch, scratch_data, sizeof(scratch_data));
    FUZZ_REQUIRE(frame.info);
    FUZZ_REQUIRE(
        message_decode(&message, frame.header.type, frame.payload, frame.header.payload_bytes, &scratch, &error));
    if (message.type <= MESSAGE_FRAME_END)
        client->answers[message.type]++;
    if (message.type == MESSAGE_ERROR)
        client->errors |= 1u << message.error.code;
    return frame.consumed_bytes;
}

/* Receives everything that has arrived; false: nothing has. A client must understand all of it. */
static bool receive(struct serving_client *client)
{
    if (client->fd < 0 || client->stalled)
        return false;
    ssize_t got = recv(client->fd, client->in + client->in_used, IN_BYTES - client->in_used, MSG_DONTWAIT);
    if (got <= 0)
        return false;
    client->in_used += (size_t)got;
    client->received_bytes += (uint64_t)got;
    for (size_t consumed; (consumed = client->greeted ? take_message(client) : take_reply(client)) > 0;) {
        client->in_used -= consumed;
        memmove(client->in, client->in + consumed, client->in_used);
    }
    FUZZ_REQUIRE(client->in_used < IN_BYTES);
    return true;
}

/* ---- turns ------------------------------------------------------------------------------------------ */

static void turn(void)
{
    struct error error = {0};
    FUZZ_REQUIRE(loop_turn(loop, &error));
}

void serving_settle(void)
{
    for (int idle_turns = 0; idle_turns < TURNS_MAX; idle_turns++) {
        turn();
        bool came = false;
        for (int i = 0; i < SERVING_CLIENTS; i++)
            came = receive(&serving_clients[i]) || came;
        if (came)
            idle_turns = 0;
        else if (nothing_ready)
            return;
    }
}

void serving_wait(uint64_t ns)
{
    now_ns += ns;
    serving_settle();
}

/* ---- clients ---------------------------------------------------------------------------------------- */

bool serving_connect(unsigned number)
{
    struct serving_client *client = &serving_clients[number];
    int pair[2];
    FUZZ_REQUIRE(client->fd < 0 && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0, pair) == 0);
    struct address address = {.storage.ss_family = AF_UNIX, .storage_bytes = sizeof(sa_family_t)};
    const struct handover handover = {.identity = {.known = true, .has_user = true, .user = 1000},
                                      .peer = address};
    struct error error = {0};
    if (!hub_add_client(&serving_hub, pair[0], &handover, &error)) {
        close(pair[0]);
        close(pair[1]);
        return false;
    }
    uint8_t *in = client->in;
    *client = (struct serving_client){.fd = pair[1], .number = serving_hub.last_number, .in = in};
    return true;
}

void serving_restrict(unsigned number)
{
    struct session *session = hashmap_get(&serving_hub.sessions, serving_clients[number].number);
    if (session)
        session->identity.read_only = true;
}

bool serving_send(unsigned number, const uint8_t *bytes, size_t count)
{
    struct serving_client *client = &serving_clients[number];
    for (int tries = 0; count && tries < TURNS_MAX; tries++) {
        ssize_t sent = send(client->fd, bytes, count, MSG_NOSIGNAL | MSG_DONTWAIT);
        if (sent < 0 && errno != EAGAIN && errno != EINTR)
            return false;
        if (sent > 0) {
            bytes += sent;
            count -= (size_t)sent;
        } else {
            serving_settle();
        }
    }
    return true;
}

void serving_greet(unsigned number)
{
    struct handshake_hello hello = {
        .version_min = HANDSHAKE_VERSION_MIN, .version_max = HANDSHAKE_VERSION_MAX, .name = "a client"};
    hello.capabilities = number % 2 ? HANDSHAKE_CAN_ABANDON : 0;
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    serving_send(number, bytes, handshake_hello_encode(bytes, &hello));
    serving_settle();
}

void serving_disconnect(unsigned number)
{
    struct serving_client *client = &serving_clients[number];
    if (client->fd >= 0)
        close(client->fd);
    client->fd = -1;
}

/* ---- begin and end ---------------------------------------------------------------------------------- */

void serving_begin(void)
{
    struct hub_options options = {
        .limits = {.clients = SERVING_CLIENTS,
                   .unauthenticated = 4,
                   .unauthenticated_per_address = 4,
                   .requests_in_flight = 16,
                   .scenes_per_client = 4,
                   .jobs_per_client = 3,
                   .tracers.ldc_layers = 7,
                   .blobs_per_client = 16,
                   .transaction_edits = 24,
                   .transaction_bytes = 64 << 10,
                   .nodes = 100,
                   .texture_edge_texels = 64,
                   .width_pixels = 512,
                   .height_pixels = 512,
                   .samples = 64,
                   .blob_bytes = 1 << 20,
                   .blob_cache_bytes = 0, /* unused blobs are dropped */
                   .upload_window_bytes = 512 << 10,
                   .frame_bytes = 32 << 20,
                   .frames_in_flight = 3,
                   .frame_window_bytes = 4 << 20},
        .connection_limits = {.handshake_ms = 5000,
                              .progress_grace_ms = 5000,
                              .progress_bytes_per_s = 1024,
                              .idle_ms = 120000,
                              .queued_soft_ms = 10000,
                              .queued_soft_bytes = 1 << 20,
                              .queued_hard_bytes = 4 << 20},
        .engine = recorder_begin(),
    };
    struct error error = {0};
    now_ns = 1000000000;
    sys.epoll_wait = epoll_without_waiting;
    loop = loop_create(&error);
    FUZZ_REQUIRE(loop && hub_init(&serving_hub, loop, &options, &error));
    for (int i = 0; i < SERVING_CLIENTS; i++) {
        serving_clients[i].fd = -1;
        if (!serving_clients[i].in)
            serving_clients[i].in = malloc(IN_BYTES);
        FUZZ_REQUIRE(serving_clients[i].in);
    }
}

void serving_check_empty(void)
{
    FUZZ_REQUIRE(serving_hub.sessions.count == 0);
    FUZZ_REQUIRE(serving_hub.introduced == 0);
    FUZZ_REQUIRE(serving_hub.frame_bytes == 0);
    FUZZ_REQUIRE(!serving_hub.waiting);
    FUZZ_REQUIRE(blob_store_bytes(serving_hub.blobs) == 0);
    FUZZ_REQUIRE(recorder_jobs() == 0);
    FUZZ_REQUIRE(recorder_references() == 0);
}

void serving_check_next(void)
{
    struct message message;
    message_init(&message, MESSAGE_PING);
    uint8_t bytes[64];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    FUZZ_REQUIRE(message_write(&writer, 1, 0, &message));
    FUZZ_REQUIRE(serving_connect(0));
    serving_greet(0);
    serving_send(0, bytes, writer.used_bytes);
    serving_settle();
    FUZZ_REQUIRE(serving_clients[0].answers[MESSAGE_PONG] == 1);
    serving_disconnect(0);
    serving_settle();
}

void serving_end(void)
{
    recorder_set_mood(0);
    for (unsigned i = 0; i < SERVING_CLIENTS; i++)
        serving_disconnect(i);
    serving_settle();
    serving_wait(10000000); /* commands that waited for room are tried again */
    serving_check_empty();
    if (!serving_hub.stopping) {
        serving_check_next();
        serving_check_empty();
    }
    hub_finish(&serving_hub);
    loop_destroy(loop);
    recorder_end();
}
