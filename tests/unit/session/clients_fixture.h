/* SPDX-License-Identifier: MIT */
/* A daemon on a thread of its own that listens, with the real engine but for its renderer, and any number of
 * clients of it here. */
#ifndef FARLIGHT_TESTS_CLIENTS_FIXTURE_H
#define FARLIGHT_TESTS_CLIENTS_FIXTURE_H

#include "tests/unit/engine/engine_fake.h"

#include "session/daemon.h"
#include "session/session.h"

#include <pthread.h>
#include <signal.h>
#include <stdio.h>
#include <sys/socket.h>
#include <sys/un.h>

/* ---- the daemon -------------------------------------------------------------------------------------- */

static struct {
    struct engine *engine;
    struct daemon daemon;
    pthread_t thread;
    char folder[64], address[96];
} served;

static inline void *run(void *context)
{
    (void)context;
    struct error error = {0};
    bool device_gone;
    daemon_run(&served.daemon, &device_gone, &error);
    return NULL;
}

/* What a test may change before it starts the daemon. */
static inline struct hub_options usual_options(void)
{
    return (struct hub_options){
        .limits = {.clients = 16,
                   .unauthenticated = 16,
                   .unauthenticated_per_address = 16,
                   .wrong_keys_a_minute = 5,
                   .requests_in_flight = 64,
                   .scenes_per_client = 3,
                   .jobs_per_client = 4,
                   .tracers.ldc_layers = 255,
                   .blobs_per_client = 64,
                   .transaction_edits = 1000,
                   .transaction_bytes = 1 << 20,
                   .nodes = 100,
                   .depth = 10,
                   .texture_edge_texels = 64,
                   .width_pixels = 512,
                   .height_pixels = 512,
                   .samples = 64,
                   .blob_bytes = 8 << 20,
                   .upload_window_bytes = 1 << 20,
                   .frame_bytes = 10 << 20,
                   .frames_in_flight = 3,
                   .frame_window_bytes = 1 << 20},
        .connection_limits = {.handshake_ms = 10000,
                              .progress_grace_ms = 10000,
                              .progress_bytes_per_s = 1,
                              .idle_ms = 60000,
                              .queued_soft_ms = 10000,
                              .queued_soft_bytes = 16 << 20,
                              .queued_hard_bytes = 64 << 20},
        .engine_limits = {.scene_linger_ms = 600000},
    };
}

static inline void start_daemon(const struct hub_options *wanted)
{
    struct hub_options options = *wanted;
    struct error error = {0};
    served.engine = start((struct engine_options){.limits = options.engine_limits});
    options.engine = engine_port(served.engine);
    strcpy(served.folder, "/tmp/farlight-test-XXXXXX");
    assert_non_null(mkdtemp(served.folder));
    snprintf(served.address, sizeof(served.address), "unix:%s/s tcp:127.0.0.1:0", served.folder);
    daemon_init(&served.daemon);
    assert_true(daemon_listen(&served.daemon, served.address, false, &error));
    assert_true(daemon_start(&served.daemon, &options, &error));
    assert_int_equal(pthread_create(&served.thread, NULL, run, NULL), 0);
}

static inline int block_signals(void **state)
{
    (void)state;
    daemon_block_signals();
    return 0;
}

static inline int tear_down(void **state)
{
    (void)state;
    kill(getpid(), SIGTERM); /* blocked in every thread: the daemon's loop takes it */
    pthread_join(served.thread, NULL);
    daemon_finish(&served.daemon);
    stop(served.engine);
    assert_int_equal(rmdir(served.folder), 0); /* it has taken its socket away */
    return 0;
}

/* ---- clients ----------------------------------------------------------------------------------------- */

struct client {
    int fd;
    uint8_t in[2 * FRAMING_MESSAGE_MAX_BYTES];
    size_t in_used, consumed;
    uint8_t scratch_data[SCRATCH_BYTES];
    struct scratch scratch;
    struct framing_header header; /* of the last message */
    struct message message;
    uint64_t capabilities, upload_credit;
    struct handshake_limits limits;
};

static inline void receive_some(struct client *client)
{
    memmove(client->in, client->in + client->consumed, client->in_used - client->consumed);
    client->in_used -= client->consumed;
    client->consumed = 0;
    struct pollfd fd = {.fd = client->fd, .events = POLLIN};
    if (poll(&fd, 1, 20000) != 1)
        fail_msg("nothing came for 20 s");
    ssize_t got = recv(client->fd, client->in + client->in_used, sizeof(client->in) - client->in_used, 0);
    if (got <= 0)
        fail_msg("the connection is closed");
    client->in_used += (size_t)got;
}

static inline void send_message(struct client *client, uint32_t request, uint32_t channel,
                                const struct message *message)
{
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    if (!message_write(&writer, request, channel, message))
        fail_msg("%s: %s", writer.error.field, writer.error.text);
    for (size_t sent = 0; sent < writer.used_bytes;) {
        ssize_t now = send(client->fd, bytes + sent, writer.used_bytes - sent, MSG_NOSIGNAL);
        assert_true(now > 0);
        sent += (size_t)now;
    }
}

/* The next message but credit; it stays until the next call. */
static inline void receive(struct client *client)
{
    for (;;) {
        struct frame frame;
        struct decode_error error = {0};
        enum framing_result result =
            framing_parse(&frame, client->in + client->consumed, client->in_used - client->consumed,
                          MESSAGE_FROM_SERVER, &error);
        if (result == FRAMING_NEED_MORE) {
            receive_some(client);
            continue;
        }
        if (result == FRAMING_FATAL)
            fail_msg("%s: %s", error.field, error.text);
        client->consumed += frame.consumed_bytes;
        client->header = frame.header;
        scratch_init(&client->scratch, client->scratch_data, sizeof(client->scratch_data));
        if (!message_decode(&client->message, frame.header.type, frame.payload, frame.header.payload_bytes,
                            &client->scratch, &error))
            fail_msg("%s: %s", error.field, error.text);
        if (client->message.type != MESSAGE_CREDIT)
            return;
        client->upload_credit = client->message.credit.total;
    }
}

static inline void expect(struct client *client, enum message_type type, uint32_t request)
{
    receive(client);
    if (client->message.type != type || client->header.request != request)
        fail_msg("%s of request %u came instead of %s of %u: %s", message_type_text(client->message.type),
                 client->header.request, message_type_text(type), request,
                 client->message.type == MESSAGE_ERROR ? client->message.error.text : "");
}

static inline uint64_t expect_ok(struct client *client, uint32_t request)
{
    expect(client, MESSAGE_OK, request);
    return client->message.ok.revision;
}

static inline void expect_error(struct client *client, uint32_t request, enum protocol_error_code code)
{
    expect(client, MESSAGE_ERROR, request);
    if (client->message.error.code != code)
        fail_msg("%s: %s", protocol_error_code_text(client->message.error.code), client->message.error.text);
}

static inline struct message made(enum message_type type)
{
    struct message message;
    message_init(&message, type);
    return message;
}

static inline void greet(struct client *client)
{
    struct handshake_hello hello = {.version_min = 1, .version_max = 1, .name = "test"};
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    size_t count = handshake_hello_encode(bytes, &hello);
    assert_int_equal(send(client->fd, bytes, count, MSG_NOSIGNAL), count);
    struct handshake_reply reply;
    struct decode_error error = {0};
    while (handshake_reply_parse(&reply, client->in, client->in_used, &client->consumed, &error) ==
           HANDSHAKE_NEED_MORE)
        receive_some(client);
    assert_int_equal(reply.version, 1);
    client->capabilities = reply.capabilities;
    client->limits = reply.limits;
}

/* Over the Unix socket, where all are one user, or over TCP, where everybody is somebody else. Says nothing yet.
 */
static inline struct client *knock(bool over_tcp)
{
    struct client *client = calloc(1, sizeof(*client));
    assert_non_null(client);
    const struct address *address = &served.daemon.listeners[over_tcp].address;
    client->fd = socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC, 0);
    assert_true(client->fd >= 0);
    assert_int_equal(connect(client->fd, (const struct sockaddr *)&address->storage, address->storage_bytes), 0);
    return client;
}

static inline struct client *come(bool over_tcp)
{
    struct client *client = knock(over_tcp);
    greet(client);
    return client;
}

/* Without a word, as when a line is cut. With a witness, the only other client, the daemon has noticed when this
 * returns. */
static inline void cut(struct client *client, struct client *witness)
{
    close(client->fd);
    free(client);
    if (!witness)
        return;
    uint32_t clients;
    do {
        struct message message = made(MESSAGE_STATS);
        send_message(witness, 777, 0, &message);
        expect(witness, MESSAGE_STATS_REPLY, 777);
        clients = witness->message.stats_reply.clients_count;
        usleep(1000);
    } while (clients > 1);
}

static inline void submit_open(struct client *client, uint32_t scene, const char *name,
                               enum protocol_sharing sharing)
{
    struct message message = made(MESSAGE_SCENE_OPEN);
    message.scene_open.scene = scene;
    message.scene_open.sharing = sharing;
    message.scene_open.name = name;
    send_message(client, 100 + scene, 0, &message);
}

static inline void open_scene_as(struct client *client, uint32_t scene, const char *name,
                                 enum protocol_sharing sharing)
{
    submit_open(client, scene, name, sharing);
    assert_int_equal(expect_ok(client, 100 + scene), 0);
}

static inline uint64_t commit_node(struct client *client, uint32_t request, uint32_t scene, uint32_t node)
{
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = scene;
    send_message(client, request, 0, &message);
    message = made(MESSAGE_SET_NODE);
    message.set_node.node = node;
    message.set_node.parent_from_node[0] = 1;
    send_message(client, request, 0, &message);
    message = made(MESSAGE_EDIT_COMMIT);
    send_message(client, request, 0, &message);
    return expect_ok(client, request);
}

static inline struct record_blob_ref reference_to(const void *data, size_t bytes)
{
    struct record_blob_ref reference = {.size_bytes = bytes};
    blob_hash(reference.hash, data, bytes);
    return reference;
}

static inline uint32_t offer(struct client *client, uint32_t request, struct record_blob_ref reference)
{
    struct message message = made(MESSAGE_BLOB_OFFER);
    message.blob_offer.blobs = &reference;
    message.blob_offer.blobs_count = 1;
    send_message(client, request, 0, &message);
    expect(client, MESSAGE_BLOB_NEED, request);
    return client->message.blob_need.needed_count;
}

static inline void send_blob(struct client *client, uint32_t request, const struct record_blob_ref *reference,
                             const void *data)
{
    struct message message = made(MESSAGE_BLOB_DATA);
    memcpy(message.blob_data.hash, reference->hash, sizeof(reference->hash));
    message.blob_data.data = data;
    message.blob_data.data_bytes = (uint32_t)reference->size_bytes;
    send_message(client, request, 1, &message);
}

/* The revision that a frame shows. */
static inline uint64_t render_frame(struct client *client, uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.width = message.render.height = 1;
    message.render.scene = scene;
    message.render.channel = request;
    message.render.credit = 1;
    send_message(client, request, 0, &message);
    expect(client, MESSAGE_FRAME_BEGIN, request);
    uint64_t revision = client->message.frame_begin.revision;
    expect(client, MESSAGE_FRAME_DATA, request);
    expect(client, MESSAGE_FRAME_END, request);
    expect_ok(client, request);
    return revision;
}

#endif
