/* SPDX-License-Identifier: MIT */
/* Checks of every message of the table: there and back, golden bytes, cut, prolonged, older and newer peers,
 * too little memory. Run from the top of the tree; FARLIGHT_UPDATE_GOLDEN=1 writes the golden bytes anew. */
#include <stdlib.h>

#include "tests/unit/protocol/checks.h"
#include "tests/harness/test.h"

#define GOLDEN_PATH "tests/unit/protocol/golden/messages.hex"
#define RANDOM_CASES 20u

TEST(every_message_round_trips_unchanged)
{
    struct message message;
    for (size_t i = 0; i < protocol_message_count; i++) {
        const struct message_desc *desc = &protocol_messages[i];
        case_make(&maker, &message, desc, CASE_MIN, 0);
        check_round_trip(&message);
        case_make(&maker, &message, desc, CASE_MAX, 0);
        check_round_trip(&message);
        for (uint64_t seed = 1; seed <= RANDOM_CASES; seed++) {
            case_make(&maker, &message, desc, CASE_RANDOM, seed);
            check_round_trip(&message);
        }
    }
}

TEST(what_message_init_makes_can_be_sent_and_null_strings_are_empty)
{
    struct message message;
    for (size_t i = 0; i < protocol_message_count; i++) {
        message_init(&message, (enum message_type)protocol_messages[i].info.type);
        check_round_trip(&message);
    }
    struct message null_text = {.type = MESSAGE_SCENE_OPEN, .scene_open = {.scene = 1, .name = NULL}};
    struct message back;
    struct decode_error error;
    size_t count = encode_both(&null_text);
    assert_true(decode_copy(&back, MESSAGE_SCENE_OPEN, encoded, count, &error));
    assert_string_equal(back.scene_open.name, "");
}

/* ---- golden bytes ---- */

static void write_hex(FILE *file, const uint8_t *bytes, size_t count)
{
    for (size_t i = 0; i < count; i++)
        fprintf(file, "%02x", bytes[i]);
    fputc('\n', file);
}

static const char *const mode_names[CASE_MODE_COUNT] = {"min", "max", "random"};

static int update_golden(void)
{
    struct message message;
    FILE *file = fopen(GOLDEN_PATH, "w");
    if (!file) {
        perror(GOLDEN_PATH);
        return 1;
    }
    for (size_t i = 0; i < protocol_message_count; i++) {
        for (enum case_mode mode = CASE_MIN; mode < CASE_MODE_COUNT; mode++) {
            case_make(&maker, &message, &protocol_messages[i], mode, 1);
            plain_encode(&plain, &message);
            fprintf(file, "%s %s ", protocol_messages[i].info.name, mode_names[mode]);
            write_hex(file, plain.data, plain.count);
        }
    }
    return fclose(file) == 0 ? 0 : 1;
}

static int prepare(void **state)
{
    (void)state;
    return getenv("FARLIGHT_UPDATE_GOLDEN") ? update_golden() : 0;
}
ALL_TESTS(prepare, NULL)

static uint8_t *parse_hex(const char *text, size_t *count)
{
    size_t digits = strspn(text, "0123456789abcdef");
    uint8_t *bytes = malloc(digits / 2 + 1);
    assert_non_null(bytes);
    *count = digits / 2;
    for (size_t i = 0; i < *count; i++) {
        const char pair[3] = {text[2 * i], text[2 * i + 1], '\0'};
        bytes[i] = (uint8_t)strtoul(pair, NULL, 16);
    }
    return bytes;
}

TEST(the_bytes_on_the_wire_are_the_stored_ones)
{
    struct message message;
    char *line = NULL;
    size_t line_capacity = 0;
    FILE *file = fopen(GOLDEN_PATH, "r");
    if (!file)
        fail_msg("cannot read %s (run from the top of the tree)", GOLDEN_PATH);
    for (size_t i = 0; i < protocol_message_count; i++) {
        for (enum case_mode mode = CASE_MIN; mode < CASE_MODE_COUNT; mode++) {
            const char *name = protocol_messages[i].info.name;
            char head[96];
            snprintf(head, sizeof(head), "%s %s ", name, mode_names[mode]);
            if (getline(&line, &line_capacity, file) < 0 || strncmp(line, head, strlen(head)) != 0) {
                fail_msg("%s: no line for '%s'; if the table grew, run this test with FARLIGHT_UPDATE_GOLDEN=1",
                         GOLDEN_PATH, head);
            }
            case_make(&maker, &message, &protocol_messages[i], mode, 1);
            size_t count = encode_both(&message);
            size_t golden_count;
            uint8_t *golden = parse_hex(line + strlen(head), &golden_count);
            if (count != golden_count || memcmp(encoded, golden, count) != 0) {
                fail_msg("%s %s: %zu bytes on the wire are not the %zu stored ones", name, mode_names[mode], count,
                         golden_count);
            }
            free(golden);
        }
    }
    assert_int_equal(getline(&line, &line_capacity, file), -1);
    free(line);
    fclose(file);
}

/* ---- cut, prolonged ---- */

TEST(every_prefix_of_every_message_is_refused)
{
    struct message message, back;
    struct decode_error error;
    for (size_t i = 0; i < protocol_message_count; i++) {
        for (enum case_mode mode = CASE_MIN; mode < CASE_MODE_COUNT; mode++) {
            case_make(&maker, &message, &protocol_messages[i], mode, 3);
            size_t count = encode_both(&message);
            for (size_t length = 0; length < count; length++) {
                if (decode_copy(&back, (uint16_t)message.type, encoded, length, &error))
                    fail_msg("%s: %zu of %zu bytes were taken", protocol_messages[i].info.name, length, count);
                assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
            }
        }
    }
}

TEST(bytes_after_the_last_field_are_refused)
{
    struct message message, back;
    struct decode_error error;
    for (size_t i = 0; i < protocol_message_count; i++) {
        for (size_t extra = 1; extra <= 9; extra++) {
            case_make(&maker, &message, &protocol_messages[i], CASE_RANDOM, 4);
            size_t count = encode_both(&message);
            memset(encoded + count, 0, extra);
            assert_false(decode_copy(&back, (uint16_t)message.type, encoded, count + extra, &error));
            assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
            assert_string_equal(error.field, protocol_messages[i].info.name);
        }
    }
}

/* Encodes *message with only the first fixed_bytes of its fixed part and then extra bytes of it. */
static void encode_fixed_part(const struct message *message, size_t fixed_bytes, size_t extra)
{
    const struct struct_desc *desc = message_describe(message->type)->body();
    const char *body = (const char *)message + MESSAGE_BODY_OFFSET;
    struct field_desc counted[16];
    struct struct_desc rest = {.fields = counted};
    size_t counted_count = 0;
    uint8_t fixed[1024];
    plain_encode(&plain, message);
    assert_true(desc->wire_fixed_bytes < sizeof(fixed));
    memcpy(fixed, plain.data + 2, desc->wire_fixed_bytes);
    for (const struct field_desc *field = desc->fields; field->name; field++) {
        if (field_is_counted(field)) {
            assert_true(counted_count < 15);
            counted[counted_count++] = *field;
        }
    }
    counted[counted_count].name = NULL;
    plain.count = 0;
    plain_put(&plain, fixed_bytes + extra, 2);
    plain_copy(&plain, fixed, fixed_bytes);
    for (size_t i = 0; i < extra; i++)
        plain_put(&plain, 0xff, 1);
    plain_struct(&plain, &rest, body);
}

TEST(a_shorter_fixed_part_gets_defaults_and_a_longer_one_is_read_past)
{
    struct message message, back, expected;
    struct decode_error error;
    for (size_t i = 0; i < protocol_message_count; i++) {
        const struct message_desc *desc = &protocol_messages[i];
        const struct struct_desc *body = desc->body();
        case_make(&maker, &message, desc, CASE_RANDOM, 5);
        message_init(&expected, message.type);
        for (const struct field_desc *field = body->fields; field->name; field++) {
            if (field_is_counted(field)) {
                size_t pointer_and_count = field->kind == FIELD_STRING ? 0 : 4;
                memcpy((char *)&expected + MESSAGE_BODY_OFFSET + field->offset,
                       (char *)&message + MESSAGE_BODY_OFFSET + field->offset, sizeof(void *));
                memcpy((char *)&expected + MESSAGE_BODY_OFFSET + field->count_offset,
                       (char *)&message + MESSAGE_BODY_OFFSET + field->count_offset, pointer_and_count);
            }
        }
        size_t fixed_bytes = 0;
        for (const struct field_desc *field = body->fields; !(!field->name || field_is_counted(field)); field++) {
            size_t size = (size_t)field->width_bytes * field->count;
            encode_fixed_part(&message, fixed_bytes, 0);
            assert_true(decode_copy(&back, desc->info.type, plain.data, plain.count, &error));
            const char *difference = message_difference(&back, &expected);
            if (difference) {
                fail_msg("%s.%s is not what it should be after %zu fixed bytes", desc->info.name, difference,
                         fixed_bytes);
            }
            for (size_t part = 1; part < size && field->kind != FIELD_RECORD; part++) { /* cut within the field */
                char path[128];
                snprintf(path, sizeof(path), "%s.%s", desc->info.name, field->name);
                encode_fixed_part(&message, fixed_bytes + part, 0);
                assert_false(decode_copy(&back, desc->info.type, plain.data, plain.count, &error));
                assert_string_equal(error.field, path);
                assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
            }
            size_t memory_bytes = field->kind == FIELD_RECORD ? field->record()->size_bytes : size;
            memcpy((char *)&expected + MESSAGE_BODY_OFFSET + field->offset,
                   (char *)&message + MESSAGE_BODY_OFFSET + field->offset, memory_bytes);
            fixed_bytes += size;
        }
        for (size_t extra = 0; extra <= 11; extra++) {
            encode_fixed_part(&message, fixed_bytes, extra);
            assert_true(decode_copy(&back, desc->info.type, plain.data, plain.count, &error));
            assert_null(message_difference(&back, &message));
        }
    }
}

/* ---- memory ---- */

TEST(the_stated_scratch_suffices_and_less_is_refused_safely)
{
    struct message message, back;
    struct decode_error error;
    struct scratch scratch;
    for (size_t i = 0; i < protocol_record_count; i++) {
        /* the header promises that an element never takes more than twice its bytes */
        const struct struct_desc *record = protocol_records[i]();
        size_t strings = 0;
        for (const struct field_desc *field = record->fields; field->name; field++) {
            strings += field->kind == FIELD_STRING;
            assert_int_not_equal(field->kind, FIELD_BULK);
        }
        if (record->size_bytes + strings > 2 * record->wire_min_bytes) {
            fail_msg("record %s: %zu bytes in memory, %u on the wire", record->name, record->size_bytes,
                     record->wire_min_bytes);
        }
    }
    for (size_t i = 0; i < protocol_message_count; i++) {
        case_make(&maker, &message, &protocol_messages[i], CASE_MAX, 7);
        size_t count = encode_both(&message);
        size_t used = 0;
        for (size_t shift = 0; shift < 8; shift++) {
            scratch_init(&scratch, scratch_memory + shift, 2 * count + 8);
            assert_true(message_decode(&back, (uint16_t)message.type, encoded, count, &scratch, &error));
            assert_null(message_difference(&message, &back));
            used = scratch.used_bytes;
        }
        for (size_t less = 0; less < used; less += 1 + used / 64) {
            uint8_t *memory = malloc(less > 0 ? less : 1);
            assert_non_null(memory);
            scratch_init(&scratch, memory, less);
            if (message_decode(&back, (uint16_t)message.type, encoded, count, &scratch, &error)) {
                assert_true(scratch.used_bytes <= less); /* another alignment may need less */
            } else {
                assert_int_equal(error.code, PROTOCOL_ERROR_LIMIT);
            }
            free(memory);
        }
    }
}

TEST(a_buffer_of_any_smaller_size_is_not_written_beyond)
{
    struct message message;
    struct writer writer;
    for (size_t i = 0; i < protocol_message_count; i++) {
        case_make(&maker, &message, &protocol_messages[i], CASE_RANDOM, 8);
        size_t count = encode_both(&message);
        for (size_t less = 0; less < count; less += 1 + count / 64) {
            uint8_t *memory = malloc(less > 0 ? less : 1);
            assert_non_null(memory);
            writer_init(&writer, memory, less);
            assert_false(message_encode(&writer, &message));
            assert_int_equal(writer.error.code, PROTOCOL_ERROR_LIMIT);
            assert_false(writer_put_u8(&writer, 0));
            free(memory);
        }
    }
}

TEST(a_message_above_the_control_maximum_is_not_sent)
{
    static struct record_scene_stat scenes[256];
    static uint8_t large[1 << 20];
    struct message message;
    struct writer writer;
    char name[129];
    memset(name, 'n', sizeof(name) - 1);
    name[128] = '\0';
    for (size_t i = 0; i < 256; i++) {
        scenes[i] = (struct record_scene_stat){.client = i, .name = name};
    }
    static struct record_client_stat clients[256];
    name[64] = '\0';
    for (size_t i = 0; i < 256; i++) {
        clients[i] = (struct record_client_stat){.client = i, .name = name};
        scenes[i].name =
            "the longest name of a scene that fills the reply until it is too large to go out, and then some "
            "more of it until it is.";
    }
    message_init(&message, MESSAGE_STATS_REPLY);
    message.stats_reply.scenes = scenes;
    message.stats_reply.scenes_count = 256;
    message.stats_reply.clients = clients;
    message.stats_reply.clients_count = 256;
    writer_init(&writer, large, sizeof(large));
    assert_false(message_encode(&writer, &message));
    assert_int_equal(writer.error.code, PROTOCOL_ERROR_LIMIT);
    assert_string_equal(writer.error.field, "stats_reply");
    message.stats_reply.clients_count = 10;
    writer_init(&writer, large, sizeof(large));
    assert_true(message_encode(&writer, &message));
}

TEST(unknown_types_are_neither_sent_nor_decoded)
{
    struct message message = {.type = (enum message_type)0x7ffe}, back;
    struct writer writer;
    struct decode_error error;
    writer_init(&writer, encoded, sizeof(encoded));
    assert_false(message_encode(&writer, &message));
    assert_int_equal(message_payload_bytes(&message), 0);
    assert_false(decode_copy(&back, 0x7ffe, encoded, 2, &error));
    assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
    assert_string_equal(message_type_text(0x7ffe), "unknown");
    assert_null(message_lookup(0x7ffe));
}
