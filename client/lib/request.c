/* SPDX-License-Identifier: MIT */
/* Requests of one message and one answer. */
#include "lib/connection.h"
#include "protocol/common/clock.h"

#define ANSWER_NS 30000000000ull

bool fl_connection_ask(struct fl_connection *connection, const struct message *question,
                       enum message_type expected, struct fl_received *received, struct fl_error *error)
{
    const uint32_t request = fl_connection_next_request(connection);
    return fl_connection_send(connection, request, 0, question, error) &&
           fl_connection_answer(connection, request, expected, received, monotonic_now_ns() + ANSWER_NS, error);
}

bool fl_ping(struct fl_connection *connection, uint64_t *round_trip_ns, struct fl_error *error)
{
    struct message ping = {.type = MESSAGE_PING};
    struct fl_received received;
    const uint32_t request = fl_connection_next_request(connection);
    const uint64_t sent_ns = monotonic_now_ns();
    ping.ping.sent_ns = sent_ns;
    if (!fl_connection_send(connection, request, 0, &ping, error) ||
        !fl_connection_answer(connection, request, MESSAGE_PONG, &received, sent_ns + ANSWER_NS, error))
        return false;
    *round_trip_ns = monotonic_now_ns() - sent_ns;
    return true;
}

bool fl_stats(struct fl_connection *connection, const struct message_stats_reply **reply, struct fl_error *error)
{
    const struct message ask = {.type = MESSAGE_STATS};
    struct fl_received received;
    if (!fl_connection_ask(connection, &ask, MESSAGE_STATS_REPLY, &received, error))
        return false;
    connection->stats =
        received.message.stats_reply; /* its strings and arrays stay in the stream's scratch buffer */
    *reply = &connection->stats;
    return true;
}

bool fl_connection_wait(struct fl_connection *connection, unsigned timeout_ms, struct fl_error *error)
{
    const uint64_t end_ns = monotonic_now_ns() + timeout_ms * UINT64_C(1000000);
    struct fl_received dropped;
    while (fl_connection_receive(connection, &dropped, end_ns, error))
        continue;
    if (error->code != FL_ERROR_TIMEOUT)
        return false;
    *error = (struct fl_error){0};
    return true;
}

bool fl_connection_listens_at(const struct fl_connection *connection, size_t index, char *address,
                              size_t address_bytes)
{
    return fl_process_find_line(&connection->process, "READY ", index, address, address_bytes);
}
