/* SPDX-License-Identifier: MIT */
#include "net/greeting.h"

#include "base/clock.h"
#include "net/connection.h"

#include <stdlib.h>
#include <string.h>

static bool queue_reply(struct connection *connection, const struct handshake_reply *reply)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    size_t count = handshake_reply_encode(bytes, reply);
    struct out_message *message = count ? out_message_create(count) : NULL;
    if (!message) {
        connection_close(connection);
        return false;
    }
    memcpy(message->head, bytes, count);
    connection_send_raw(connection, message, false);
    return true;
}

static void refuse_hello(struct connection *connection, struct handshake_reply *reply)
{
    reply->version = 0;
    if (!queue_reply(connection, reply))
        return;
    connection->state = CONNECTION_FLUSHING;
    connection->closing_since_ns = clock_now_ns();
}

static bool make_room_for_messages(struct connection *connection, size_t consumed_bytes)
{
    uint8_t *in = malloc(FRAMING_MESSAGE_MAX_BYTES);
    void *scratch_data = malloc(SCRATCH_BYTES);
    if (!in || !scratch_data) {
        free(in);
        free(scratch_data);
        return false;
    }
    connection->in_used -= consumed_bytes;
    memcpy(in, connection->in + consumed_bytes, connection->in_used);
    free(connection->in);
    connection->in = in;
    connection->in_capacity = FRAMING_MESSAGE_MAX_BYTES;
    connection->scratch_data = scratch_data;
    scratch_init(&connection->scratch, scratch_data, SCRATCH_BYTES);
    return true;
}

void greeting_process(struct connection *connection)
{
    struct handshake_hello hello;
    struct handshake_reply reply = {0};
    struct decode_error error = {0};
    size_t consumed_bytes = 0;
    switch (handshake_hello_parse(&hello, connection->in, connection->in_used, &consumed_bytes, &error)) {
    case HANDSHAKE_NEED_MORE:
        return;
    case HANDSHAKE_FATAL:
        strncpy(reply.text, error.text, sizeof reply.text - 1);
        refuse_hello(connection, &reply);
        return;
    case HANDSHAKE_CONSUMED:
        break;
    }
    if (!connection->handler->hello(connection->context, &hello, &reply)) {
        refuse_hello(connection, &reply);
        return;
    }
    if (!make_room_for_messages(connection, consumed_bytes)) {
        connection_close(connection);
        return;
    }
    if (!queue_reply(connection, &reply))
        return;
    connection->state = CONNECTION_OPEN;
    connection->handler->opened(connection->context);
}
