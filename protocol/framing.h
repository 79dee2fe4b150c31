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
/* Size of an input buffer into which any valid message fits. */
#define FRAMING_MESSAGE_MAX_BYTES (FRAMING_HEADER_BYTES + CODEC_BULK_PAYLOAD_MAX_BYTES)

struct framing_header {
    uint32_t payload_bytes; /* size without the padding */
    uint16_t type;
    uint16_t flags;
    uint32_t request;
    uint32_t channel;
};

/* Set of the allowed senders of received messages. The daemon passes CLIENT, a client SERVER; on the pipe to
 * the importer a client passes CLIENT | LOCAL, and so on. Messages that both sides may send have both bits. */
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
    FRAMING_CONSUMED,  /* `frame` holds a message */
    FRAMING_NEED_MORE, /* more bytes are needed: frame->need_bytes, counted from the start of the message */
    FRAMING_FATAL,     /* *error says why; the connection must be closed */
};

struct frame {
    struct framing_header header;
    const struct message_info *info; /* NULL: unknown but ignorable; skip it */
    const uint8_t *payload;          /* view into the bytes */
    size_t consumed_bytes;           /* header, payload and padding */
    size_t need_bytes;               /* valid for FRAMING_NEED_MORE; at most FRAMING_MESSAGE_MAX_BYTES */
};

/* Cuts the first message off `bytes`. Size, type and sender are checked as soon as the header is complete,
 * before the payload has arrived. `accept`: bits of enum message_from for the allowed senders. Fatal: code
 * PROTOCOL; DENIED for a message that this peer may not send. */
enum framing_result framing_parse(struct frame *frame, const uint8_t *bytes, size_t count, uint32_t accept,
                                  struct decode_error *error);

void framing_header_encode(uint8_t out[FRAMING_HEADER_BYTES], const struct framing_header *header);
void framing_header_decode(struct framing_header *out, const uint8_t bytes[FRAMING_HEADER_BYTES]);

/* Writes header, payload and padding. False: writer->error has the reason (also for a payload above the type's
 * maximum), and writer->used_bytes is unchanged. */
bool message_write(struct writer *writer, uint32_t request, uint32_t channel, const struct message *message);
/* Number of bytes that message_write() writes. */
size_t message_write_bytes(const struct message *message);

#ifdef __cplusplus
}
#endif
#endif
