/* SPDX-License-Identifier: MIT */
/* Checks of time limits, and pings. */
#include "net/timeouts.h"

#include "base/log.h"
#include "base/log_rate.h"
#include "net/connection.h"
#include "net/greeting.h"

#include <stdio.h>

#define NS_PER_MS UINT64_C(1000000)
#define NS_PER_S UINT64_C(1000000000)
/* Timeout for the delivery of a goodbye. */
#define GOODBYE_NS (2 * NS_PER_S)
/* Number of pings: a waiting client gets one after each third of the time after which it counts as lost. */
#define PINGS 2u
/* Interval of pings to a client that is not read from, whose answers cannot arrive. */
#define HELD_PING_NS NS_PER_S
/* Minimum interval between two checks; the maximum is a minute. */
#define CHECK_MIN_NS (10 * NS_PER_MS)
#define CHECK_MAX_NS (60 * NS_PER_S)

static uint64_t since(uint64_t then_ns, uint64_t now_ns)
{
    return now_ns > then_ns ? now_ns - then_ns : 0;
}

/* Bytes of an incomplete message that must have arrived by now; 0 within the grace period. */
static uint64_t progress_due_bytes(const struct connection *connection, uint64_t now_ns)
{
    uint64_t elapsed_ns = since(connection->message_began_ns, now_ns);
    /* A client that is not read from cannot continue its message. */
    if (!connection->message_began_ns || connection->held || connection->over_soft_since_ns ||
        elapsed_ns < connection->limits->progress_grace_ms * NS_PER_MS)
        return 0;
    return elapsed_ns / NS_PER_MS * connection->limits->progress_bytes_per_s / 1000;
}

static bool is_idle(const struct connection *connection, uint64_t now_ns)
{
    uint64_t idle_ns = connection->limits->idle_ms * NS_PER_MS;
    return idle_ns && since(connection->last_received_ns, now_ns) >= idle_ns &&
           since(connection->last_sent_ns, now_ns) >= idle_ns &&
           !connection->handler->awaited(connection->context);
}

static uint64_t later(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns > b_ns ? a_ns : b_ns;
}

/* Interval of pings; UINT64_MAX: never. */
static uint64_t ping_interval_ns(const struct connection *connection)
{
    if (connection->held)
        return HELD_PING_NS;
    return connection->limits->lost_ms ? connection->limits->lost_ms * NS_PER_MS / (PINGS + 1) : UINT64_MAX;
}

static void send_ping(struct connection *connection, uint64_t now_ns)
{
    struct message message;
    message_init(&message, MESSAGE_PING);
    message.ping.sent_ns = now_ns;
    connection_send(connection, 0, 0, &message);
}

/* Pings a client that waits for something, or ends it if it has answered none. Pings are counted, not time:
 * after a pause of this process, messages that the client sent meanwhile are read before the next ping is due. */
static void check_answers(struct connection *connection, uint64_t now_ns)
{
    uint64_t last_ns = later(connection->last_received_ns, connection->checked_ns);
    char text[128];
    if (since(last_ns, now_ns) < ping_interval_ns(connection))
        return;
    connection->checked_ns = now_ns;
    if (connection->held || connection->over_soft_since_ns) {
        connection->unanswered = 0;
        if (!connection->out.queued_bytes)
            send_ping(connection, now_ns);
    } else if (!connection->handler->awaited(connection->context)) {
        connection->unanswered = 0;
    } else if (connection->unanswered++ < PINGS) {
        send_ping(connection, now_ns);
    } else {
        if (log_is_due(connection->entry.log_source, "answers no ping"))
            log_write(LOG_INFO, "net", "disconnected a client that waits and answers no ping");
        snprintf(text, sizeof(text), "no message for %u seconds, and no answer to pings",
                 connection->limits->lost_ms / 1000);
        connection_finish(connection, PROTOCOL_ERROR_TIMEOUT, "", text);
    }
}

static void check_open(struct connection *connection, uint64_t now_ns)
{
    const struct connection_limits *limits = connection->limits;
    char text[128];
    if (connection->over_soft_since_ns &&
        since(connection->over_soft_since_ns, now_ns) >= limits->queued_soft_ms * NS_PER_MS) {
        if (log_is_due(connection->entry.log_source, "reads slowly"))
            log_write(LOG_WARNING, "net", "disconnected a client that reads too slowly: %zu bytes wait for it",
                      connection->out.queued_bytes);
        connection_close(connection);
        return;
    }
    if (connection_incoming_bytes(connection) < progress_due_bytes(connection, now_ns)) {
        snprintf(text, sizeof(text), "a message arrived at less than %u bytes a second",
                 limits->progress_bytes_per_s);
        connection_finish(connection, PROTOCOL_ERROR_TIMEOUT, "", text);
        return;
    }
    /* A client that has not read for that long will not read any more. */
    if (limits->idle_ms && connection->out.queued_bytes &&
        since(connection->last_sent_ns, now_ns) >= limits->idle_ms * NS_PER_MS) {
        if (log_is_due(connection->entry.log_source, "stopped reading"))
            log_write(LOG_INFO, "net", "disconnected a client that stopped reading");
        connection_close(connection);
        return;
    }
    if (is_idle(connection, now_ns)) {
        snprintf(text, sizeof(text), "no message for %u seconds", limits->idle_ms / 1000);
        connection_finish(connection, PROTOCOL_ERROR_TIMEOUT, "", text);
        return;
    }
    check_answers(connection, now_ns);
}

void timeouts_check(struct connection *connection, uint64_t now_ns)
{
    switch (connection->state) {
    case CONNECTION_HELLO:
        if (since(connection->connected_ns, now_ns) >= connection->limits->handshake_ms * NS_PER_MS)
            connection_close(connection);
        else if (connection->seal_due_ns)
            greeting_process(connection);
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
    case CONNECTION_ROUTED: /* the router limits the time */
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

uint64_t timeouts_next_check_ns(const struct connection *connection, uint64_t now_ns)
{
    const struct connection_limits *limits = connection->limits;
    uint64_t wait_ns = CHECK_MAX_NS;
    if (connection->state == CONNECTION_HELLO) {
        no_later(&wait_ns, connection->connected_ns, limits->handshake_ms * NS_PER_MS, now_ns);
        if (connection->seal_due_ns)
            no_later(&wait_ns, now_ns, since(now_ns, connection->seal_due_ns), now_ns);
    } else if (connection->state == CONNECTION_WRONG_KEY)
        no_later(&wait_ns, connection->closing_since_ns, limits->wrong_key_ms * NS_PER_MS, now_ns);
    else if (connection->state != CONNECTION_OPEN && connection->state != CONNECTION_ROUTED)
        no_later(&wait_ns, connection->closing_since_ns, GOODBYE_NS, now_ns);
    else {
        if (connection->over_soft_since_ns)
            no_later(&wait_ns, connection->over_soft_since_ns, limits->queued_soft_ms * NS_PER_MS, now_ns);
        if (connection->message_began_ns && progress_due_bytes(connection, now_ns))
            no_later(&wait_ns, now_ns, NS_PER_S, now_ns);
        else if (connection->message_began_ns)
            no_later(&wait_ns, connection->message_began_ns, limits->progress_grace_ms * NS_PER_MS, now_ns);
        uint64_t idle_ns = limits->idle_ms * NS_PER_MS;
        uint64_t last_ns = later(connection->last_received_ns, connection->last_sent_ns);
        /* An idle client that waits for an answer is checked once a second. */
        if (idle_ns && since(last_ns, now_ns) < idle_ns)
            no_later(&wait_ns, last_ns, idle_ns, now_ns);
        else if (idle_ns)
            no_later(&wait_ns, now_ns, NS_PER_S, now_ns);
        no_later(&wait_ns, later(connection->last_received_ns, connection->checked_ns),
                 ping_interval_ns(connection), now_ns);
    }
    return wait_ns < CHECK_MIN_NS ? CHECK_MIN_NS : wait_ns;
}
