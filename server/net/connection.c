/* SPDX-License-Identifier: MIT */
/* State of a connection, and its turns in the loop. */
#include "net/connection.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "base/sys.h"
#include "net/greeting.h"
#include "net/timeouts.h"
#include "net/sealing.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Limits of bytes sent to one client, and received from it, before others get their turn. Connections that
 * share a turn share a count of messages. */
#define SENT_BYTES_A_TURN ((size_t)2 << 20)
#define RECEIVED_BYTES_A_TURN ((size_t)256 << 10)
#define MESSAGES_A_TURN 64
/* Maximum of queued bulk, which a cancel, and another job's frame, have to wait for. */
#define BULK_QUEUED_BYTES ((size_t)512 << 10)
#define PARTS_A_CALL 64

static void turn_end(void *context);
static void on_ready(void *context, uint32_t epoll_events);
static void on_timer(void *context);

static unsigned messages_a_turn(const struct connection *connection)
{
    unsigned sharers = connection->entry.sharers ? *connection->entry.sharers : 0;
    unsigned share = sharers ? MESSAGES_A_TURN / sharers : MESSAGES_A_TURN;
    return share ? share : 1;
}

/* Restores the link, if there is one. False: it could not be restored. */
static bool restore_link(struct sealed_link **link, const struct connection_saved *saved)
{
    *link =
        saved && saved->link_bytes ? sealed_link_restore(saved->bytes + saved->in_bytes, saved->link_bytes) : NULL;
    return *link || !saved || !saved->link_bytes;
}

struct connection *connection_create(struct loop *loop, int fd, const struct connection_limits *limits,
                                     const struct connection_entry *entry,
                                     const struct connection_handler *handler, void *context,
                                     const struct connection_saved *saved, struct error *error)
{
    const size_t in_bytes = saved ? saved->in_bytes : 0;
    const size_t in_capacity = in_bytes > HANDSHAKE_HELLO_MAX_BYTES ? in_bytes : HANDSHAKE_HELLO_MAX_BYTES;
    struct connection *connection = calloc(1, sizeof(*connection));
    struct sealed_link *link = NULL;
    uint8_t *in = malloc(in_capacity);
    struct loop_watch *watch = connection && in && restore_link(&link, saved)
                                   ? loop_watch_add(loop, fd, EPOLLIN, on_ready, connection, error)
                                   : NULL;
    if (!watch) {
        error_set(error, ERROR_OUT_OF_MEMORY, "connection", "no memory");
        sealed_link_destroy(link);
        free(in);
        free(connection);
        return NULL;
    }
    if (in_bytes)
        memcpy(in, saved->bytes, in_bytes);
    uint64_t now_ns = clock_now_ns();
    *connection = (struct connection){
        .loop = loop,
        .limits = limits,
        .handler = handler,
        .context = context,
        .entry = *entry,
        .fd = fd,
        .watch = watch,
        .timer = {.call = on_timer, .context = connection},
        .turn_end = {.call = turn_end, .context = connection},
        .link = link,
        .in = in,
        .in_capacity = in_capacity,
        .in_used = in_bytes,
        .connected_ns = now_ns,
        .last_received_ns = now_ns,
        .last_sent_ns = now_ns,
        .messages_left = MESSAGES_A_TURN,
    };
    out_queue_init(&connection->out);
    if (saved && saved->is_open) {
        connection->state = CONNECTION_OPEN;
        if (!greeting_reserve_input(connection))
            connection->state = CONNECTION_CLOSED; /* the client counts as gone */
    }
    loop_defer(loop, &connection->turn_end);
    return connection;
}

bool connection_save(const struct connection *connection, const uint8_t *message, size_t message_bytes,
                     struct connection_saved *saved)
{
    *saved = (struct connection_saved){
        .in_bytes = message_bytes + connection->in_used,
        .link_bytes = connection->link ? sealed_link_save(connection->link, NULL) : 0,
        .is_open = connection->state == CONNECTION_OPEN,
    };
    saved->bytes = malloc(saved->in_bytes + saved->link_bytes);
    if (!saved->bytes)
        return false;
    if (message)
        memcpy(saved->bytes, message, message_bytes);
    memcpy(saved->bytes + message_bytes, connection->in, connection->in_used);
    if (connection->link)
        sealed_link_save(connection->link, saved->bytes + saved->in_bytes);
    return true;
}

static void destroy(struct connection *connection)
{
    loop_timer_stop(connection->loop, &connection->timer);
    loop_watch_remove(connection->watch);
    close(connection->fd);
    out_queue_finish(&connection->out);
    sealed_link_destroy(connection->link);
    free(connection->scratch_data);
    free(connection->in);
    free(connection);
}

void connection_close(struct connection *connection)
{
    connection->state = CONNECTION_CLOSED;
    loop_defer(connection->loop, &connection->turn_end);
}

static void queue_error(struct connection *connection, enum protocol_error_code code, const char *field,
                        const char *text)
{
    struct message message;
    message_init(&message, MESSAGE_ERROR);
    message.error.code = code;
    message.error.field = field;
    message.error.text = text;
    connection_send(connection, 0, 0, &message);
}

void connection_finish(struct connection *connection, enum protocol_error_code code, const char *field,
                       const char *text)
{
    if (connection->state == CONNECTION_HELLO || connection->state == CONNECTION_WRONG_KEY ||
        connection->state == CONNECTION_ROUTED) {
        /* No message may be sent in an earlier state. */
        connection_close(connection);
        return;
    }
    if (connection->state != CONNECTION_OPEN)
        return;
    out_queue_drop_all_bulk(&connection->out);
    if (code != PROTOCOL_ERROR_NONE)
        queue_error(connection, code, field, text);
    struct message message;
    message_init(&message, MESSAGE_GOODBYE);
    message.goodbye.code = code;
    message.goodbye.text = text;
    connection_send(connection, 0, 0, &message);
    if (connection->state != CONNECTION_OPEN)
        return;
    connection->state = CONNECTION_FLUSHING;
    connection->closing_since_ns = clock_now_ns();
    loop_defer(connection->loop, &connection->turn_end);
}

/* ---- sending ---------------------------------------------------------------------------------------- */

bool connection_send(struct connection *connection, uint32_t request, uint32_t channel,
                     const struct message *message)
{
    if (connection->state != CONNECTION_OPEN)
        return false;
    struct out_message *out = out_message_create(message_write_bytes(message));
    if (!out) {
        log_write(LOG_ERROR, "net", "disconnected a client: out of memory for an answer to it");
        connection_close(connection);
        return false;
    }
    struct writer writer;
    writer_init(&writer, out->head, out->head_bytes);
    if (!message_write(&writer, request, channel, message)) {
        log_write(LOG_ERROR, "net", "a %s message cannot be sent: %s: %s", message_type_text(message->type),
                  writer.error.field, writer.error.text);
        free(out);
        return false;
    }
    out->head_bytes = writer.used_bytes;
    connection_send_raw(connection, out, false);
    return true;
}

void connection_send_raw(struct connection *connection, struct out_message *message, bool bulk)
{
    out_queue_push(&connection->out, message, bulk);
    loop_defer(connection->loop, &connection->turn_end);
    if (connection->out.queued_bytes > connection->limits->queued_hard_bytes) {
        if (log_is_due(connection->entry.log_source, "does not read"))
            log_write(LOG_WARNING, "net", "disconnected a client that does not read: %zu bytes wait for it",
                      connection->out.queued_bytes);
        connection_close(connection);
    }
}

void connection_wake(struct connection *connection)
{
    loop_defer(connection->loop, &connection->turn_end);
}

bool connection_wants_bulk(const struct connection *connection)
{
    return connection->state == CONNECTION_OPEN && connection->out.queued_bytes < BULK_QUEUED_BYTES;
}

static void flush(struct connection *connection)
{
    size_t sent_bytes = 0;
    while (connection->state != CONNECTION_CLOSED && sent_bytes < SENT_BYTES_A_TURN) {
        if (connection_wants_bulk(connection))
            connection->handler->room(connection->context);
        struct iovec parts[PARTS_A_CALL];
        struct msghdr message = {.msg_iov = parts};
        uint64_t before_ns = clock_now_ns();
        message.msg_iovlen = connection->link ? sealing_gather(connection, parts)
                                              : out_queue_gather(&connection->out, parts, PARTS_A_CALL);
        connection->write_blocked = false;
        if (!message.msg_iovlen || connection->state == CONNECTION_CLOSED)
            return;
        ssize_t sent = sys_sendmsg(connection->fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
        connection->write_blocked = true; /* the socket is full, or more waits than one turn may send */
        if (sent < 0) {
            if (errno != EAGAIN && errno != EWOULDBLOCK)
                connection_close(connection);
            return;
        }
        uint64_t now_ns = clock_now_ns();
        sent_bytes += (size_t)sent;
        connection->sent_bytes += (uint64_t)sent;
        connection->last_sent_ns = now_ns;
        size_t queued_sent_bytes =
            connection->link ? sealed_link_sent(connection->link, (size_t)sent) : (size_t)sent;
        out_queue_advance(&connection->out, queued_sent_bytes, before_ns, now_ns);
    }
}

/* ---- receiving -------------------------------------------------------------------------------------- */

/* Decodes the message at *offset and passes it on. False: no whole message is left. */
static bool process_message(struct connection *connection, size_t *offset)
{
    struct frame frame;
    struct decode_error error = {0};
    const uint8_t *bytes = connection->in + *offset;
    switch (framing_parse(&frame, bytes, connection->in_used - *offset, MESSAGE_FROM_CLIENT, &error)) {
    case FRAMING_NEED_MORE:
        return false;
    case FRAMING_FATAL:
        connection_finish(connection, error.code, error.field, error.text);
        return false;
    case FRAMING_CONSUMED:
        break;
    }
    *offset += frame.consumed_bytes;
    connection->message_began_ns = 0;
    if (!frame.info)
        return true;
    struct message message;
    scratch_reset(&connection->scratch);
    if (message_decode(&message, frame.header.type, frame.payload, frame.header.payload_bytes,
                       &connection->scratch, &error))
        connection->handler->message(connection->context, &frame.header, &message);
    else if (error.code == PROTOCOL_ERROR_INVALID)
        connection->handler->invalid(connection->context, &frame.header, &error);
    else
        connection_finish(connection, error.code, error.field, error.text);
    return true;
}

size_t connection_incoming_bytes(const struct connection *connection)
{
    return connection->in_used + (connection->link ? sealed_link_unopened(connection->link) : 0);
}

static void drop_input(struct connection *connection)
{
    connection->in_used = 0;
    if (connection->link)
        sealed_link_drop_input(connection->link);
}

static bool may_process(const struct connection *connection)
{
    return connection->state == CONNECTION_OPEN && !connection->held && connection->messages_left;
}

static void process_messages(struct connection *connection)
{
    size_t offset = 0;
    while (may_process(connection) && offset < connection->in_used && process_message(connection, &offset))
        connection->messages_left--;
    connection->in_used -= offset;
    memmove(connection->in, connection->in + offset, connection->in_used);
    if (!connection_incoming_bytes(connection) || !connection->messages_left)
        connection->message_began_ns = 0; /* the rest may be whole messages */
    else if (!connection->message_began_ns)
        connection->message_began_ns = clock_now_ns();
}

void connection_hold(struct connection *connection, bool held)
{
    if (connection->held && !held)
        connection->message_began_ns = 0; /* the client is not charged for the time that it was held */
    connection->held = held;
    loop_defer(connection->loop, &connection->turn_end);
}

static bool may_read(const struct connection *connection)
{
    switch (connection->state) {
    case CONNECTION_HELLO:
        return true;
    case CONNECTION_OPEN:
        return !connection->held && connection->out.queued_bytes <= connection->limits->queued_soft_bytes;
    case CONNECTION_LINGERING:
        return true;
    case CONNECTION_WRONG_KEY:
    case CONNECTION_ROUTED:
    case CONNECTION_FLUSHING:
    case CONNECTION_CLOSED:
        return false;
    }
    return false;
}

/* Whether records arrived while reading was off: the socket does not announce them again. */
static bool has_waiting_records(const struct connection *connection)
{
    return connection->link && may_read(connection) && sealed_link_has_record(connection->link);
}

static void process(struct connection *connection)
{
    do {
        if (connection->state == CONNECTION_HELLO)
            greeting_process(connection);
        if (connection->state == CONNECTION_OPEN)
            process_messages(connection);
    } while (connection->link && sealed_is_open(connection->link->sealed) && connection->messages_left &&
             may_read(connection) && sealing_open_next(connection));
    if (connection->state == CONNECTION_FLUSHING || connection->state == CONNECTION_LINGERING)
        drop_input(connection);
}

static void receive(struct connection *connection)
{
    size_t received_bytes = 0;
    if (has_waiting_records(connection))
        process(connection); /* messages release space */
    while (may_read(connection) && connection->messages_left && received_bytes < RECEIVED_BYTES_A_TURN) {
        size_t free_bytes = connection->in_capacity - connection->in_used;
        uint8_t *space = connection->in + connection->in_used;
        if (connection->link)
            space = sealed_link_space(connection->link, &free_bytes);
        ssize_t got = sys_read(connection->fd, space, free_bytes);
        if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK))
            return;
        if (got <= 0) {
            connection_close(connection);
            return;
        }
        received_bytes += (size_t)got;
        if (connection->link)
            sealed_link_came(connection->link, (size_t)got);
        else
            connection->in_used += (size_t)got;
        connection->received_bytes += (uint64_t)got;
        connection->last_received_ns = clock_now_ns();
        connection->unanswered = 0;
        process(connection);
        if ((size_t)got < free_bytes)
            return; /* usually nothing is left; otherwise the loop reports it again */
    }
}

/* ---- callbacks of the loop -------------------------------------------------------------------------- */

static void on_ready(void *context, uint32_t epoll_events)
{
    struct connection *connection = context;
    if (epoll_events & (EPOLLIN | EPOLLHUP | EPOLLERR)) {
        /* A lost peer is reported even while nothing is read from it. */
        if ((epoll_events & (EPOLLHUP | EPOLLERR)) && !may_read(connection))
            connection_close(connection);
        else
            receive(connection);
    }
    loop_defer(connection->loop, &connection->turn_end);
}

static void linger(struct connection *connection)
{
    shutdown(connection->fd, SHUT_WR);
    connection->state = CONNECTION_LINGERING;
    drop_input(connection);
}

static bool has_flushed(const struct connection *connection)
{
    return !connection->out.queued_bytes && (!connection->link || sealing_is_done(connection));
}

/* Ends a turn: sends, sets the events to wait for, or releases the connection. */
static void turn_end(void *context)
{
    struct connection *connection = context;
    bool was_held = connection->in_used && !connection->message_began_ns;
    connection->messages_left = messages_a_turn(connection);
    /* Messages may have arrived before the connection was held or its turn ended, or another process has read a
     * hello. */
    if (connection->state == CONNECTION_HELLO
            ? connection->in_used > 0
            : may_process(connection) && (was_held || has_waiting_records(connection)))
        process(connection);
    flush(connection);
    if (connection->state == CONNECTION_FLUSHING && has_flushed(connection))
        linger(connection);
    if (connection->state == CONNECTION_CLOSED) {
        if (connection->turn_end.waiting)
            return; /* the lines above have closed it: the next turn releases it */
        connection->handler->closed(connection->context);
        destroy(connection);
        return;
    }
    bool over_soft = connection->out.queued_bytes > connection->limits->queued_soft_bytes;
    if (over_soft && !connection->over_soft_since_ns) {
        connection->over_soft_since_ns = clock_now_ns();
    } else if (!over_soft && connection->over_soft_since_ns) {
        connection->over_soft_since_ns = 0;
        if (connection->message_began_ns)
            connection->message_began_ns = clock_now_ns(); /* blocked until now */
    }
    if (has_waiting_records(connection) || !connection->messages_left)
        loop_defer(connection->loop, &connection->turn_end);
    loop_watch_change(connection->watch, (may_read(connection) ? (uint32_t)EPOLLIN : 0) |
                                             (connection->write_blocked ? (uint32_t)EPOLLOUT : 0));
    loop_timer_start(connection->loop, &connection->timer, timeouts_next_check_ns(connection, clock_now_ns()));
}

static void on_timer(void *context)
{
    struct connection *connection = context;
    timeouts_check(connection, clock_now_ns());
    loop_defer(connection->loop, &connection->turn_end);
}
