/* SPDX-License-Identifier: MIT */
/* Messages between a helper program and its parent. */
#include "channel.h"

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>

#include "protocol/plain_text.h"

#define FIELD_BYTES 129
#define TEXT_BYTES 512
#define REMEDY_BYTES 256
#define BUFFER_BYTES (2u * FRAMING_MESSAGE_MAX_BYTES)

/* ---- answers ---- */

/* Copies the longest prefix that fits and does not cut a UTF-8 character. */
static void copy_text(char *out, size_t out_bytes, const char *text)
{
    size_t length = strlen(text);
    if (length >= out_bytes) {
        length = out_bytes - 1;
        while (length > 0 && ((unsigned char)text[length] & 0xc0) == 0x80)
            length--;
    }
    memcpy(out, text, length);
    out[length] = '\0';
}

static bool send_all(int fd, const uint8_t *bytes, size_t count)
{
    while (count > 0) {
        const ssize_t sent = send(fd, bytes, count, MSG_NOSIGNAL);
        if (sent < 0 && errno != EINTR)
            return false;
        if (sent > 0) {
            bytes += sent;
            count -= (size_t)sent;
        }
    }
    return true;
}

bool channel_send(const struct channel *channel, uint32_t request, const struct message *message)
{
    uint8_t bytes[2048];
    struct writer writer;
    writer_init(&writer, bytes, sizeof(bytes));
    return message_write(&writer, request, 0, message) && send_all(channel->fd, bytes, writer.used_bytes);
}

bool channel_send_failure(const struct channel *channel, uint32_t request, const struct channel_failure *failure)
{
    char short_field[FIELD_BYTES], short_reason[TEXT_BYTES], short_remedy[REMEDY_BYTES];
    struct message message = {.type = MESSAGE_ERROR};
    copy_text(short_field, sizeof(short_field), failure->field);
    copy_text(short_reason, sizeof(short_reason), failure->reason);
    copy_text(short_remedy, sizeof(short_remedy), failure->remedy ? failure->remedy : "");
    message.error.code = PROTOCOL_ERROR_INVALID;
    message.error.field = short_field;
    message.error.text = short_reason;
    message.error.remedy = short_remedy;
    message.error.retryable = failure->retryable;
    if (channel_send(channel, request, &message))
        return true;
    /* The library's text was not UTF-8. */
    message.error.field = "";
    message.error.text = "no more can be said";
    return channel_send(channel, request, &message);
}

/* ---- the stream ---- */

/* Reads the available bytes; 0 at the end, -1 on failure. */
static int read_more(struct channel *channel)
{
    memmove(channel->buffer, channel->buffer + channel->start, channel->end - channel->start);
    channel->end -= channel->start;
    channel->start = 0;
    for (;;) {
        const ssize_t got = recv(channel->fd, channel->buffer + channel->end, BUFFER_BYTES - channel->end, 0);
        if (got < 0 && errno == EINTR)
            continue;
        if (got > 0)
            channel->end += (size_t)got;
        return got > 0 ? 1 : got < 0 ? -1 : 0;
    }
}

static bool refuse(const struct channel *channel, const char *field, const char *text)
{
    fprintf(stderr, "%s: ", channel->program);
    plain_text_print(stderr, field);
    fputs(field[0] != '\0' ? ": " : "", stderr);
    plain_text_print(stderr, text);
    fputc('\n', stderr);
    return false;
}

static bool hand_over(struct channel *channel)
{
    for (;;) {
        struct frame frame;
        struct message message;
        struct decode_error why = {0};
        const enum framing_result result =
            framing_parse(&frame, channel->buffer + channel->start, channel->end - channel->start,
                          MESSAGE_FROM_SERVER | MESSAGE_FROM_LOCAL, &why);
        if (result == FRAMING_FATAL)
            return refuse(channel, why.field, why.text);
        if (result == FRAMING_NEED_MORE) {
            const int got = read_more(channel);
            if (got < 0)
                return refuse(channel, "", strerror(errno));
            if (got == 0)
                return true;
            continue;
        }
        channel->start += frame.consumed_bytes;
        if (!frame.info)
            continue;
        scratch_reset(&channel->scratch);
        if (!message_decode(&message, frame.header.type, frame.payload, frame.header.payload_bytes,
                            &channel->scratch, &why))
            return refuse(channel, why.field, why.text);
        if (!channel->handle(channel->user, frame.header.request, &message))
            return refuse(channel, frame.info->name, "is not allowed here");
    }
}

bool channel_run(struct channel *channel)
{
    uint8_t *scratch = malloc(SCRATCH_BYTES);
    channel->buffer = malloc(BUFFER_BYTES);
    channel->start = channel->end = 0;
    bool good = scratch && channel->buffer;
    if (good) {
        scratch_init(&channel->scratch, scratch, SCRATCH_BYTES);
        good = hand_over(channel);
    } else {
        refuse(channel, "", "out of memory");
    }
    free(channel->buffer);
    free(scratch);
    channel->buffer = NULL;
    return good;
}
