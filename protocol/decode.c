/* SPDX-License-Identifier: MIT */
/* Decoding of payloads. */
#include "protocol/codec.h"

#include <inttypes.h>
#include <string.h>

#include "protocol/check.h"
#include "protocol/reader.h"

struct decoder {
    struct reader reader; /* over the whole payload */
    struct scratch *scratch;
    struct decode_error *error;
};

static bool decode_counted(struct decoder *decoder, const struct field_desc *field, char *body,
                           const struct path *parent);
static bool decode_fixed_part(struct decoder *decoder, struct reader *reader, const struct struct_desc *desc,
                              char *body, const struct path *parent);

void scratch_init(struct scratch *scratch, void *data, size_t capacity_bytes)
{
    *scratch = (struct scratch){.data = data, .capacity_bytes = capacity_bytes};
}

void scratch_reset(struct scratch *scratch)
{
    scratch->used_bytes = 0;
}

/* NULL: the scratch memory is exhausted. */
static void *scratch_alloc(struct scratch *scratch, size_t bytes, size_t alignment)
{
    size_t pad = 0;
    if (scratch->capacity_bytes > 0) {
        pad = (0 - ((uintptr_t)scratch->data + scratch->used_bytes)) & (alignment - 1);
    }
    size_t left = scratch->capacity_bytes - scratch->used_bytes;
    if (pad > left || bytes > left - pad) {
        return NULL;
    }
    void *place = scratch->data + scratch->used_bytes + pad;
    scratch->used_bytes += pad + bytes;
    return place;
}

static bool fail_truncated(struct decoder *decoder, const struct path *path, size_t wanted, size_t left)
{
    return check_fail(decoder->error, PROTOCOL_ERROR_PROTOCOL, path, "%zu bytes where %zu are left", wanted, left);
}

/* Reads a fixed field; the caller has checked that `reader` has enough bytes. */
static void read_fixed(struct reader *reader, const struct field_desc *field, char *place)
{
    const uint8_t *bytes = reader_view(reader, (size_t)field->width_bytes * field->count);
    for (uint32_t i = 0; bytes && i < field->count; i++) {
        uint64_t value = 0;
        for (uint32_t k = 0; k < field->width_bytes; k++) {
            value |= (uint64_t)bytes[i * field->width_bytes + k] << (8 * k);
        }
        field_store_int(field, place + (size_t)i * field->width_bytes, value);
    }
}

static bool decode_fixed(struct decoder *decoder, struct reader *reader, const struct field_desc *field,
                         char *body, const struct path *parent)
{
    /* Errors leave the record out: its fields have names that the message has once. */
    if (field->kind == FIELD_RECORD)
        return decode_fixed_part(decoder, reader, field->record(), body + field->offset, parent);
    size_t wire_bytes = (size_t)field->width_bytes * field->count;
    size_t left = reader_left(reader);
    if (wire_bytes > left) {
        struct path path = {parent, field->name, -1};
        return fail_truncated(decoder, &path, wire_bytes, left);
    }
    read_fixed(reader, field, body + field->offset);
    return check_fixed(field, body + field->offset, parent, decoder->error);
}

/* Decodes the fixed fields after their size, of a message or of a record in one: fewer than ours from an older
 * peer, more from a newer one. */
static bool decode_fixed_part(struct decoder *decoder, struct reader *reader, const struct struct_desc *desc,
                              char *body, const struct path *parent)
{
    struct path path = {parent, "struct_bytes", -1};
    size_t left = reader_left(reader);
    uint16_t struct_bytes = reader_u16(reader);
    if (reader->failed) {
        return fail_truncated(decoder, &path, 2, left);
    }
    left = reader_left(reader);
    const uint8_t *bytes = reader_view(reader, struct_bytes);
    if (!bytes) {
        return fail_truncated(decoder, &path, struct_bytes, left);
    }
    struct reader fixed;
    reader_init(&fixed, bytes, struct_bytes);
    for (const struct field_desc *field = desc->fields; field->name && !field_is_counted(field); field++) {
        if (reader_left(&fixed) == 0) {
            break; /* the rest keeps its defaults */
        }
        if (!decode_fixed(decoder, &fixed, field, body, parent)) {
            return false;
        }
    }
    return true;
}

/* Reads the count before a counted field. */
static bool decode_count(struct decoder *decoder, const struct field_desc *field, uint32_t *count,
                         const struct path *path)
{
    size_t left = reader_left(&decoder->reader);
    *count = reader_u32(&decoder->reader);
    if (decoder->reader.failed) {
        return fail_truncated(decoder, path, 4, left);
    }
    return check_count(field, *count, path, decoder->error);
}

static bool decode_string(struct decoder *decoder, const struct field_desc *field, char *body,
                          const struct path *path)
{
    uint32_t count;
    if (!decode_count(decoder, field, &count, path)) {
        return false;
    }
    size_t left = reader_left(&decoder->reader);
    const uint8_t *bytes = reader_view(&decoder->reader, count);
    if (!bytes) {
        return fail_truncated(decoder, path, count, left);
    }
    if (count == 0) {
        return true; /* the default, an empty string */
    }
    if (!check_text(bytes, count, path, decoder->error)) {
        return false;
    }
    char *text = scratch_alloc(decoder->scratch, (size_t)count + 1, 1);
    if (!text) {
        return check_fail(decoder->error, PROTOCOL_ERROR_LIMIT, path, "no room to decode it");
    }
    memcpy(text, bytes, count);
    text[count] = '\0';
    memcpy(body + field->offset, &text, sizeof(text));
    return true;
}

static bool decode_record(struct decoder *decoder, const struct struct_desc *desc, char *body,
                          const struct path *path)
{
    struct_defaults(desc, body);
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        bool ok = field_is_counted(field) ? decode_counted(decoder, field, body, path)
                                          : decode_fixed(decoder, &decoder->reader, field, body, path);
        if (!ok) {
            return false;
        }
    }
    return true;
}

static bool decode_array(struct decoder *decoder, const struct field_desc *field, char *body,
                         const struct path *path)
{
    const struct struct_desc *record = field->record();
    uint32_t count;
    if (!decode_count(decoder, field, &count, path)) {
        return false;
    }
    if (count == 0) {
        return true;
    }
    /* Memory is allocated only for elements that the remaining bytes can hold. */
    size_t left = reader_left(&decoder->reader);
    if (count > left / record->wire_min_bytes) {
        return check_fail(decoder->error, PROTOCOL_ERROR_PROTOCOL, path,
                          "%" PRIu32 " elements of at least %" PRIu32 " bytes where %zu are left", count,
                          record->wire_min_bytes, left);
    }
    char *elements = scratch_alloc(decoder->scratch, count * record->size_bytes, 8);
    if (!elements) {
        return check_fail(decoder->error, PROTOCOL_ERROR_LIMIT, path, "no room to decode it");
    }
    for (uint32_t i = 0; i < count; i++) {
        struct path element = {path->parent, path->name, i};
        if (!decode_record(decoder, record, elements + i * record->size_bytes, &element)) {
            return false;
        }
    }
    memcpy(body + field->offset, &elements, sizeof(elements));
    memcpy(body + field->count_offset, &count, sizeof(count));
    return true;
}

static bool decode_bulk(struct decoder *decoder, const struct field_desc *field, char *body,
                        const struct path *path)
{
    uint32_t count;
    if (!decode_count(decoder, field, &count, path)) {
        return false;
    }
    size_t left = reader_left(&decoder->reader);
    size_t pad = (0 - decoder->reader.position) & 7;
    if (pad > left || count > left - pad) {
        return fail_truncated(decoder, path, pad + count, left);
    }
    if (!reader_zeros(&decoder->reader, pad)) {
        return check_fail(decoder->error, PROTOCOL_ERROR_PROTOCOL, path, "padding is not zero");
    }
    const uint8_t *bytes = reader_view(&decoder->reader, count);
    memcpy(body + field->offset, &bytes, sizeof(bytes));
    memcpy(body + field->count_offset, &count, sizeof(count));
    return true;
}

static bool decode_counted(struct decoder *decoder, const struct field_desc *field, char *body,
                           const struct path *parent)
{
    struct path path = {parent, field->name, -1};
    switch (field->kind) {
    case FIELD_STRING:
        return decode_string(decoder, field, body, &path);
    case FIELD_ARRAY:
        return decode_array(decoder, field, body, &path);
    default:
        return decode_bulk(decoder, field, body, &path);
    }
}

static bool decode_body(struct decoder *decoder, const struct message_desc *desc, char *body)
{
    const struct struct_desc *fields = desc->body();
    const struct path root = {NULL, desc->info.name, -1};
    if (!decode_fixed_part(decoder, &decoder->reader, fields, body, &root)) {
        return false;
    }
    for (const struct field_desc *field = fields->fields; field->name; field++) {
        if (field_is_counted(field) && !decode_counted(decoder, field, body, &root)) {
            return false;
        }
    }
    if (reader_left(&decoder->reader) != 0) {
        return check_fail(decoder->error, PROTOCOL_ERROR_PROTOCOL, &root, "%zu bytes too many",
                          reader_left(&decoder->reader));
    }
    return true;
}

bool message_decode(struct message *out, uint16_t type, const uint8_t *payload, size_t payload_bytes,
                    struct scratch *scratch, struct decode_error *error)
{
    const struct message_desc *desc = message_describe(type);
    struct decoder decoder = {.scratch = scratch, .error = error};
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    memset(out, 0, sizeof(*out));
    if (!desc) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, NULL, "type 0x%04x is unknown", type);
    }
    if (payload_bytes > desc->info.payload_max_bytes) {
        return decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, desc->info.name, "%zu bytes, at most %" PRIu32,
                                payload_bytes, desc->info.payload_max_bytes);
    }
    message_init(out, (enum message_type)type);
    reader_init(&decoder.reader, payload, payload_bytes);
    if (!decode_body(&decoder, desc, (char *)out + MESSAGE_BODY_OFFSET)) {
        memset(out, 0, sizeof(*out));
        return false;
    }
    return true;
}
