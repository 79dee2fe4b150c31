/* SPDX-License-Identifier: MIT */
#include "net/patience.h"

#include "base/log.h"
#include "net/connection.h"
#include "net/greeting.h"

#include <stdio.h>

#define NS_PER_MS UINT64_C(1000000)
#define NS_PER_S UINT64_C(1000000000)
/* A goodbye that is not taken in this time is not waited for. */
#define GOODBYE_NS (2 * NS_PER_S)
/* Nothing is checked more often, nor less often than once a minute. */
#define CHECK_MIN_NS (10 * NS_PER_MS)
#define CHECK_MAX_NS (60 * NS_PER_S)

static uint64_t since(uint64_t then_ns, uint64_t now_ns)
{
    return now_ns > then_ns ? now_ns - then_ns : 0;
}

/* Bytes of an incomplete message that should be there by now; 0 within the grace. */
static uint64_t progress_due_bytes(const struct connection *connection, uint64_t now_ns)
{
    uint64_t elapsed_ns = since(connection->message_began_ns, now_ns);
    /* While nothing is read from it, the client cannot go on. */
    if (!connection->message_began_ns || connection->held || connection->over_soft_since_ns ||
        elapsed_ns < connection->limits->progress_grace_ms * NS_PER_MS)
        return 0;
    return elapsed_ns / NS_PER_MS * connection->limits->progress_bytes_per_s / 1000;
}

static bool is_idle(const struct connection *connection, uint64_t now_ns)
{
    uint64_t idle_ns = connection->limits->idle_ms * NS_PER_MS;
    return idle_ns && since(connection->last_received_ns, now_ns) >= idle_ns &&
           since(connection->last_sent_ns, now_ns) >= idle_ns && !connection->handler->owed(connection->context);
}

static void check_open(struct connection *connection, uint64_t now_ns)
{
    const struct connection_limits *limits = connection->limits;
    char text[128];
    if (connection->over_soft_since_ns &&
        since(connection->over_soft_since_ns, now_ns) >= limits->queued_soft_ms * NS_PER_MS) {
        log_write(LOG_WARNING, "net", "a client reads too slowly: %zu bytes wait for it; it is disconnected",
                  connection->out.queued_bytes);
        connection_close(connection);
        return;
    }
    if (connection_incoming_bytes(connection) < progress_due_bytes(connection, now_ns)) {
        snprintf(text, sizeof text, "a message came slower than %u bytes a second", limits->progress_bytes_per_s);
        connection_finish(connection, PROTOCOL_ERROR_CODE_TIMEOUT, "", text);
        return;
    }
    /* What waits to be sent for that long will not be read any more. */
    if (limits->idle_ms && connection->out.queued_bytes &&
        since(connection->last_sent_ns, now_ns) >= limits->idle_ms * NS_PER_MS) {
        log_write(LOG_INFO, "net", "a client stopped reading; it is disconnected");
        connection_close(connection);
        return;
    }
    if (is_idle(connection, now_ns)) {
        snprintf(text, sizeof text, "nothing came for %u seconds", limits->idle_ms / 1000);
        connection_finish(connection, PROTOCOL_ERROR_CODE_TIMEOUT, "", text);
    }
}

void patience_check(struct connection *connection, uint64_t now_ns)
{
    switch (connection->state) {
    case CONNECTION_HELLO:
        if (since(connection->connected_ns, now_ns) >= connection->limits->handshake_ms * NS_PER_MS)
            connection_close(connection);
        return;
    case CONNECTION_WRONG_KEY:
        if (since(connection->closing_since_ns, now_ns) >= connection->limits->wrong_key_ms * NS_PER_MS)
            greeting_refuse_key(connection);
        return;
    case CONNECTION_OPEN:
        check_open(connection, now_ns);
        return;
    case CONNECTION_FLUSHING:
    case CONNECTION_LINGERING:
        if (since(connection->closing_since_ns, now_ns) >= GOODBYE_NS)
            connection_close(connection);
        return;
    case CONNECTION_CLOSED:
        return;
    }
}

static void no_later(uint64_t *wait_ns, uint64_t since_ns, uint64_t allowed_ns, uint64_t now_ns)
{
    uint64_t elapsed_ns = since(since_ns, now_ns);
    uint64_t left_ns = allowed_ns > elapsed_ns ? allowed_ns - elapsed_ns : 0;
    if (left_ns < *wait_ns)
        *wait_ns = left_ns;
}

uint64_t patience_next_check_ns(const struct connection *connection, uint64_t now_ns)
{
    const struct connection_limits *limits = connection->limits;
    uint64_t wait_ns = CHECK_MAX_NS;
    if (connection->state == CONNECTION_HELLO)
        no_later(&wait_ns, connection->connected_ns, limits->handshake_ms * NS_PER_MS, now_ns);
    else if (connection->state == CONNECTION_WRONG_KEY)
        no_later(&wait_ns, connection->closing_since_ns, limits->wrong_key_ms * NS_PER_MS, now_ns);
    else if (connection->state != CONNECTION_OPEN)
        no_later(&wait_ns, connection->closing_since_ns, GOODBYE_NS, now_ns);
    else {
        if (connection->over_soft_since_ns)
            no_later(&wait_ns, connection->over_soft_since_ns, limits->queued_soft_ms * NS_PER_MS, now_ns);
        if (connection->message_began_ns && progress_due_bytes(connection, now_ns))
            no_later(&wait_ns, now_ns, NS_PER_S, now_ns);
        else if (connection->message_began_ns)
            no_later(&wait_ns, connection->message_began_ns, limits->progress_grace_ms * NS_PER_MS, now_ns);
        uint64_t idle_ns = limits->idle_ms * NS_PER_MS;
        uint64_t last_ns = connection->last_received_ns > connection->last_sent_ns ? connection->last_received_ns
                                                                                   : connection->last_sent_ns;
        /* Once idle for long but owed something, a look once a second is often enough. */
        if (idle_ns && since(last_ns, now_ns) < idle_ns)
            no_later(&wait_ns, last_ns, idle_ns, now_ns);
        else if (idle_ns)
            no_later(&wait_ns, now_ns, NS_PER_S, now_ns);
    }
    return wait_ns < CHECK_MIN_NS ? CHECK_MIN_NS : wait_ns;
}
