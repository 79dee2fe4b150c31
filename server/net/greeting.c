/* SPDX-License-Identifier: MIT */
/* Answers to a client's hello, and to its sealed handshake. */
#include "net/greeting.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/sys.h"
#include "net/connection.h"

#include <stdlib.h>
#include <string.h>

static bool queue_bytes(struct connection *connection, const uint8_t *bytes, size_t count)
{
    struct out_message *message = count ? out_message_create(count) : NULL;
    if (!message) {
        connection_close(connection);
        return false;
    }
    memcpy(message->head, bytes, count);
    connection_send_raw(connection, message, false);
    return true;
}

static bool queue_reply(struct connection *connection, const struct handshake_reply *reply)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    return queue_bytes(connection, bytes, handshake_reply_encode(bytes, reply));
}

static void end(struct connection *connection)
{
    connection->state = CONNECTION_FLUSHING;
    connection->closing_since_ns = clock_now_ns();
}

void connection_refuse(struct connection *connection, const char *text, uint64_t capabilities)
{
    struct handshake_reply reply = {.capabilities = capabilities};
    strncpy(reply.text, text, sizeof(reply.text) - 1);
    if (queue_reply(connection, &reply))
        end(connection);
}

static void refuse_hello(struct connection *connection, struct handshake_reply *reply)
{
    reply->version = 0;
    if (queue_reply(connection, reply))
        end(connection);
}

void greeting_turn_away(int fd, const char *why, uint64_t capabilities)
{
    struct handshake_reply reply = {.capabilities = capabilities};
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    strncpy(reply.text, why, sizeof(reply.text) - 1);
    struct iovec part = {.iov_base = bytes, .iov_len = handshake_reply_encode(bytes, &reply)};
    struct msghdr message = {.msg_iov = &part, .msg_iovlen = 1};
    ssize_t sent = sys_sendmsg(fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    (void)sent; /* a peer that cannot receive it sees the end */
}

bool greeting_reserve_input(struct connection *connection)
{
    /* A sealed connection needs space for a record of any size behind the start of any message. */
    const size_t room_bytes = FRAMING_MESSAGE_MAX_BYTES + (connection->link ? SEALED_PLAIN_MAX_BYTES : 0);
    const size_t capacity_bytes = room_bytes > connection->in_used ? room_bytes : connection->in_used;
    if (connection->scratch_data)
        return true;
    uint8_t *in = malloc(capacity_bytes);
    void *scratch_data = malloc(SCRATCH_BYTES);
    if (!in || !scratch_data) {
        free(in);
        free(scratch_data);
        return false;
    }
    memcpy(in, connection->in, connection->in_used);
    free(connection->in);
    connection->in = in;
    connection->in_capacity = capacity_bytes;
    connection->scratch_data = scratch_data;
    scratch_init(&connection->scratch, scratch_data, SCRATCH_BYTES);
    return true;
}

/* ---- sealed ---- */

static void refuse_seal(struct connection *connection, enum sealed_status status)
{
    uint8_t bytes[SEALED_REFUSAL_BYTES];
    sealed_refuse(bytes, status);
    if (queue_bytes(connection, bytes, sizeof(bytes)))
        end(connection);
}

static void begin_seal(struct connection *connection)
{
    const struct connection_entry *entry = &connection->entry;
    if (!entry->key_count) {
        refuse_seal(connection, SEALED_NO_KEY);
        return;
    }
    uint64_t wait_ns = connection->handler->seal_wait_ns(connection->context);
    connection->seal_due_ns = wait_ns ? clock_now_ns() + wait_ns : 0;
    if (wait_ns)
        return; /* timeouts_check() continues */
    struct sealed_link *link = sealed_link_server(entry->keys, entry->key_count);
    if (!link) {
        log_write(LOG_ERROR, "net", "cannot accept a client: out of memory, or no random numbers");
        connection_close(connection);
        return;
    }
    size_t free_bytes;
    memcpy(sealed_link_space(link, &free_bytes), connection->in, connection->in_used);
    sealed_link_came(link, connection->in_used);
    connection->in_used = 0;
    connection->link = link;
}

/* Refuses with the reason that the link gives. */
static void refuse_link(struct connection *connection)
{
    sealed_link_refuse(connection->link);
    end(connection);
}

void greeting_refuse_key(struct connection *connection)
{
    refuse_link(connection);
}

static void continue_with_seal(struct connection *connection)
{
    struct decode_error error = {0};
    switch (sealed_link_handshake(connection->link, &error)) {
    case SEALED_CONSUMED:
        connection->handler->key_proved(connection->context, sealed_key_index(connection->link->sealed));
        if (!greeting_reserve_input(connection))
            connection_close(connection);
        return;
    case SEALED_NEED_MORE:
    case SEALED_NEED_ROOM:
        return;
    case SEALED_REFUSED:
        if (sealed_status(connection->link->sealed) != SEALED_WRONG_KEY) {
            refuse_link(connection);
            return;
        }
        connection->handler->key_failed(connection->context);
        connection->state = CONNECTION_WRONG_KEY;
        connection->closing_since_ns = clock_now_ns();
        return;
    case SEALED_FATAL:
        connection_close(connection);
        return;
    }
}

/* ---- hello ---- */

static void answer_hello(struct connection *connection)
{
    struct handshake_hello hello;
    struct handshake_reply reply = {0};
    struct decode_error error = {0};
    size_t consumed_bytes = 0;
    switch (handshake_hello_parse(&hello, connection->in, connection->in_used, &consumed_bytes, &error)) {
    case HANDSHAKE_NEED_MORE:
        return;
    case HANDSHAKE_FATAL:
        strncpy(reply.text, error.text, sizeof(reply.text) - 1);
        refuse_hello(connection, &reply);
        return;
    case HANDSHAKE_CONSUMED:
        break;
    }
    if (!connection->link && connection->entry.sealed_only) {
        reply.capabilities = HANDSHAKE_NEEDS_KEY;
        strncpy(reply.text, "this address needs a key: it accepts sealed connections only",
                sizeof(reply.text) - 1);
        refuse_hello(connection, &reply);
        return;
    }
    if (connection->handler->route) {
        connection->state = CONNECTION_ROUTED;
        connection->handler->route(connection->context, &hello);
        return;
    }
    if (!connection->handler->hello(connection->context, &hello, &reply)) {
        refuse_hello(connection, &reply);
        return;
    }
    if (!greeting_reserve_input(connection)) {
        connection_close(connection);
        return;
    }
    connection->in_used -= consumed_bytes;
    memmove(connection->in, connection->in + consumed_bytes, connection->in_used);
    if (!queue_reply(connection, &reply))
        return;
    connection->state = CONNECTION_OPEN;
    connection->handler->opened(connection->context);
}

void greeting_process(struct connection *connection)
{
    bool is_sealed = connection->link || (connection->in_used && connection->in[0] == SEALED_MAGIC[0]);
    if (is_sealed && !connection->link && connection->seal_due_ns <= clock_now_ns())
        begin_seal(connection);
    if (connection->state == CONNECTION_HELLO && connection->link && !sealed_is_open(connection->link->sealed))
        continue_with_seal(connection);
    if (connection->state == CONNECTION_HELLO &&
        (!is_sealed || (connection->link && sealed_is_open(connection->link->sealed))))
        answer_hello(connection);
}
