/* SPDX-License-Identifier: MIT */
/* Messages in a stream: cut at every byte, from the wrong side, too large, unknown. */
#include <stdlib.h>

#include "tests/unit/protocol/cases.h"
#include "tests/harness/test.h"

#define ACCEPT_ALL (MESSAGE_FROM_BOTH | MESSAGE_FROM_LOCAL)

static struct case_maker maker;
static uint8_t stream[4 << 20];
static uint8_t scratch_memory[SCRATCH_BYTES];

/* Writes all messages of the table, one after the other; message k has request 1000 + k and channel k. */
static size_t make_stream(void)
{
    struct writer writer;
    struct message message;
    writer_init(&writer, stream, sizeof(stream));
    for (size_t i = 0; i < protocol_message_count; i++) {
        case_make(&maker, &message, &protocol_messages[i], CASE_RANDOM, 11);
        size_t start = writer.used_bytes;
        if (!message_write(&writer, 1000 + (uint32_t)i, (uint32_t)i, &message))
            fail_msg("%s: %s", writer.error.field, writer.error.text);
        assert_int_equal(writer.used_bytes % 8, 0);
        assert_int_equal(writer.used_bytes - start, message_write_bytes(&message));
    }
    return writer.used_bytes;
}

/* framing_parse() out of an allocation of exactly that size. */
static enum framing_result parse_copy(struct frame *frame, const uint8_t *bytes, size_t count, uint32_t accept,
                                      struct decode_error *error)
{
    uint8_t *copy = malloc(count > 0 ? count : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, count);
    enum framing_result result = framing_parse(frame, copy, count, accept, error);
    if (result == FRAMING_CONSUMED)
        frame->payload = bytes + (frame->payload - copy);
    free(copy);
    return result;
}

static void check_message(const struct frame *frame, size_t index)
{
    struct scratch scratch;
    struct message expected, back;
    struct decode_error error;
    case_make(&maker, &expected, &protocol_messages[index], CASE_RANDOM, 11);
    assert_int_equal(frame->header.request, 1000 + index);
    assert_int_equal(frame->header.channel, index);
    assert_int_equal(frame->header.flags, 0);
    assert_ptr_equal(frame->info, &protocol_messages[index].info);
    scratch_init(&scratch, scratch_memory, sizeof(scratch_memory));
    if (!message_decode(&back, frame->header.type, frame->payload, frame->header.payload_bytes, &scratch,
                        &error)) {
        fail_msg("%s: %s", error.field, error.text);
    }
    assert_null(message_difference(&expected, &back));
}

TEST(a_stream_fed_byte_by_byte_gives_every_message_once)
{
    struct frame frame;
    struct decode_error error;
    size_t total = make_stream(), start = 0, index = 0, wanted = 0;
    for (size_t end = 0; end <= total; end++) {
        enum framing_result result = parse_copy(&frame, stream + start, end - start, ACCEPT_ALL, &error);
        if (result == FRAMING_NEED_MORE) {
            assert_true(frame.need_bytes > end - start);
            assert_true(frame.need_bytes <= FRAMING_MESSAGE_MAX_BYTES);
            wanted = frame.need_bytes;
            continue;
        }
        assert_int_equal(result, FRAMING_CONSUMED);
        assert_int_equal(frame.consumed_bytes, end - start); /* consumed as soon as it is complete */
        assert_int_equal(frame.consumed_bytes, wanted);      /* and as was foretold */
        check_message(&frame, index++);
        start = end;
    }
    assert_int_equal(index, protocol_message_count);
    assert_int_equal(start, total);
}

TEST(a_message_of_the_wrong_side_is_denied_before_its_payload)
{
    struct frame frame;
    struct decode_error error;
    for (size_t i = 0; i < protocol_message_count; i++) {
        const struct message_info *info = &protocol_messages[i].info;
        struct framing_header header = {.payload_bytes = info->payload_min_bytes, .type = info->type};
        uint8_t bytes[FRAMING_HEADER_BYTES];
        framing_header_encode(bytes, &header);
        for (uint32_t accept = 0; accept <= ACCEPT_ALL; accept++) {
            enum framing_result result = parse_copy(&frame, bytes, sizeof(bytes), accept, &error);
            if ((accept & info->from) != 0) {
                assert_int_equal(result, FRAMING_NEED_MORE);
            } else {
                assert_int_equal(result, FRAMING_FATAL);
                assert_int_equal(error.code, PROTOCOL_ERROR_DENIED);
                assert_string_equal(error.field, "type");
                assert_non_null(strstr(error.text, info->name));
            }
        }
    }
}

static void expect_fatal(const struct framing_header *header, const char *field)
{
    uint8_t bytes[FRAMING_HEADER_BYTES];
    struct frame frame;
    struct decode_error error;
    framing_header_encode(bytes, header);
    if (parse_copy(&frame, bytes, sizeof(bytes), ACCEPT_ALL, &error) != FRAMING_FATAL) {
        fail_msg("type 0x%04x, %u bytes, flags %u: %s was taken", header->type, header->payload_bytes,
                 header->flags, field);
    }
    assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
    assert_string_equal(error.field, field);
    assert_int_equal(framing_parse(&frame, bytes, sizeof(bytes), ACCEPT_ALL, NULL), FRAMING_FATAL);
}

TEST(sizes_outside_the_row_of_the_table_are_refused_before_the_payload_comes)
{
    for (size_t i = 0; i < protocol_message_count; i++) {
        const struct message_info *info = &protocol_messages[i].info;
        const uint32_t wrong[] = {
            info->payload_min_bytes - 1, 0, info->payload_max_bytes + 1, 0x7fffffffu, 0xfffffff8u, UINT32_MAX};
        assert_true(info->payload_min_bytes >= 2);
        for (size_t k = 0; k < sizeof(wrong) / sizeof(wrong[0]); k++) {
            expect_fatal(&(struct framing_header){.payload_bytes = wrong[k], .type = info->type}, "payload_bytes");
        }
        expect_fatal(
            &(struct framing_header){.payload_bytes = info->payload_min_bytes, .type = info->type, .flags = 1},
            "flags");
    }
}

TEST(an_unknown_type_is_fatal_unless_it_may_be_ignored)
{
    uint8_t bytes[FRAMING_HEADER_BYTES + 8] = {0};
    struct frame frame;
    struct decode_error error;
    expect_fatal(&(struct framing_header){.payload_bytes = 2, .type = 0x7ffe}, "type");
    expect_fatal(&(struct framing_header){.payload_bytes = 2, .type = 0}, "type");
    expect_fatal(&(struct framing_header){.payload_bytes = CODEC_BULK_PAYLOAD_MAX_BYTES + 1, .type = 0xfffe},
                 "payload_bytes");
    framing_header_encode(bytes, &(struct framing_header){.payload_bytes = 3, .type = 0xfffe});
    assert_int_equal(parse_copy(&frame, bytes, sizeof(bytes) - 1, 0, &error), FRAMING_NEED_MORE);
    assert_int_equal(parse_copy(&frame, bytes, sizeof(bytes), 0, &error), FRAMING_CONSUMED);
    assert_null(frame.info);
    assert_int_equal(frame.consumed_bytes, sizeof(bytes));
}

TEST(padding_must_be_zero)
{
    uint8_t bytes[FRAMING_HEADER_BYTES + 8] = {0};
    struct frame frame;
    struct decode_error error;
    framing_header_encode(bytes, &(struct framing_header){.payload_bytes = 2, .type = MESSAGE_STATS});
    assert_int_equal(parse_copy(&frame, bytes, sizeof(bytes), ACCEPT_ALL, &error), FRAMING_CONSUMED);
    for (size_t i = FRAMING_HEADER_BYTES + 2; i < sizeof(bytes); i++) {
        bytes[i] = 0x80;
        assert_int_equal(parse_copy(&frame, bytes, sizeof(bytes), ACCEPT_ALL, &error), FRAMING_FATAL);
        assert_string_equal(error.field, "padding");
        bytes[i] = 0;
    }
}

TEST(the_header_has_its_fixed_layout)
{
    static const uint8_t expected[FRAMING_HEADER_BYTES] = {4, 3, 2, 1, 6, 5, 8, 7, 12, 11, 10, 9, 16, 15, 14, 13};
    const struct framing_header header = {0x01020304, 0x0506, 0x0708, 0x090a0b0c, 0x0d0e0f10};
    struct framing_header back;
    uint8_t bytes[FRAMING_HEADER_BYTES];
    framing_header_encode(bytes, &header);
    assert_memory_equal(bytes, expected, sizeof(bytes));
    framing_header_decode(&back, bytes);
    assert_memory_equal(&back, &header, sizeof(header));
}

TEST(a_message_that_does_not_fit_leaves_the_buffer_unchanged)
{
    struct message message;
    struct writer writer;
    for (size_t i = 0; i < protocol_message_count; i++) {
        case_make(&maker, &message, &protocol_messages[i], CASE_RANDOM, 12);
        size_t count = message_write_bytes(&message);
        for (size_t less = 0; less < count; less += 1 + count / 64) {
            uint8_t *memory = malloc(8 + less);
            assert_non_null(memory);
            writer_init(&writer, memory, 8 + less);
            assert_true(writer_put_u64(&writer, 1));
            assert_false(message_write(&writer, 1, 2, &message));
            assert_int_equal(writer.used_bytes, 8);
            assert_int_equal(writer.error.code, PROTOCOL_ERROR_LIMIT);
            free(memory);
        }
        writer_init(&writer, stream, count);
        assert_true(message_write(&writer, 1, 2, &message));
        assert_int_equal(writer.used_bytes, count);
    }
}

TEST(numbers_and_names_of_the_table_are_unique)
{
    for (size_t i = 0; i < protocol_message_count; i++) {
        const struct message_info *info = &protocol_messages[i].info;
        bool counted = false;
        assert_ptr_equal(message_lookup(info->type), info);
        assert_string_equal(message_type_text(info->type), info->name);
        assert_true(info->from >= 1 && info->from <= 4);
        for (size_t k = 0; k < i; k++) {
            assert_int_not_equal(info->type, protocol_messages[k].info.type);
            assert_string_not_equal(info->name, protocol_messages[k].info.name);
        }
        for (const struct field_desc *field = protocol_messages[i].body()->fields; field->name; field++) {
            if (counted && !field_is_counted(field))
                fail_msg("%s.%s: fixed fields come first", info->name, field->name);
            counted = counted || field_is_counted(field);
        }
    }
}

TEST(the_largest_bulk_message_fits_the_stated_buffer)
{
    static uint8_t bytes[262144];
    struct message message = {.type = MESSAGE_BLOB_DATA};
    struct writer writer;
    struct frame frame;
    struct decode_error error;
    message.blob_data.data = bytes;
    message.blob_data.data_bytes = sizeof(bytes);
    writer_init(&writer, stream, FRAMING_MESSAGE_MAX_BYTES);
    assert_true(message_write(&writer, 7, 1, &message));
    assert_int_equal(framing_parse(&frame, stream, writer.used_bytes, MESSAGE_FROM_CLIENT, &error),
                     FRAMING_CONSUMED);
    struct scratch scratch = {0};
    assert_true(
        message_decode(&message, MESSAGE_BLOB_DATA, frame.payload, frame.header.payload_bytes, &scratch, &error));
    assert_int_equal(message.blob_data.data_bytes, sizeof(bytes));
    assert_int_equal((size_t)(message.blob_data.data - stream) % 8, 0);
}
