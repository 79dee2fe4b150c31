/* SPDX-License-Identifier: MIT */
/* Encoding of messages into payloads. */
#include "protocol/codec.h"

#include <inttypes.h>
#include <string.h>

#include "protocol/check.h"

struct encoder {
    struct writer *writer;
    size_t payload_start; /* offset in the writer's buffer */
};

static bool encode_struct(struct encoder *encoder, const struct struct_desc *desc, const char *body,
                          const struct path *path);

static uint32_t load_count(const struct field_desc *field, const char *body)
{
    uint32_t count;
    memcpy(&count, body + field->count_offset, sizeof(count));
    return count;
}

static const void *load_pointer(const struct field_desc *field, const char *body)
{
    const void *pointer;
    memcpy(&pointer, body + field->offset, sizeof(pointer));
    return pointer;
}

static bool encode_fixed(struct writer *writer, const struct field_desc *field, const char *place)
{
    switch (field->kind) {
    case FIELD_INT:
    case FIELD_ENUM: {
        uint64_t value = field_load_int(field, place);
        for (uint32_t i = 0; i < field->width_bytes; i++) {
            writer_put_u8(writer, (uint8_t)(value >> (8 * i)));
        }
        return !writer->failed;
    }
    case FIELD_REAL:
        for (uint32_t i = 0; i < field->count; i++) {
            uint32_t bits;
            memcpy(&bits, place + 4 * i, 4);
            writer_put_u32(writer, bits);
        }
        return !writer->failed;
    default:
        return writer_put_bytes(writer, place, field->count);
    }
}

/* A record in a message: the bytes of its fields, then they. */
static bool encode_nested(struct encoder *encoder, const struct field_desc *field, const char *place,
                          const struct path *path)
{
    return writer_put_u16(encoder->writer, (uint16_t)(field->width_bytes - 2)) &&
           encode_struct(encoder, field->record(), place, path);
}

static bool encode_string(struct encoder *encoder, const struct field_desc *field, const char *body,
                          const struct path *path)
{
    struct writer *writer = encoder->writer;
    const char *text = load_pointer(field, body);
    size_t count = text ? strnlen(text, (size_t)field->max + 1) : 0;
    if (!check_count(field, count, path, &writer->error) ||
        !check_text((const uint8_t *)text, count, path, &writer->error)) {
        return false;
    }
    return writer_put_u32(writer, (uint32_t)count) && writer_put_bytes(writer, text, count);
}

static bool encode_array(struct encoder *encoder, const struct field_desc *field, const char *body,
                         const struct path *path)
{
    struct writer *writer = encoder->writer;
    const struct struct_desc *record = field->record();
    const char *elements = load_pointer(field, body);
    uint32_t count = load_count(field, body);
    if (!check_count(field, count, path, &writer->error)) {
        return false;
    }
    if (!elements && count > 0) {
        return check_fail(&writer->error, PROTOCOL_ERROR_INVALID, path,
                          "no elements where %" PRIu32 " are counted", count);
    }
    if (!writer_put_u32(writer, count)) {
        return false;
    }
    for (uint32_t i = 0; i < count; i++) {
        struct path element = {path->parent, path->name, i};
        if (!encode_struct(encoder, record, elements + i * record->size_bytes, &element)) {
            return false;
        }
    }
    return true;
}

static bool encode_bulk(struct encoder *encoder, const struct field_desc *field, const char *body,
                        const struct path *path)
{
    struct writer *writer = encoder->writer;
    const uint8_t *bytes = load_pointer(field, body);
    uint32_t count = load_count(field, body);
    if (!check_count(field, count, path, &writer->error)) {
        return false;
    }
    if (!bytes && count > 0) {
        return check_fail(&writer->error, PROTOCOL_ERROR_INVALID, path, "no bytes where %" PRIu32 " are counted",
                          count);
    }
    writer_put_u32(writer, count);
    writer_put_zeros(writer, (0 - (writer->used_bytes - encoder->payload_start)) & 7);
    return writer_put_bytes(writer, bytes, count);
}

static bool encode_struct(struct encoder *encoder, const struct struct_desc *desc, const char *body,
                          const struct path *path)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        struct path field_path = {path, field->name, -1};
        bool ok = false;
        switch (field->kind) {
        case FIELD_RECORD:
            ok = encode_nested(encoder, field, body + field->offset, path);
            break;
        case FIELD_STRING:
            ok = encode_string(encoder, field, body, &field_path);
            break;
        case FIELD_ARRAY:
            ok = encode_array(encoder, field, body, &field_path);
            break;
        case FIELD_BULK:
            ok = encode_bulk(encoder, field, body, &field_path);
            break;
        default:
            ok = check_fixed(field, body + field->offset, path, &encoder->writer->error) &&
                 encode_fixed(encoder->writer, field, body + field->offset);
            break;
        }
        if (!ok) {
            return false;
        }
    }
    return true;
}

bool message_encode(struct writer *writer, const struct message *message)
{
    const struct message_desc *desc = message_describe(message->type);
    if (writer->failed) {
        return false;
    }
    if (!desc) {
        writer->failed = true;
        return decode_error_set(&writer->error, PROTOCOL_ERROR_INVALID, NULL, "type 0x%04x is unknown",
                                (unsigned)message->type);
    }
    const struct struct_desc *body = desc->body();
    const struct path root = {NULL, desc->info.name, -1};
    struct encoder encoder = {writer, writer->used_bytes};
    writer_put_u16(writer, (uint16_t)body->wire_fixed_bytes);
    bool ok = !writer->failed && encode_struct(&encoder, body, (const char *)message + MESSAGE_BODY_OFFSET, &root);
    size_t payload_bytes = writer->used_bytes - encoder.payload_start;
    if (ok && payload_bytes > desc->info.payload_max_bytes) {
        ok = decode_error_set(&writer->error, PROTOCOL_ERROR_LIMIT, desc->info.name, "%zu bytes, at most %" PRIu32,
                              payload_bytes, desc->info.payload_max_bytes);
    }
    if (!ok) {
        writer->failed = true;
        writer->used_bytes = encoder.payload_start;
    }
    return ok;
}

static size_t struct_bytes(const struct struct_desc *desc, const char *body, size_t position)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        const char *pointer = NULL;
        switch (field->kind) {
        case FIELD_STRING:
            pointer = load_pointer(field, body);
            position += 4 + (pointer ? strlen(pointer) : 0);
            break;
        case FIELD_ARRAY:
            pointer = load_pointer(field, body);
            position += 4;
            for (uint32_t i = 0; pointer && i < load_count(field, body); i++) {
                const struct struct_desc *record = field->record();
                position = struct_bytes(record, pointer + i * record->size_bytes, position);
            }
            break;
        case FIELD_BULK:
            position = ((position + 4 + 7) & ~(size_t)7) + load_count(field, body);
            break;
        default:
            position += (size_t)field->width_bytes * field->count;
            break;
        }
    }
    return position;
}

size_t message_payload_bytes(const struct message *message)
{
    const struct message_desc *desc = message_describe(message->type);
    return desc ? struct_bytes(desc->body(), (const char *)message + MESSAGE_BODY_OFFSET, 2) : 0;
}
