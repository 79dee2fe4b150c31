/* SPDX-License-Identifier: MIT */
/* Messages in a stream of bytes. Sans-I/O: the caller owns the buffers and the socket.
 *
 * Header, 16 bytes, little-endian: u32 payload_bytes, u16 type, u16 flags (0), u32 request, u32 channel; then the
 * payload, then zeros up to a multiple of 8. */
#ifndef FARLIGHT_PROTOCOL_FRAMING_H
#define FARLIGHT_PROTOCOL_FRAMING_H

#include "protocol/codec.h"

#ifdef __cplusplus
extern "C" {
#endif

#define FRAMING_HEADER_BYTES 16u
/* What an input buffer must hold so that any valid message fits. */
#define FRAMING_MESSAGE_MAX_BYTES (FRAMING_HEADER_BYTES + CODEC_BULK_PAYLOAD_MAX_BYTES)

struct framing_header {
    uint32_t payload_bytes; /* without the padding */
    uint16_t type;
    uint16_t flags;
    uint32_t request;
    uint32_t channel;
};

/* Who sent what we read; a bit set. The daemon gives CLIENT, a client SERVER; at the pipe to the importer a client
 * gives CLIENT | LOCAL, and so on. Messages that both may send have both bits. */
enum message_from {
    MESSAGE_FROM_CLIENT = 1,
    MESSAGE_FROM_SERVER = 2,
    MESSAGE_FROM_BOTH = 3,
    MESSAGE_FROM_LOCAL = 4,
};

/* The row of the table for a type; NULL: unknown. */
struct message_info {
    uint16_t type;
    const char *name; /* "set_node" */
    uint32_t from;    /* bits of enum message_from */
    uint32_t payload_min_bytes;
    uint32_t payload_max_bytes;
};
const struct message_info *message_lookup(uint32_t type);

enum framing_result {
    FRAMING_CONSUMED,  /* one message; `frame` is filled */
    FRAMING_NEED_MORE, /* frame->need_bytes from the start of the message are wanted in all */
    FRAMING_FATAL,     /* *error says why; the connection must be closed */
};

struct frame {
    struct framing_header header;
    const struct message_info *info; /* NULL: unknown but ignorable; skip it */
    const uint8_t *payload;          /* view into the bytes */
    size_t consumed_bytes;           /* header, payload and padding */
    size_t need_bytes;               /* of FRAMING_NEED_MORE: never above FRAMING_MESSAGE_MAX_BYTES */
};

/* Cuts the first message off `bytes`. Size, type and sender are checked as soon as the header is there, before the
 * payload has come. `accept`: bits of enum message_from whose messages may come. Fatal: code PROTOCOL; DENIED for
 * a message that this peer may not send. */
enum framing_result framing_parse(struct frame *frame, const uint8_t *bytes, size_t count, uint32_t accept,
                                  struct decode_error *error);

void framing_header_encode(uint8_t out[FRAMING_HEADER_BYTES], const struct framing_header *header);
void framing_header_decode(struct framing_header *out, const uint8_t bytes[FRAMING_HEADER_BYTES]);

/* Header, payload and padding. False: writer->error says why (also when the payload is above the type's maximum),
 * and writer->used_bytes is as it was before. */
bool message_write(struct writer *writer, uint32_t request, uint32_t channel, const struct message *message);
/* How many bytes message_write() writes. */
size_t message_write_bytes(const struct message *message);

#ifdef __cplusplus
}
#endif
#endif
