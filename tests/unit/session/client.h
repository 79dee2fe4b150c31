/* SPDX-License-Identifier: MIT */
/* A client of a daemon, by raw messages, open or sealed; whatever is not as expected fails the test. */
#ifndef FARLIGHT_TESTS_SESSION_CLIENT_H
#define FARLIGHT_TESTS_SESSION_CLIENT_H

#include "protocol/sealed/link.h"
#include "session/daemon.h"

#include <poll.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include <cmocka.h>

struct client {
    int fd;
    struct sealed_link *link; /* NULL: it is not sealed */
    uint8_t in[2 * FRAMING_MESSAGE_MAX_BYTES];
    size_t in_used, consumed;
    uint8_t scratch_data[SCRATCH_BYTES];
    struct scratch scratch;
    struct framing_header header; /* header of the last message */
    struct message message;
    uint64_t capabilities, upload_credit;
    struct handshake_limits limits;
    unsigned pings;   /* number of the daemon's pings */
    unsigned blocked; /* how often it was told so, and why the last time */
    char blocked_text[129];
};

/* Opens what has come; how many bytes of plain text that was. */
static inline size_t open_records(struct client *client)
{
    struct decode_error error = {0};
    size_t before = client->in_used;
    enum sealed_result result = sealed_link_handshake(client->link, &error);
    while (result == SEALED_CONSUMED && !sealed_has_opened_last(client->link->sealed)) {
        size_t bytes = 0;
        result = sealed_link_open(client->link, client->in + client->in_used, sizeof(client->in) - client->in_used,
                                  &bytes, &error);
        client->in_used += bytes;
    }
    if (result == SEALED_FATAL || result == SEALED_REFUSED)
        fail_msg("%s: %s", error.field, error.text);
    return client->in_used - before;
}

/* False: the daemon has closed the connection. */
static inline bool receive_sealed(struct client *client)
{
    size_t free_bytes;
    uint8_t *space = sealed_link_space(client->link, &free_bytes);
    ssize_t got = recv(client->fd, space, free_bytes, 0);
    sealed_link_came(client->link, got > 0 ? (size_t)got : 0);
    return got > 0;
}

static inline void receive_some(struct client *client)
{
    memmove(client->in, client->in + client->consumed, client->in_used - client->consumed);
    client->in_used -= client->consumed;
    client->consumed = 0;
    if (client->link && open_records(client))
        return;
    struct pollfd fd = {.fd = client->fd, .events = POLLIN};
    if (poll(&fd, 1, 60000) != 1)
        fail_msg("nothing came for 60 s");
    if (client->link) {
        if (!receive_sealed(client))
            fail_msg("the connection is closed");
        open_records(client);
        return;
    }
    ssize_t got = recv(client->fd, client->in + client->in_used, sizeof(client->in) - client->in_used, 0);
    if (got <= 0)
        fail_msg("the connection is closed");
    client->in_used += (size_t)got;
}

static inline void send_plainly(struct client *client, const uint8_t *next, size_t bytes)
{
    while (bytes) {
        ssize_t sent = send(client->fd, next, bytes, MSG_NOSIGNAL);
        assert_true(sent > 0);
        next += sent;
        bytes -= (size_t)sent;
    }
}

/* Sends the bytes that wait in the link. */
static inline void send_sealed(struct client *client)
{
    size_t bytes;
    const uint8_t *waiting = sealed_link_waiting(client->link, &bytes);
    send_plainly(client, waiting, bytes);
    sealed_link_sent(client->link, bytes);
}

static inline void send_bytes(struct client *client, const void *data, size_t bytes)
{
    const uint8_t *next = data;
    if (!client->link)
        send_plainly(client, next, bytes);
    for (size_t taken; client->link && bytes; next += taken, bytes -= taken) {
        taken = sealed_link_seal(client->link, next, bytes);
        send_sealed(client);
    }
}

static inline void pass_on(struct sealed_link *from, struct sealed_link *to)
{
    size_t bytes, free_bytes;
    const uint8_t *waiting = sealed_link_waiting(from, &bytes);
    if (!waiting)
        return;
    uint8_t *space = sealed_link_space(to, &free_bytes);
    assert_true(bytes <= free_bytes);
    memcpy(space, waiting, bytes);
    sealed_link_came(to, bytes);
    sealed_link_sent(from, bytes);
}

/* The exchange in memory, which a front has with a client that it hands over; `saved` gets the daemon's end. */
static inline void seal_with(struct client *client, const struct sealed_key *key, struct connection_saved *saved)
{
    struct decode_error error = {0};
    struct sealed_link *server = sealed_link_server(key, 1);
    client->link = sealed_link_client(key);
    assert_true(server && client->link);
    while (!sealed_is_open(client->link->sealed) || !sealed_is_open(server->sealed)) {
        pass_on(client->link, server);
        sealed_link_handshake(server, &error);
        pass_on(server, client->link);
        sealed_link_handshake(client->link, &error);
    }
    *saved = (struct connection_saved){.link_bytes = sealed_link_save(server, NULL)};
    saved->bytes = malloc(saved->link_bytes);
    assert_non_null(saved->bytes);
    sealed_link_save(server, saved->bytes);
    sealed_link_destroy(server);
}

static inline void send_message(struct client *client, uint32_t request, uint32_t channel,
                                const struct message *message)
{
    static uint8_t bytes[FRAMING_MESSAGE_MAX_BYTES];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    if (!message_write(&writer, request, channel, message))
        fail_msg("%s: %s", writer.error.field, writer.error.text);
    send_bytes(client, bytes, writer.used_bytes);
}

/* The next message but credit and blocked, NULL: none is there; it stays until the next call. */
static inline const struct message *receive_now(struct client *client)
{
    for (;;) {
        struct frame frame;
        struct decode_error error = {0};
        enum framing_result result =
            framing_parse(&frame, client->in + client->consumed, client->in_used - client->consumed,
                          MESSAGE_FROM_SERVER, &error);
        if (result == FRAMING_NEED_MORE) {
            struct pollfd fd = {.fd = client->fd, .events = POLLIN};
            if (poll(&fd, 1, 0) != 1)
                return NULL;
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
        if (client->message.type == MESSAGE_PING)
            client->pings++;
        else if (client->message.type == MESSAGE_CREDIT)
            client->upload_credit = client->message.credit.total;
        else if (client->message.type == MESSAGE_BLOCKED && ++client->blocked)
            snprintf(client->blocked_text, sizeof(client->blocked_text), "%s", client->message.blocked.text);
        else
            return &client->message;
    }
}

/* Waits for the next message. */
static inline const struct message *receive(struct client *client)
{
    const struct message *message;
    while (!(message = receive_now(client))) {
        struct pollfd fd = {.fd = client->fd, .events = POLLIN};
        if (poll(&fd, 1, 60000) != 1)
            fail_msg("nothing came for 60 s");
    }
    return message;
}

static inline void expect(struct client *client, enum message_type type, uint32_t request)
{
    const struct message *message = receive(client);
    if (message->type != type || client->header.request != request)
        fail_msg("%s of request %u came instead of %s of %u: %s", message_type_text(message->type),
                 client->header.request, message_type_text(type), request,
                 message->type == MESSAGE_ERROR ? message->error.text : "");
}

static inline void expect_error(struct client *client, uint32_t request, enum protocol_error_code code)
{
    expect(client, MESSAGE_ERROR, request);
    if (client->message.error.code != code)
        fail_msg("%s: %s", protocol_error_code_text(client->message.error.code), client->message.error.text);
}

static inline void expect_end(struct client *client)
{
    struct pollfd fd = {.fd = client->fd, .events = POLLIN};
    assert_int_equal(client->in_used, client->consumed);
    while (client->link && receive_sealed(client))
        assert_int_equal(open_records(client), 0);
    assert_true(!client->link || sealed_has_opened_last(client->link->sealed));
    assert_int_equal(poll(&fd, 1, 60000), 1);
    assert_int_equal(recv(client->fd, client->in, 1, 0), 0);
}

static inline struct message made(enum message_type type)
{
    struct message message;
    message_init(&message, type);
    return message;
}

static inline void expect_alive(struct client *client, uint32_t request)
{
    struct message message = made(MESSAGE_PING);
    message.ping.sent_ns = 1234567;
    send_message(client, request, 0, &message);
    expect(client, MESSAGE_PONG, request);
    assert_int_equal(client->message.pong.sent_ns, 1234567);
}

static inline void send_hello(struct client *client, uint64_t capabilities)
{
    struct handshake_hello hello = {.version_min = HANDSHAKE_VERSION_MIN,
                                    .version_max = HANDSHAKE_VERSION_MAX,
                                    .capabilities = capabilities,
                                    .name = "test"};
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    send_bytes(client, bytes, handshake_hello_encode(bytes, &hello));
}

static inline struct handshake_reply receive_reply(struct client *client)
{
    struct handshake_reply reply;
    struct decode_error error = {0};
    while (handshake_reply_parse(&reply, client->in, client->in_used, &client->consumed, &error) ==
           HANDSHAKE_NEED_MORE)
        receive_some(client);
    return reply;
}

/* The capabilities that both have. */
static inline uint64_t greet_with(struct client *client, uint64_t capabilities)
{
    send_hello(client, capabilities);
    struct handshake_reply reply = receive_reply(client);
    assert_int_equal(reply.version, HANDSHAKE_VERSION_MAX);
    client->limits = reply.limits;
    return client->capabilities = reply.capabilities;
}

static inline void begin_edit(struct client *client, uint32_t request, uint32_t scene)
{
    struct message message = made(MESSAGE_EDIT_BEGIN);
    message.edit_begin.scene = scene;
    send_message(client, request, 0, &message);
}

static inline void send_node(struct client *client, uint32_t request, uint32_t node, uint32_t parent)
{
    struct message message = made(MESSAGE_SET_NODE);
    message.set_node.node = node;
    message.set_node.value.parent = parent;
    for (int axis = 0; axis < 3; axis++)
        message.set_node.value.parent_from_node[5 * axis] = 1;
    send_message(client, request, 0, &message);
}

static inline void commit(struct client *client, uint32_t request)
{
    struct message message = made(MESSAGE_EDIT_COMMIT);
    send_message(client, request, 0, &message);
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

#endif
