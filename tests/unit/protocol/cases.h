/* SPDX-License-Identifier: MIT */
/* Valid messages of every type, made from the table: for the protocol's tests and the fuzzers' corpus. Also a
 * second, plain encoder that checks nothing, to compare with and to make wrong bytes. */
#ifndef FARLIGHT_TESTS_PROTOCOL_CASES_H
#define FARLIGHT_TESTS_PROTOCOL_CASES_H

#include <stdio.h>
#include <string.h>

#include "protocol/describe.h"

enum case_mode { CASE_MIN, CASE_MAX, CASE_RANDOM, CASE_MODE_COUNT };

struct case_maker {
    uint64_t state; /* state of the random numbers */
    enum case_mode mode;
    size_t used_bytes;
    uint8_t memory[1 << 20]; /* data that the message points at */
};

/* SplitMix64 (Steele, Lea, Flood 2014): the same numbers everywhere. */
static inline uint64_t case_random(struct case_maker *maker)
{
    uint64_t z = (maker->state += UINT64_C(0x9e3779b97f4a7c15));
    z = (z ^ (z >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    z = (z ^ (z >> 27)) * UINT64_C(0x94d049bb133111eb);
    return z ^ (z >> 31);
}

static inline uint64_t case_below(struct case_maker *maker, uint64_t bound)
{
    return bound > 0 ? case_random(maker) % bound : 0;
}

/* Zeroed, 16-aligned; NULL: the cases are larger than this memory. */
static inline void *case_alloc(struct case_maker *maker, size_t bytes)
{
    size_t start = (maker->used_bytes + 15) & ~(size_t)15;
    if (bytes > sizeof(maker->memory) - start)
        return NULL;
    maker->used_bytes = start + bytes;
    return memset(maker->memory + start, 0, bytes);
}

static inline uint64_t case_int(struct case_maker *maker, const struct field_desc *field)
{
    uint64_t span = field->max - field->min, value = field->min;
    switch (maker->mode) {
    case CASE_MIN:
        return field->min;
    case CASE_MAX:
        return field->max;
    default:
        do {
            value = field->min + (span == UINT64_MAX ? case_random(maker) : case_below(maker, span + 1));
        } while (!field_has_number(field, value));
        return value;
    }
}

static inline float case_real(struct case_maker *maker, const struct field_desc *field)
{
    double minimum = (double)field->real_min, maximum = (double)field->real_max;
    double share = (double)(case_random(maker) >> 11) / 9007199254740992.0;
    float value = (float)(minimum + share * (maximum - minimum));
    if (maker->mode == CASE_MIN || value < field->real_min)
        return field->real_min;
    if (maker->mode == CASE_MAX || value > field->real_max)
        return field->real_max;
    return value;
}

/* Text of one- to four-byte characters, none of them a control character. */
static inline char *case_text(struct case_maker *maker, size_t max_bytes)
{
    static const char *const characters[] = {
        "a", "Z", "7", " ", "/", "\"", "\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x92\xa1"};
    size_t want = maker->mode == CASE_MIN   ? 0
                  : maker->mode == CASE_MAX ? max_bytes
                                            : case_below(maker, max_bytes + 1);
    char *text = case_alloc(maker, max_bytes + 1);
    size_t used = 0;
    while (text && used < want) {
        const char *character = characters[case_below(maker, sizeof(characters) / sizeof(characters[0]))];
        size_t length = strlen(character);
        if (length > want - used) {
            character = "x";
            length = 1;
        }
        memcpy(text + used, character, length);
        used += length;
    }
    return text;
}

static inline void case_fixed(struct case_maker *maker, const struct field_desc *field, char *place)
{
    for (uint32_t i = 0; i < field->count; i++, place += field->width_bytes) {
        float value;
        switch (field->kind) {
        case FIELD_INT:
            field_store_int(field, place, case_int(maker, field));
            break;
        case FIELD_ENUM:
            field_store_int(
                field, place,
                maker->mode == CASE_MIN
                    ? field->enumeration->values[0].number
                    : field->enumeration->values[case_below(maker, field->enumeration->value_count)].number);
            break;
        case FIELD_REAL:
            value = case_real(maker, field);
            memcpy(place, &value, 4);
            break;
        default:
            *place = (char)(maker->mode == CASE_MIN ? 0 : case_random(maker));
            break;
        }
    }
}

static inline void case_struct(struct case_maker *maker, const struct struct_desc *desc, char *body);

static inline void case_counted(struct case_maker *maker, const struct field_desc *field, char *body)
{
    char *pointer = NULL;
    uint64_t maximum = field->kind == FIELD_ARRAY ? 5 : 300; /* a few suffice */
    maximum = field->max < maximum ? field->max : maximum;
    uint32_t count = (uint32_t)(maker->mode == CASE_MIN   ? 0
                                : maker->mode == CASE_MAX ? maximum
                                                          : case_below(maker, maximum + 1));
    if (field->kind == FIELD_STRING) {
        pointer = case_text(maker, (size_t)field->max);
    } else if (field->kind == FIELD_ARRAY) {
        const struct struct_desc *record = field->record();
        pointer = case_alloc(maker, count * record->size_bytes);
        for (uint32_t i = 0; i < count; i++)
            case_struct(maker, record, pointer + i * record->size_bytes);
    } else {
        pointer = case_alloc(maker, count);
        for (uint32_t i = 0; i < count; i++)
            pointer[i] = (char)case_random(maker);
    }
    memcpy(body + field->offset, &pointer, sizeof(pointer));
    if (field->kind != FIELD_STRING)
        memcpy(body + field->count_offset, &count, sizeof(count));
}

static inline void case_struct(struct case_maker *maker, const struct struct_desc *desc, char *body)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        if (field_is_counted(field)) {
            case_counted(maker, field, body);
        } else if (field->kind == FIELD_RECORD) {
            case_struct(maker, field->record(), body + field->offset);
        } else {
            case_fixed(maker, field, body + field->offset);
        }
    }
}

/* A valid message; lives as long as nothing else is made by `maker`. */
static inline void case_make(struct case_maker *maker, struct message *message, const struct message_desc *desc,
                             enum case_mode mode, uint64_t seed)
{
    maker->state = seed * 65537 + desc->info.type;
    maker->mode = mode;
    maker->used_bytes = 0;
    memset(message, 0, sizeof(*message));
    message->type = (enum message_type)desc->info.type;
    case_struct(maker, desc->body(), (char *)message + MESSAGE_BODY_OFFSET);
}

/* ---- the plain encoder: no checks but the buffer's size ---- */

struct plain_bytes {
    size_t count;
    uint8_t data[1 << 20];
};

static inline void plain_put(struct plain_bytes *out, uint64_t value, size_t bytes)
{
    for (size_t i = 0; i < bytes && out->count < sizeof(out->data); i++)
        out->data[out->count++] = (uint8_t)(value >> (8 * i));
}

static inline void plain_copy(struct plain_bytes *out, const void *bytes, size_t count)
{
    if (bytes && count <= sizeof(out->data) - out->count) {
        memcpy(out->data + out->count, bytes, count);
        out->count += count;
    }
}

static inline void plain_struct(struct plain_bytes *out, const struct struct_desc *desc, const char *body)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        const char *pointer = NULL;
        uint32_t count = 0;
        if (field->kind == FIELD_RECORD) {
            plain_put(out, field->record()->wire_fixed_bytes, 2);
            plain_struct(out, field->record(), body + field->offset);
            continue;
        }
        if (!field_is_counted(field)) {
            /* this test runs on little-endian hosts, where memory and wire are alike */
            plain_copy(out, body + field->offset, (size_t)field->width_bytes * field->count);
            continue;
        }
        memcpy(&pointer, body + field->offset, sizeof(pointer));
        if (field->kind == FIELD_STRING) {
            count = pointer ? (uint32_t)strlen(pointer) : 0;
        } else {
            memcpy(&count, body + field->count_offset, sizeof(count));
        }
        plain_put(out, count, 4);
        if (field->kind == FIELD_ARRAY) {
            for (uint32_t i = 0; pointer && i < count; i++)
                plain_struct(out, field->record(), pointer + i * field->record()->size_bytes);
            continue;
        }
        while (field->kind == FIELD_BULK && out->count % 8 != 0)
            plain_put(out, 0, 1);
        plain_copy(out, pointer, count);
    }
}

static inline void plain_encode(struct plain_bytes *out, const struct message *message)
{
    const struct struct_desc *desc = message_describe(message->type)->body();
    out->count = 0;
    plain_put(out, desc->wire_fixed_bytes, 2);
    plain_struct(out, desc, (const char *)message + MESSAGE_BODY_OFFSET);
}

/* ---- comparison ---- */

/* The first field that differs; NULL: equal. Reals by their bits. */
static inline const char *case_difference(const struct struct_desc *desc, const char *left, const char *right)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        const char *a = NULL, *b = NULL;
        uint32_t a_count = 0, b_count = 0;
        if (field->kind == FIELD_RECORD) {
            const char *inner = case_difference(field->record(), left + field->offset, right + field->offset);
            if (inner)
                return inner;
            continue;
        }
        if (!field_is_counted(field)) {
            if (memcmp(left + field->offset, right + field->offset, (size_t)field->width_bytes * field->count) !=
                0) {
                return field->name;
            }
            continue;
        }
        memcpy(&a, left + field->offset, sizeof(a));
        memcpy(&b, right + field->offset, sizeof(b));
        if (field->kind == FIELD_STRING) {
            if (strcmp(a ? a : "", b ? b : "") != 0)
                return field->name;
            continue;
        }
        memcpy(&a_count, left + field->count_offset, sizeof(a_count));
        memcpy(&b_count, right + field->count_offset, sizeof(b_count));
        if (a_count != b_count)
            return field->name;
        if (field->kind == FIELD_BULK) {
            if (a_count > 0 && memcmp(a, b, a_count) != 0)
                return field->name;
            continue;
        }
        const struct struct_desc *record = field->record();
        for (uint32_t i = 0; i < a_count; i++) {
            const char *inner = case_difference(record, a + i * record->size_bytes, b + i * record->size_bytes);
            if (inner)
                return inner;
        }
    }
    return NULL;
}

static inline const char *message_difference(const struct message *left, const struct message *right)
{
    if (left->type != right->type)
        return "type";
    return case_difference(message_describe(left->type)->body(), (const char *)left + MESSAGE_BODY_OFFSET,
                           (const char *)right + MESSAGE_BODY_OFFSET);
}

#endif
