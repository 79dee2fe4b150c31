/* SPDX-License-Identifier: MIT */
/* Messages over one non-blocking descriptor, sealed or not. */
#include "lib/stream.h"

#include "protocol/sealed/link.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

bool fl_stream_init(struct fl_stream *stream, int fd, uint32_t accept, const char *peer, struct fl_error *error)
{
    *stream = (struct fl_stream){.fd = fd, .accept = accept, .peer = peer};
    const int flags = fcntl(fd, F_GETFL);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0) {
        fl_error_set(error, FL_ERROR_SYSTEM, "", "cannot use the connection to %s: %s", peer, strerror(errno));
        fl_stream_finish(stream);
        return false;
    }
    stream->in = malloc(FL_STREAM_BUFFER_BYTES);
    stream->out = malloc(FL_STREAM_BUFFER_BYTES);
    stream->scratch_data = malloc(SCRATCH_BYTES);
    if (!stream->in || !stream->out || !stream->scratch_data) {
        fl_stream_finish(stream);
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    }
    scratch_init(&stream->scratch, stream->scratch_data, SCRATCH_BYTES);
    return true;
}

bool fl_stream_seal(struct fl_stream *stream, const struct sealed_key *key, struct fl_error *error)
{
    stream->link = sealed_link_client(key);
    return stream->link || fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory, or no random numbers");
}

bool fl_stream_is_whole(const struct fl_stream *stream)
{
    return !stream->link || sealed_has_opened_last(stream->link->sealed);
}

void fl_stream_finish(struct fl_stream *stream)
{
    if (stream->fd >= 0)
        close(stream->fd);
    sealed_link_destroy(stream->link);
    free(stream->in);
    free(stream->out);
    free(stream->scratch_data);
    *stream = (struct fl_stream){.fd = -1, .peer = stream->peer};
}

bool fl_stream_has_output(const struct fl_stream *stream)
{
    return stream->out_end > stream->out_start;
}

bool fl_stream_has_room(const struct fl_stream *stream)
{
    return FL_STREAM_BUFFER_BYTES - (stream->out_end - stream->out_start) >= FRAMING_MESSAGE_MAX_BYTES;
}

/* Makes the free space of a buffer contiguous. */
static void compact(uint8_t *data, size_t *start, size_t *end)
{
    if (*start == 0)
        return;
    memmove(data, data + *start, *end - *start);
    *end -= *start;
    *start = 0;
}

bool fl_stream_push(struct fl_stream *stream, uint32_t request, uint32_t channel, const struct message *message,
                    struct fl_error *error)
{
    compact(stream->out, &stream->out_start, &stream->out_end);
    struct writer writer;
    writer_init(&writer, stream->out + stream->out_end, FL_STREAM_BUFFER_BYTES - stream->out_end);
    if (!message_write(&writer, request, channel, message))
        return fl_error_set(error, FL_ERROR_ARGUMENT, writer.error.field, "%s", writer.error.text);
    stream->out_end += writer.used_bytes;
    return true;
}

void fl_stream_push_payload(struct fl_stream *stream, const struct framing_header *header, const uint8_t *payload)
{
    compact(stream->out, &stream->out_start, &stream->out_end);
    uint8_t *out = stream->out + stream->out_end;
    const size_t padding = (8u - header->payload_bytes % 8u) % 8u;
    framing_header_encode(out, header);
    if (header->payload_bytes > 0)
        memcpy(out + FRAMING_HEADER_BYTES, payload, header->payload_bytes);
    memset(out + FRAMING_HEADER_BYTES + header->payload_bytes, 0, padding);
    stream->out_end += FRAMING_HEADER_BYTES + header->payload_bytes + padding;
}

static bool has_space_to_read(const struct fl_stream *stream)
{
    if (stream->link)
        return stream->link->in_capacity - sealed_link_unopened(stream->link) > 0;
    return stream->in_end - stream->in_start < FL_STREAM_BUFFER_BYTES;
}

/* Bytes to be sealed wait for the daemon's answer to the handshake. */
static bool has_something_to_write(const struct fl_stream *stream)
{
    size_t bytes = 0;
    if (!stream->link)
        return fl_stream_has_output(stream);
    return sealed_link_waiting(stream->link, &bytes) ||
           (fl_stream_has_output(stream) && sealed_link_room(stream->link) > 0);
}

short fl_stream_events(const struct fl_stream *stream)
{
    int events = 0;
    if (has_something_to_write(stream))
        events |= POLLOUT;
    if (!stream->ended && has_space_to_read(stream))
        events |= POLLIN;
    return (short)events;
}

static bool lost(const struct fl_stream *stream, int number, struct fl_error *error)
{
    return fl_error_set(error, FL_ERROR_CONNECTION, "", "the connection to %s is lost: %s", stream->peer,
                        strerror(number));
}

/* The next bytes for the descriptor; NULL: none. */
static const uint8_t *next_bytes(struct fl_stream *stream, size_t *bytes)
{
    *bytes = stream->out_end - stream->out_start;
    if (!stream->link)
        return *bytes > 0 ? stream->out + stream->out_start : NULL;
    stream->out_start += sealed_link_seal(stream->link, stream->out + stream->out_start, *bytes);
    if (stream->is_last && !fl_stream_has_output(stream))
        sealed_link_seal_last(stream->link);
    return sealed_link_waiting(stream->link, bytes);
}

static void advance(struct fl_stream *stream, size_t bytes)
{
    if (stream->link)
        sealed_link_sent(stream->link, bytes);
    else
        stream->out_start += bytes;
}

static void drop_output(struct fl_stream *stream)
{
    size_t bytes = 0;
    stream->out_start = stream->out_end = 0;
    if (stream->link && sealed_link_waiting(stream->link, &bytes))
        sealed_link_sent(stream->link, bytes);
}

bool fl_stream_write(struct fl_stream *stream, struct fl_error *error)
{
    const uint8_t *next;
    size_t bytes;
    while ((next = next_bytes(stream, &bytes))) {
        const ssize_t sent = send(stream->fd, next, bytes, MSG_NOSIGNAL);
        if (sent >= 0) {
            stream->heard |= stream->is_blocked;
            stream->is_blocked = false;
            advance(stream, (size_t)sent);
        } else if (errno == EAGAIN || errno == EWOULDBLOCK) {
            return stream->is_blocked = true;
        } else if (errno == EPIPE || errno == ECONNRESET) {
            /* Its last messages may still be in our receive buffer: they are read before the loss is reported. */
            drop_output(stream);
            return true;
        } else if (errno != EINTR) {
            return lost(stream, errno, error);
        }
    }
    if (!fl_stream_has_output(stream))
        stream->out_start = stream->out_end = 0;
    return true;
}

static bool report_refusal(enum sealed_status status, struct fl_error *error)
{
    fl_error_set(error, FL_ERROR_REFUSED, "", "%s", sealed_status_text(status));
    if (status == SEALED_WRONG_KEY)
        fl_error_remedy(error, "name the file with a copy of the daemon's key by --key or FARLIGHT_KEY");
    else if (status == SEALED_NO_KEY)
        fl_error_remedy(error, "leave --key and FARLIGHT_KEY out, or start the daemon with --key-file");
    if (error)
        error->server_code = PROTOCOL_ERROR_DENIED;
    return false;
}

bool fl_stream_is_turned_away(const struct handshake_reply *reply, struct fl_error *error)
{
    if (reply->version != 0 || (reply->capabilities & HANDSHAKE_TRY_AGAIN) == 0)
        return false;
    fl_error_set(error, FL_ERROR_REFUSED, "", "%s",
                 reply->text[0] != '\0' ? reply->text : "the daemon has no place for another client now");
    error->server_code = PROTOCOL_ERROR_BUSY;
    return error->retryable = true;
}

static bool report_broken_seal(const struct fl_stream *stream, const struct decode_error *why,
                               struct fl_error *error)
{
    if (why->code == PROTOCOL_ERROR_OUT_OF_MEMORY)
        return fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    /* A daemon without a place says so before it knows that the connection would be sealed. */
    struct handshake_reply reply;
    struct decode_error ignored = {0};
    size_t consumed = 0;
    const struct sealed_link *link = stream->link;
    if (!sealed_is_open(link->sealed) &&
        handshake_reply_parse(&reply, link->in + link->in_start, sealed_link_unopened(link), &consumed,
                              &ignored) == HANDSHAKE_CONSUMED &&
        fl_stream_is_turned_away(&reply, error))
        return false;
    return fl_error_set(error, FL_ERROR_PROTOCOL, "", "the data differs from the data that %s sealed: %s: %s",
                        stream->peer, why->field, why->text);
}

/* Moves opened bytes from the link to the message buffer as far as they fit. */
static bool open_records(struct fl_stream *stream, struct fl_error *error)
{
    struct decode_error why = {0};
    enum sealed_result result = sealed_link_handshake(stream->link, &why);
    while (result == SEALED_CONSUMED) {
        size_t bytes = 0;
        result = sealed_link_open(stream->link, stream->in + stream->in_end,
                                  FL_STREAM_BUFFER_BYTES - stream->in_end, &bytes, &why);
        stream->in_end += bytes;
        if (sealed_has_opened_last(stream->link->sealed))
            return true;
    }
    if (result == SEALED_REFUSED)
        return report_refusal(sealed_status(stream->link->sealed), error);
    return result != SEALED_FATAL || report_broken_seal(stream, &why, error);
}

/* Accepts received bytes: opens them if the stream is sealed. */
static bool take(struct fl_stream *stream, size_t bytes, struct fl_error *error)
{
    if (!stream->link) {
        stream->in_end += bytes;
        return true;
    }
    sealed_link_came(stream->link, bytes);
    return open_records(stream, error);
}

bool fl_stream_transfer(struct fl_stream *stream, struct fl_error *error)
{
    if (!fl_stream_write(stream, error))
        return false;
    compact(stream->in, &stream->in_start, &stream->in_end);
    while (!stream->ended && has_space_to_read(stream)) {
        size_t bytes = FL_STREAM_BUFFER_BYTES - stream->in_end;
        uint8_t *space = stream->link ? sealed_link_space(stream->link, &bytes) : stream->in + stream->in_end;
        const ssize_t got = recv(stream->fd, space, bytes, 0);
        stream->heard |= got > 0;
        if (got > 0 && !take(stream, (size_t)got, error))
            return false;
        if (got > 0)
            continue;
        if (got == 0 || errno == ECONNRESET)
            stream->ended = true;
        else if (errno == EAGAIN || errno == EWOULDBLOCK)
            return true;
        else if (errno != EINTR)
            return lost(stream, errno, error);
    }
    return true;
}

bool fl_stream_has_remains(const struct fl_stream *stream)
{
    return stream->in_end > stream->in_start;
}

static enum fl_stream_result broken(const struct fl_stream *stream, const struct decode_error *why,
                                    struct fl_error *error)
{
    fl_error_set(error, FL_ERROR_PROTOCOL, why->field, "%s sent a message that the protocol does not allow: %s",
                 stream->peer, why->text);
    return FL_STREAM_ERROR;
}

enum fl_stream_result fl_stream_next(struct fl_stream *stream, struct frame *frame, struct message *message,
                                     struct fl_error *error)
{
    struct decode_error why = {0};
    for (;;) {
        const enum framing_result result = framing_parse(frame, stream->in + stream->in_start,
                                                         stream->in_end - stream->in_start, stream->accept, &why);
        if (result == FRAMING_FATAL)
            return broken(stream, &why, error);
        if (result == FRAMING_NEED_MORE && stream->link && sealed_link_has_record(stream->link)) {
            /* The record found no space before, and poll() will not report these bytes again. */
            compact(stream->in, &stream->in_start, &stream->in_end);
            if (!open_records(stream, error))
                return FL_STREAM_ERROR;
            continue;
        }
        if (result == FRAMING_NEED_MORE)
            return FL_STREAM_NOTHING;
        stream->in_start += frame->consumed_bytes;
        if (frame->info)
            break;
    }
    if (!message)
        return FL_STREAM_MESSAGE;
    scratch_reset(&stream->scratch);
    if (!message_decode(message, frame->header.type, frame->payload, frame->header.payload_bytes, &stream->scratch,
                        &why))
        return broken(stream, &why, error);
    return FL_STREAM_MESSAGE;
}

/* Rounded up, so that the deadline has passed when poll() returns. */
static int milliseconds_until(uint64_t deadline_ns)
{
    if (deadline_ns == UINT64_MAX)
        return -1;
    const uint64_t now = monotonic_now_ns();
    const uint64_t left_ms = deadline_ns > now ? (deadline_ns - now + 999999) / 1000000 : 0;
    return left_ms > 3600000 ? 3600000 : (int)left_ms;
}

bool fl_wait(struct pollfd *polled, size_t count, int interrupt_fd, uint64_t deadline_ns, struct fl_error *error)
{
    struct pollfd all[5];
    for (;;) {
        for (size_t i = 0; i < count; i++) {
            all[i] = polled[i];
            if (polled[i].events == 0)
                all[i].fd = -1; /* else a peer that has hung up would cause a busy loop */
        }
        all[count] = (struct pollfd){.fd = interrupt_fd > 0 ? interrupt_fd : -1, .events = POLLIN};
        const int ready = poll(all, (nfds_t)count + 1, milliseconds_until(deadline_ns));
        if (ready < 0 && errno != EINTR && errno != EAGAIN)
            return fl_error_set(error, FL_ERROR_SYSTEM, "", "poll: %s", strerror(errno));
        if (ready > 0 && all[count].revents != 0)
            return fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
        for (size_t i = 0; i < count; i++)
            polled[i].revents = all[i].revents;
        if (ready > 0)
            return true;
        if (deadline_ns != UINT64_MAX && monotonic_now_ns() >= deadline_ns)
            return fl_error_set(error, FL_ERROR_TIMEOUT, "", "it timed out");
    }
}

bool fl_check_interrupt(int interrupt_fd, struct fl_error *error)
{
    struct pollfd polled = {.fd = interrupt_fd, .events = POLLIN};
    return interrupt_fd <= 0 || poll(&polled, 1, 0) <= 0 ||
           fl_error_set(error, FL_ERROR_INTERRUPTED, "", "interrupted");
}
