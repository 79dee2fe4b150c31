/* SPDX-License-Identifier: MIT */
/* The codec: messages to payload bytes and back. Driven by the table; no message is treated specially.
 *
 * Payload, little-endian, nothing aligned but bulk data:
 *   u16 struct_bytes   size of the fixed fields that follow (these 2 bytes not counted)
 *   fixed fields       packed, in table order: u8 u16 u32 u64 f32, enums as u32, byte arrays as they are; a nested
 *                      record as u16 struct_bytes and its fixed fields
 *   counted fields     in table order, all present:
 *     string           u32 bytes, then UTF-8 without NUL
 *     array            u32 count, then the records; a record is its fixed fields, then its counted ones
 *     bulk             u32 bytes, then zeros up to a multiple of 8 from the start of the payload, then the bytes
 * A shorter fixed part of a message or nested record (an older peer), cut between two fields, leaves the rest at
 * message_init()'s defaults; a longer one (a newer peer) is read past. Bytes after the last field are an error. */
#ifndef FARLIGHT_PROTOCOL_CODEC_H
#define FARLIGHT_PROTOCOL_CODEC_H

#include <stdio.h>

#include "protocol/decode_error.h"
#include "protocol/writer.h"

#ifdef __cplusplus
extern "C" {
#endif

#define CODEC_CONTROL_PAYLOAD_MAX_BYTES 65536u         /* limit for a message without bulk data */
#define CODEC_BULK_PAYLOAD_MAX_BYTES (262144u + 4096u) /* limit for a message with bulk data */

/* Memory for decoded strings and record arrays: a bump allocator over the caller's buffer. A payload of n bytes
 * needs at most 2 n + 8 bytes, hence SCRATCH_BYTES for any message. */
#define SCRATCH_BYTES (2u * CODEC_CONTROL_PAYLOAD_MAX_BYTES + 8u)

struct scratch {
    uint8_t *data; /* the caller's, any alignment */
    size_t capacity_bytes;
    size_t used_bytes;
};

void scratch_init(struct scratch *scratch, void *data, size_t capacity_bytes);
void scratch_reset(struct scratch *scratch); /* invalidates everything that was decoded into it */

/* Appends the payload of *message to the writer (which must be at a multiple of 8 from the start of the payload's
 * buffer only if the reader of that buffer wants bulk data aligned in memory). Checks every rule that the decoder
 * checks: false with the field's path in writer->error rather than sending something invalid. */
bool message_encode(struct writer *writer, const struct message *message);

/* Size of the payload that message_encode() writes; 0 for an unknown type. Does not check values. */
size_t message_payload_bytes(const struct message *message);

/* Decodes a whole payload. True: *out is valid in every field, within the table's ranges, and refers to `scratch`
 * and (bulk) `payload`. False: *out is all zero, *error (may be NULL) says why. Any bytes are safe to give. */
bool message_decode(struct message *out, uint16_t type, const uint8_t *payload, size_t payload_bytes,
                    struct scratch *scratch, struct decode_error *error);

#ifdef __cplusplus
}
#endif
#endif
