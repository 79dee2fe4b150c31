/* SPDX-License-Identifier: MIT */
/* Headers of messages, and cutting a stream of bytes into messages. */
#include "protocol/framing.h"

#include <inttypes.h>
#include <string.h>

#include "protocol/reader.h"

static size_t padded(size_t bytes)
{
    return (bytes + 7) & ~(size_t)7;
}

void framing_header_encode(uint8_t out[FRAMING_HEADER_BYTES], const struct framing_header *header)
{
    struct writer writer;
    writer_init(&writer, out, FRAMING_HEADER_BYTES);
    writer_put_u32(&writer, header->payload_bytes);
    writer_put_u16(&writer, header->type);
    writer_put_u16(&writer, header->flags);
    writer_put_u32(&writer, header->request);
    writer_put_u32(&writer, header->channel);
}

void framing_header_decode(struct framing_header *out, const uint8_t bytes[FRAMING_HEADER_BYTES])
{
    struct reader reader;
    reader_init(&reader, bytes, FRAMING_HEADER_BYTES);
    out->payload_bytes = reader_u32(&reader);
    out->type = reader_u16(&reader);
    out->flags = reader_u16(&reader);
    out->request = reader_u32(&reader);
    out->channel = reader_u32(&reader);
}

/* Checks everything that the header shows, before the payload has arrived. */
static bool header_allowed(const struct framing_header *header, const struct message_info *info, uint32_t accept,
                           struct decode_error *error)
{
    uint32_t max = info ? info->payload_max_bytes : CODEC_BULK_PAYLOAD_MAX_BYTES;
    uint32_t min = info ? info->payload_min_bytes : 0;
    const char *name = message_type_text(header->type);
    if (!info && (header->type & MESSAGE_TYPE_IGNORABLE) == 0) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, "type", "type 0x%04x is unknown", header->type);
    }
    if (header->flags != 0) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, "flags", "flags 0x%04x are not 0", header->flags);
    }
    if (header->payload_bytes < min || header->payload_bytes > max) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, "payload_bytes",
                                "%s: %" PRIu32 " bytes are not within %" PRIu32 " .. %" PRIu32, name,
                                header->payload_bytes, min, max);
    }
    if (info && (info->from & accept) == 0) {
        return decode_error_set(error, PROTOCOL_ERROR_DENIED, "type", "%s is not for this peer to send", name);
    }
    return true;
}

enum framing_result framing_parse(struct frame *frame, const uint8_t *bytes, size_t count, uint32_t accept,
                                  struct decode_error *error)
{
    memset(frame, 0, sizeof(*frame));
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    if (count < FRAMING_HEADER_BYTES) {
        frame->need_bytes = FRAMING_HEADER_BYTES;
        return FRAMING_NEED_MORE;
    }
    struct framing_header header;
    framing_header_decode(&header, bytes);
    const struct message_info *info = message_lookup(header.type);
    if (!header_allowed(&header, info, accept, error)) {
        return FRAMING_FATAL;
    }
    size_t total_bytes = FRAMING_HEADER_BYTES + padded(header.payload_bytes);
    if (count < total_bytes) {
        frame->need_bytes = total_bytes;
        return FRAMING_NEED_MORE;
    }
    struct reader tail;
    size_t end = FRAMING_HEADER_BYTES + header.payload_bytes;
    reader_init(&tail, bytes + end, total_bytes - end);
    if (!reader_zeros(&tail, total_bytes - end)) {
        decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, "padding", "%s: padding is not zero",
                         message_type_text(header.type));
        return FRAMING_FATAL;
    }
    frame->header = header;
    frame->info = info;
    frame->payload = bytes + FRAMING_HEADER_BYTES;
    frame->consumed_bytes = total_bytes;
    return FRAMING_CONSUMED;
}

bool message_write(struct writer *writer, uint32_t request, uint32_t channel, const struct message *message)
{
    size_t start = writer->used_bytes;
    bool ok = writer_put_zeros(writer, FRAMING_HEADER_BYTES) && message_encode(writer, message);
    size_t payload_bytes = ok ? writer->used_bytes - start - FRAMING_HEADER_BYTES : 0;
    ok = ok && writer_put_zeros(writer, padded(payload_bytes) - payload_bytes);
    if (!ok) {
        writer->used_bytes = start;
        return false;
    }
    const struct framing_header header = {
        .payload_bytes = (uint32_t)payload_bytes,
        .type = (uint16_t)message->type,
        .request = request,
        .channel = channel,
    };
    framing_header_encode(writer->data + start, &header);
    return true;
}

size_t message_write_bytes(const struct message *message)
{
    return FRAMING_HEADER_BYTES + padded(message_payload_bytes(message));
}
