/* SPDX-License-Identifier: MIT */
/* Every field of every message with every kind of wrong value: neither sent nor taken, and named. */
#include <stdlib.h>

#include "tests/unit/protocol/checks.h"
#include "tests/harness/test.h"

static uint32_t wrong_values_tried;

/* *message is wrong in `path`: the encoder must say so, and the decoder of its bytes too. */
static void expect_both_refuse(const struct message *message, const char *path, bool encoder_too)
{
    struct writer writer;
    struct message back;
    struct decode_error error;
    wrong_values_tried++;
    if (encoder_too) {
        writer_init(&writer, encoded, sizeof(encoded));
        if (message_encode(&writer, message))
            fail_msg("%s: a wrong value was sent", path);
        assert_string_equal(writer.error.field, path);
        assert_int_equal(writer.error.code, PROTOCOL_ERROR_INVALID);
        assert_int_equal(writer.used_bytes, 0);
    }
    plain_encode(&plain, message);
    if (decode_copy(&back, (uint16_t)message->type, plain.data, plain.count, &error))
        fail_msg("%s: a wrong value was taken", path);
    assert_string_equal(error.field, path);
    assert_int_equal(error.code, PROTOCOL_ERROR_INVALID);
}

static void try_wrong_int(const struct message *message, const struct field_desc *field, char *place,
                          const char *path)
{
    uint64_t good = field_load_int(field, place);
    uint64_t type_max = field->width_bytes == 8 ? UINT64_MAX : (UINT64_C(1) << (8 * field->width_bytes)) - 1;
    uint64_t wrong[] = {field->min - 1, 0, field->max + 1, type_max};
    bool meant[] = {field->min > 1 || (field->min == 1 && !field->zero_is_default),
                    field->min > 0 && !field->zero_is_default, field->max < type_max, field->max < type_max};
    if (field->kind == FIELD_ENUM) {
        wrong[0] = wrong[2] = field->enumeration->values[field->enumeration->value_count - 1].number + 1;
        meant[0] = meant[1] = false;
        meant[2] = meant[3] = true;
    }
    for (size_t i = 0; i < 4; i++) {
        if (meant[i]) {
            field_store_int(field, place, wrong[i]);
            expect_both_refuse(message, path, true);
        }
    }
    field_store_int(field, place, good);
}

static uint32_t float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, 4);
    return bits;
}

/* The next float away from 0, or beyond 0 on the side of `sign`. */
static uint32_t float_beyond(float value, uint32_t sign)
{
    uint32_t bits = float_bits(value);
    if ((bits & 0x7fffffffu) == 0)
        return (sign << 31) | 1u;
    return bits >> 31 == sign ? bits + 1 : bits - 1;
}

static void try_wrong_reals(const struct message *message, const struct field_desc *field, char *place,
                            const char *path)
{
    const uint32_t wrong[] = {
        0x7fc00000u,
        0xffc00001u,
        0x7f800001u,
        0x7f800000u,
        0xff800000u, /* quiet and signalling NaN, infinities */
        float_beyond(field->real_min, 1),
        float_beyond(field->real_max, 0),
    };
    for (uint32_t i = 0; i < field->count; i++) {
        char element[160];
        uint32_t good;
        memcpy(&good, place + 4 * i, 4);
        if (field->count > 1) {
            snprintf(element, sizeof(element), "%s[%u]", path, i);
        } else {
            snprintf(element, sizeof(element), "%s", path);
        }
        for (size_t k = 0; k < sizeof(wrong) / sizeof(wrong[0]); k++) {
            memcpy(place + 4 * i, &wrong[k], 4);
            expect_both_refuse(message, element, true);
        }
        memcpy(place + 4 * i, &good, 4);
    }
}

static void try_wrong_string(const struct message *message, const struct field_desc *field, char *body,
                             const char *path)
{
    static const char *const wrong[] = {
        "\xff",
        "\x80",
        "a\xc3",
        "\xc0\x80",
        "\xc1\xbf",
        "\xe2\x82",
        "\xe0\x9f\xbf",
        "\xed\xa0\x80",
        "\xf0\x8f\xbf\xbf",
        "\xf4\x90\x80\x80",
        "\xf8\x88\x80\x80\x80",
        "\xe2\x28\xa1",
    };
    const char *good;
    char *text = calloc(1, (size_t)field->max + 2);
    assert_non_null(text);
    memcpy(&good, body + field->offset, sizeof(good));
    memcpy(body + field->offset, &text, sizeof(text));
    for (size_t i = 0; i < sizeof(wrong) / sizeof(wrong[0]); i++) {
        snprintf(text, (size_t)field->max + 2, "%s", wrong[i]);
        expect_both_refuse(message, path, true);
    }
    memset(text, 'x', (size_t)field->max + 1);
    expect_both_refuse(message, path, true);
    /* a NUL can only come from the wire */
    memcpy(text, "Q", 2); /* which no other field has */
    plain_encode(&plain, message);
    uint8_t *at = memmem(plain.data, plain.count, "\x01\0\0\0Q", 5);
    while (at && memmem(at + 1, plain.count - (size_t)(at + 1 - plain.data), "\x01\0\0\0Q", 5))
        at = memmem(at + 1, plain.count - (size_t)(at + 1 - plain.data), "\x01\0\0\0Q", 5);
    assert_non_null(at);
    at[4] = 0;
    struct message back;
    struct decode_error error;
    assert_false(decode_copy(&back, (uint16_t)message->type, plain.data, plain.count, &error));
    assert_string_equal(error.field, path);
    memcpy(body + field->offset, &good, sizeof(good));
    free(text);
}

static void try_wrong_count(const struct message *message, const struct field_desc *field, char *body,
                            const char *path)
{
    const void *good_pointer, *none = NULL;
    uint32_t good_count, wrong_counts[] = {(uint32_t)field->max + 1, 0x7fffffffu, UINT32_MAX};
    memcpy(&good_pointer, body + field->offset, sizeof(good_pointer));
    memcpy(&good_count, body + field->count_offset, 4);
    memcpy(body + field->offset, &none, sizeof(none));
    for (size_t i = 0; i < 3; i++) {
        memcpy(body + field->count_offset, &wrong_counts[i], 4);
        expect_both_refuse(message, path, true);
    }
    /* an allowed number of elements that are absent: it cannot be sent; and nothing is reserved for it on
     * arrival */
    uint32_t absent = (uint32_t)field->max;
    struct writer writer;
    struct message back;
    struct decode_error error;
    memcpy(body + field->count_offset, &absent, 4);
    writer_init(&writer, encoded, sizeof(encoded));
    assert_false(message_encode(&writer, message));
    assert_string_equal(writer.error.field, path);
    plain_encode(&plain, message);
    assert_false(decode_copy(&back, (uint16_t)message->type, plain.data, plain.count, &error));
    memcpy(body + field->offset, &good_pointer, sizeof(good_pointer));
    memcpy(body + field->count_offset, &good_count, 4);
}

static void try_wrong_fields(const struct message *message, const struct struct_desc *desc, char *body,
                             const char *parent)
{
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        char path[120];
        char *elements;
        uint32_t count;
        assert_true(snprintf(path, sizeof(path), "%s.%s", parent, field->name) < (int)sizeof(path));
        switch (field->kind) {
        case FIELD_INT:
        case FIELD_ENUM:
            try_wrong_int(message, field, body + field->offset, path);
            break;
        case FIELD_REAL:
            try_wrong_reals(message, field, body + field->offset, path);
            break;
        case FIELD_BYTES:
            break;
        case FIELD_RECORD:
            try_wrong_fields(message, field->record(), body + field->offset, parent); /* without its own name */
            break;
        case FIELD_STRING:
            try_wrong_string(message, field, body, path);
            break;
        case FIELD_BULK:
            try_wrong_count(message, field, body, path);
            break;
        case FIELD_ARRAY:
            try_wrong_count(message, field, body, path);
            memcpy(&elements, body + field->offset, sizeof(elements));
            memcpy(&count, body + field->count_offset, 4);
            assert_true(count > 0);
            snprintf(path, sizeof(path), "%s.%s[%u]", parent, field->name, count - 1);
            try_wrong_fields(message, field->record(), elements + (count - 1) * field->record()->size_bytes, path);
            break;
        }
    }
}

TEST(a_wrong_value_of_any_field_is_refused_with_the_path_of_the_field)
{
    struct message message;
    for (size_t i = 0; i < protocol_message_count; i++) {
        case_make(&maker, &message, &protocol_messages[i], CASE_MAX, 6);
        try_wrong_fields(&message, protocol_messages[i].body(), (char *)&message + MESSAGE_BODY_OFFSET,
                         protocol_messages[i].info.name);
        check_round_trip(&message); /* everything was put back */
    }
    assert_true(wrong_values_tried > 1000);
}

/* An error names a field without the record that it lies in. */
TEST(the_fields_of_a_message_and_its_records_have_different_names)
{
    for (size_t i = 0; i < protocol_message_count; i++) {
        struct field_desc leaves[160];
        const struct message_desc *desc = &protocol_messages[i];
        const size_t count = struct_leaves(desc->body(), leaves, 160);
        assert_in_range(count, 0, 159);
        for (size_t a = 0; a < count; a++) {
            for (size_t b = 0; b < a; b++) {
                if (strcmp(leaves[a].name, leaves[b].name) == 0)
                    fail_msg("%s.%s stands for two fields", desc->info.name, leaves[a].name);
            }
        }
    }
}

TEST(bulk_padding_must_be_zero)
{
    struct message message = {.type = MESSAGE_BLOB_DATA};
    struct message back;
    struct decode_error error;
    static const uint8_t bytes[3] = {1, 2, 3};
    message.blob_data.data = bytes;
    message.blob_data.data_bytes = sizeof(bytes);
    size_t count = encode_both(&message);
    assert_int_equal(count, 2 + 40 + 4 + 2 + 3);
    assert_true(decode_copy(&back, MESSAGE_BLOB_DATA, encoded, count, &error));
    encoded[47] = 1;
    assert_false(decode_copy(&back, MESSAGE_BLOB_DATA, encoded, count, &error));
    assert_string_equal(error.field, "blob_data.data");
}
