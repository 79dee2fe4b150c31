/* SPDX-License-Identifier: MIT */
/* Structs of every message, expanded from messages.def; their enums are in words.h.
 *
 *   struct record_<name>, struct message_<name>, MESSAGE_<NAME>, struct message
 *
 * Memory: a message owns nothing. Decoded strings and arrays live in the caller's scratch (codec.h), bulk
 * data is a view into the payload; both must outlive the message. Strings are never NULL after decoding;
 * a NULL string is encoded as the empty one. All-zero is a struct with every field 0, empty or first value;
 * message_init() also sets the defaults that are above 0. */
#ifndef FARLIGHT_PROTOCOL_MESSAGES_H
#define FARLIGHT_PROTOCOL_MESSAGES_H

#include "protocol/values.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "protocol/words.h"

/* clang-format off */
/* ---- fields ---- */
#define RECORD(name, doc) struct record_##name {
#define RECORD_END(name) };
#define INT(type, field, min, max, doc) PROTOCOL_INT_##type field;
#define ENUM(enum_name, field, doc) enum protocol_##enum_name field;
#define REAL(field, min, max, doc) float field;
#define TRACER_SETTINGS(field) struct tracer_settings field;
#define REALS(field, count, min, max, doc) float field[count];
#define NESTED(record, field, doc) struct record_##record field;
#define BYTES(field, count, doc) uint8_t field[count];
#define STRING(field, max, doc) const char *field;
#define ARRAY(record, field, max, doc)                                                                           \
    struct record_##record *field;                                                                               \
    uint32_t field##_count;
#define BULK(field, max, doc)                                                                                    \
    const uint8_t *field;                                                                                        \
    uint32_t field##_bytes;
/* Some have no fields, which strict C does not know. */
#define MESSAGE(NAME, name, number, from, doc) __extension__ struct message_##name {
#define MESSAGE_END(NAME, name) };
#define MESSAGES_WITHOUT_VALUES
#include "protocol/messages.def"
#undef MESSAGES_WITHOUT_VALUES

/* clang-format on */

/* ---- all of them ---- */
enum message_type {
#define MESSAGE(NAME, name, number, from, doc) MESSAGE_##NAME = (number),
#include "protocol/messages.def"
};

/* The top bit of a type: a peer that does not know it skips the message. */
#define MESSAGE_TYPE_IGNORABLE 0x8000u

struct message {
    enum message_type type; /* says which member is meant: MESSAGE_RENDER -> render */
    union {
#define MESSAGE(NAME, name, number, from, doc) struct message_##name name;
#include "protocol/messages.def"
    };
};

#ifdef __cplusplus
extern "C" {
#endif

/* Every field gets the default of the table: 0, empty ("") or the first value where it has none of its own.
 * Unknown type: all zero. */
void message_init(struct message *message, enum message_type type);

/* "set_node"; "unknown" for a type that is not in the table. */
const char *message_type_text(uint32_t type);

static inline uint32_t protocol_pixel_format_bytes(enum protocol_pixel_format format)
{
    return format == PROTOCOL_PIXEL_FORMAT_RGBA8 ? 4 : format == PROTOCOL_PIXEL_FORMAT_RGBA16F ? 8 : 16;
}

#ifdef __cplusplus
}
#endif
#endif
