/* SPDX-License-Identifier: MIT */
/* The tables of the protocol, generated from words.def, tracers.def and messages.def. */
#include "protocol/describe.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/plain_text.h"

#define LENGTH(array) (sizeof(array) / sizeof(array)[0])

/* clang-format off */
/* ---- enums ---- */
#define ENUMERATION(NAME, name, doc) static const struct value_desc values_##name[] = {
#define VALUE(NAME, VALUE_NAME, number, text, doc) {#VALUE_NAME, number, text, doc},
#define ENUMERATION_END(NAME, name) };
#include "protocol/words.def"

const struct enum_desc protocol_enums[] = {
#define ENUMERATION(NAME, name, doc) {#name, doc, values_##name, LENGTH(values_##name)},
#include "protocol/words.def"
};
const size_t protocol_enum_count = LENGTH(protocol_enums);

enum enum_index {
#define ENUMERATION(NAME, name, doc) enum_index_##name,
#include "protocol/words.def"
};

/* ---- sizes on the wire ---- */
#define RECORD(name, doc) enum { wire_fixed_record_##name = 0
#define RECORD_END(name) };
#define MESSAGE(NAME, name, number, from, doc) enum { wire_fixed_message_##name = 0
#define MESSAGE_END(NAME, name) };
#define INT(type, field, min, max, doc) + sizeof(PROTOCOL_INT_##type)
#define ENUM(enum_name, field, doc) + 4
#define REAL(field, min, max, doc) + 4
#define REALS(field, count, min, max, doc) + 4 * (count)
#define BYTES(field, count, doc) + (count)
#define NESTED(record, field, doc) + 2 + wire_fixed_record_##record
#define SETTING_WHOLE(tracer, field, min, max, default_value, unit, doc) + 4
#define SETTING_ONE_OF(tracer, field, numbers, max, default_value, unit, doc) + 4
#define SETTING_REAL(tracer, field, min, max, default_value, unit, doc) + 4
#define SETTING_CHOICE(tracer, field, choices, doc) + 4
#include "protocol/messages.def"

#define RECORD(name, doc) enum { wire_counted_record_##name = 0
#define RECORD_END(name) };
#define MESSAGE(NAME, name, number, from, doc) enum { wire_counted_message_##name = 0
#define MESSAGE_END(NAME, name) };
#define STRING(field, max, doc) + 4
#define ARRAY(record, field, max, doc) + 4
#define BULK(field, max, doc) + 4
#include "protocol/messages.def"

#define RECORD(name, doc) enum { has_bulk_record_##name = 0
#define RECORD_END(name) };
#define MESSAGE(NAME, name, number, from, doc) enum { has_bulk_message_##name = 0
#define MESSAGE_END(NAME, name) };
#define BULK(field, max, doc) + 1
#include "protocol/messages.def"

/* ---- fields: described by functions, because only in one can `owner` be another type each time ---- */
#define RECORD(name, record_doc)                                                                                  \
    static const struct struct_desc *describe_record_##name(void)                                                 \
    {                                                                                                             \
        typedef struct record_##name owner;                                                                       \
        static const char owner_name[] = #name;                                                                   \
        static const char owner_doc[] = record_doc;                                                               \
        enum { fixed = wire_fixed_record_##name, counted = wire_counted_record_##name };                          \
        static const struct field_desc fields[] = {
#define MESSAGE(NAME, name, number, from, message_doc)                                                            \
    static const struct struct_desc *describe_message_##name(void)                                                \
    {                                                                                                             \
        typedef struct message_##name owner;                                                                      \
        static const char owner_name[] = #name;                                                                   \
        static const char owner_doc[] = message_doc;                                                              \
        enum { fixed = wire_fixed_message_##name, counted = wire_counted_message_##name };                        \
        static const struct field_desc fields[] = {
#define FIELDS_END                                                                                                \
            {.name = NULL},                                                                                       \
        };                                                                                                        \
        static const struct struct_desc desc = {                                                                  \
            owner_name, owner_doc, fields, sizeof(owner), fixed, fixed + counted,                                 \
        };                                                                                                        \
        return &desc;                                                                                             \
    }
#define RECORD_END(name) FIELDS_END
#define MESSAGE_END(NAME, name) FIELDS_END
#define INT(type, field, min_value, max_value, field_doc)                                                         \
    OPTION_INT(type, field, min_value, max_value, min_value, "", field_doc)
#define OPTION_INT(type, field, min_value, max_value, default_value, field_unit, field_doc)                       \
    {.name = #field, .doc = field_doc, .kind = FIELD_INT, .width_bytes = sizeof(PROTOCOL_INT_##type), .count = 1, \
     .offset = offsetof(owner, field), .min = min_value##ULL, .max = max_value##ULL,                              \
     .default_int = default_value##ULL, .unit = field_unit},
#define ENUM(enum_name, field, field_doc)                                                                         \
    {.name = #field, .doc = field_doc, .kind = FIELD_ENUM, .width_bytes = 4, .count = 1,                          \
     .offset = offsetof(owner, field), .enumeration = &protocol_enums[enum_index_##enum_name]},
#define REAL(field, min_value, max_value, field_doc)                                                              \
    OPTION_REAL(field, min_value, max_value, (min_value) > 0 ? (min_value) : 0, "", field_doc)
#define OPTION_REAL(field, min_value, max_value, default_value, field_unit, field_doc)                            \
    {.name = #field, .doc = field_doc, .kind = FIELD_REAL, .width_bytes = 4, .count = 1,                          \
     .offset = offsetof(owner, field), .real_min = (float)(min_value), .real_max = (float)(max_value),            \
     .default_real = (float)(default_value), .unit = field_unit},
#define REALS(field, number, min_value, max_value, field_doc)                                                     \
    OPTION_REALS(field, number, min_value, max_value, (min_value) > 0 ? (min_value) : 0, "", field_doc)
#define OPTION_REALS(field, number, min_value, max_value, default_value, field_unit, field_doc)                   \
    {.name = #field, .doc = field_doc, .kind = FIELD_REAL, .width_bytes = 4, .count = number,                     \
     .offset = offsetof(owner, field), .real_min = (float)(min_value), .real_max = (float)(max_value),            \
     .default_real = (float)(default_value), .unit = field_unit},
#define BYTES(field, number, field_doc)                                                                           \
    {.name = #field, .doc = field_doc, .kind = FIELD_BYTES, .width_bytes = 1, .count = number,                    \
     .offset = offsetof(owner, field)},
#define NESTED(record_name, field, field_doc)                                                                     \
    {.name = #field, .doc = field_doc, .kind = FIELD_RECORD, .count = 1,                                          \
     .width_bytes = 2 + wire_fixed_record_##record_name, .offset = offsetof(owner, field),                        \
     .record = describe_record_##record_name},
#define STRING(field, max_bytes, field_doc)                                                                       \
    {.name = #field, .doc = field_doc, .kind = FIELD_STRING, .offset = offsetof(owner, field), .max = max_bytes},
#define ARRAY(record_name, field, max_count, field_doc)                                                           \
    {.name = #field, .doc = field_doc, .kind = FIELD_ARRAY, .offset = offsetof(owner, field),                     \
     .count_offset = offsetof(owner, field##_count), .max = max_count, .record = describe_record_##record_name},
#define BULK(field, max_bytes, field_doc)                                                                         \
    {.name = #field, .doc = field_doc, .kind = FIELD_BULK, .offset = offsetof(owner, field),                      \
     .count_offset = offsetof(owner, field##_bytes), .max = max_bytes},
/* Settings lie in the member `settings` of the record that carries them. */
#define SETTING(owned, field, field_doc)                                                                    \
    .name = #owned "_" #field, .doc = field_doc, .tracer = #owned,                  \
    .width_bytes = 4, .count = 1, .offset = offsetof(owner, settings.owned.field)
#define SETTING_WHOLE(owned, field, min_value, max_value, default_value, field_unit, field_doc)             \
    {SETTING(owned, field, field_doc), .kind = FIELD_INT, .min = min_value, .max = max_value,               \
     .zero_is_default = true, .default_int = default_value, .unit = field_unit},
#define SETTING_ONE_OF(owned, field, listed, max_value, default_value, field_unit, field_doc)               \
    {SETTING(owned, field, field_doc), .kind = FIELD_INT, .numbers = listed, .max = max_value,              \
     .zero_is_default = true, .default_int = default_value, .unit = field_unit},
#define SETTING_REAL(owned, field, min_value, max_value, default_value, field_unit, field_doc)              \
    {SETTING(owned, field, field_doc), .kind = FIELD_REAL, .real_min = (float)(min_value),                  \
     .real_max = (float)(max_value), .zero_is_default = (min_value) > 0, .default_real = (float)(default_value),  \
     .unit = field_unit},
#define SETTING_CHOICE(owned, field, choices, field_doc)                                                    \
    {SETTING(owned, field, field_doc), .kind = FIELD_ENUM, .enumeration = &protocol_enums[enum_index_##choices]},
#include "protocol/messages.def"

/* ---- tables of all ---- */
const struct struct_desc *(*const protocol_records[])(void) = {
#define RECORD(name, doc) describe_record_##name,
#include "protocol/messages.def"
};
const size_t protocol_record_count = LENGTH(protocol_records);

/* A payload from the oldest peer has no fixed fields at all, which is the shortest payload of a type. */
const struct message_desc protocol_messages[] = {
#define MESSAGE(NAME, name, number, from, doc)                                                                    \
    {{number, #name, MESSAGE_FROM_##from, 2 + wire_counted_message_##name,                                        \
      has_bulk_message_##name ? CODEC_BULK_PAYLOAD_MAX_BYTES : CODEC_CONTROL_PAYLOAD_MAX_BYTES},                  \
     #NAME, doc, describe_message_##name},
#include "protocol/messages.def"
};
/* clang-format on */
const size_t protocol_message_count = LENGTH(protocol_messages);

_Static_assert(sizeof(enum protocol_error_code) == 4, "the codec stores enums as u32");
_Static_assert(sizeof(float) == 4, "the codec stores reals as IEEE 754 single");

enum message_index {
#define MESSAGE(NAME, name, number, from, doc) message_index_##name,
#include "protocol/messages.def"
};

const struct message_desc *message_describe(uint32_t type)
{
    switch (type) {
#define MESSAGE(NAME, name, number, from, doc)                                                                    \
    case number:                                                                                                  \
        return &protocol_messages[message_index_##name];
#include "protocol/messages.def"
    default:
        return NULL;
    }
}

const struct message_info *message_lookup(uint32_t type)
{
    const struct message_desc *desc = message_describe(type);
    return desc ? &desc->info : NULL;
}

bool field_is_counted(const struct field_desc *field)
{
    return field->kind == FIELD_STRING || field->kind == FIELD_ARRAY || field->kind == FIELD_BULK;
}

const struct field_desc *struct_field(const struct struct_desc *desc, const char *name)
{
    const struct field_desc *field = desc->fields;
    while (field->name && strcmp(field->name, name) != 0) {
        field++;
    }
    return field->name ? field : NULL;
}

size_t struct_leaves(const struct struct_desc *desc, struct field_desc *leaves, size_t max)
{
    size_t count = 0;
    for (const struct field_desc *field = desc->fields; field->name && count < max; field++) {
        if (field->kind == FIELD_RECORD) {
            size_t nested = struct_leaves(field->record(), leaves + count, max - count);
            for (size_t i = 0; i < nested; i++) {
                leaves[count + i].offset += field->offset;
            }
            count += nested;
        } else if (!field_is_counted(field)) {
            leaves[count++] = *field;
        }
    }
    return count;
}

bool field_has_number(const struct field_desc *field, uint64_t value)
{
    if (value == 0 && field->zero_is_default) {
        return true;
    }
    for (const char *at = field->numbers; at && *at != '\0'; at += strspn(at, ", ")) {
        char *end = NULL;
        if (strtoull(at, &end, 10) == value) {
            return true;
        }
        at = end;
    }
    return !field->numbers && value >= field->min && value <= field->max;
}

const char *field_allowed_text(const struct field_desc *field, char *out, size_t out_bytes)
{
    const char *before = field->zero_is_default && field->default_int == 0 ? "auto, " : "";
    switch (field->kind) {
    case FIELD_INT:
        if (field->numbers) {
            snprintf(out, out_bytes, "%s%s", before, field->numbers);
        } else {
            snprintf(out, out_bytes, "%s%" PRIu64 " to %" PRIu64, before, field->min, field->max);
        }
        return out;
    case FIELD_REAL:
        snprintf(out, out_bytes, "%g to %g", (double)field->real_min, (double)field->real_max);
        return out;
    case FIELD_ENUM:
        return protocol_enum_list(field->enumeration->name, out, out_bytes);
    default:
        out[0] = '\0';
        return out;
    }
}

const char *field_default_text(const struct field_desc *field, char *out, size_t out_bytes)
{
    if (field->kind == FIELD_REAL) {
        snprintf(out, out_bytes, "%g", (double)field->default_real);
    } else if (field->kind == FIELD_ENUM) {
        snprintf(out, out_bytes, "%s", enum_desc_text(field->enumeration, 0));
    } else if (field->zero_is_default && field->default_int == 0) {
        snprintf(out, out_bytes, "auto");
    } else {
        snprintf(out, out_bytes, "%" PRIu64, field->default_int);
    }
    return out;
}

const char *enum_desc_text(const struct enum_desc *desc, uint32_t number)
{
    for (size_t i = 0; i < desc->value_count; i++) {
        if (desc->values[i].number == number) {
            return desc->values[i].text;
        }
    }
    return NULL;
}

void field_default(const struct field_desc *field, void *place)
{
    const char *empty = "";
    switch (field->kind) {
    case FIELD_INT:
        field_store_int(field, place, field->default_int);
        break;
    case FIELD_REAL:
        for (uint32_t i = 0; i < field->count; i++) {
            memcpy((char *)place + 4 * i, &field->default_real, 4);
        }
        break;
    case FIELD_RECORD:
        struct_defaults(field->record(), place);
        break;
    case FIELD_STRING:
        memcpy(place, &empty, sizeof(empty));
        break;
    case FIELD_ENUM:
    case FIELD_BYTES:
    case FIELD_ARRAY:
    case FIELD_BULK:
        break; /* memory is zero already */
    }
}

uint64_t field_load_int(const struct field_desc *field, const void *place)
{
    uint8_t v8;
    uint16_t v16;
    uint32_t v32;
    uint64_t v64;
    switch (field->width_bytes) {
    case 1:
        memcpy(&v8, place, 1);
        return v8;
    case 2:
        memcpy(&v16, place, 2);
        return v16;
    case 4:
        memcpy(&v32, place, 4);
        return v32;
    default:
        memcpy(&v64, place, 8);
        return v64;
    }
}

void field_store_int(const struct field_desc *field, void *place, uint64_t value)
{
    uint8_t v8 = (uint8_t)value;
    uint16_t v16 = (uint16_t)value;
    uint32_t v32 = (uint32_t)value;
    switch (field->width_bytes) {
    case 1:
        memcpy(place, &v8, 1);
        break;
    case 2:
        memcpy(place, &v16, 2);
        break;
    case 4:
        memcpy(place, &v32, 4);
        break;
    default:
        memcpy(place, &value, 8);
        break;
    }
}

void struct_defaults(const struct struct_desc *desc, void *body)
{
    memset(body, 0, desc->size_bytes);
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        field_default(field, (char *)body + field->offset);
    }
}

bool utf8_valid(const uint8_t *bytes, size_t count)
{
    uint32_t code;
    for (size_t at = 0, length; at < count; at += length) {
        length = utf8_read(bytes + at, count - at, &code);
        if (length == 0) {
            return false;
        }
    }
    return true;
}
