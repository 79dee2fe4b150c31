/* SPDX-License-Identifier: MIT */
/* The first bytes of a connection: their frozen layout, every prefix, everything that is not one. */
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

#include "protocol/handshake.h"
#include "tests/harness/test.h"

static struct handshake_hello some_hello(void)
{
    struct handshake_hello hello = {.version_min = 1, .version_max = 3, .capabilities = 0x1122334455667788};
    for (size_t i = 0; i < HANDSHAKE_NONCE_BYTES; i++)
        hello.nonce[i] = (uint8_t)(0xa0 + i);
    strcpy(hello.name, "viewer \xc3\xa9");
    return hello;
}

static struct handshake_reply some_reply(void)
{
    struct handshake_reply reply = {.version = 1, .capabilities = 5};
    reply.limits = (struct handshake_limits){
        .queued_output_bytes = UINT64_C(1) << 40,
        .scene_memory_bytes = 2,
        .handshake_ms = 3,
        .control_payload_max_bytes = 4,
        .bulk_chunk_max_bytes = 5,
        .requests_in_flight = 6,
        .scenes_per_client = 7,
        .views_per_client = 8,
        .nodes_max = 9,
        .texture_edge_max = 10,
        .width_max = 11,
        .height_max = 12,
        .samples_max = 13,
        .idle_seconds = 14,
        .queued_soft_bytes = 15,
        .device_memory_bytes = 16,
        .blob_memory_bytes = 17,
        .transaction_memory_bytes = 18,
        .frame_memory_bytes = 19,
        .upload_window_bytes = 20,
        .frame_window_bytes = 21,
        .queued_soft_ms = 22,
        .progress_grace_ms = 23,
        .progress_bytes_per_s = 24,
        .clients_max = 25,
        .unauthenticated_max = 26,
        .unauthenticated_per_address = 27,
        .wrong_key_ms = 28,
        .depth_max = 29,
        .blobs_per_client = 30,
        .transaction_edits = 31,
        .scene_linger_seconds = 32,
        .scenes_lingering = 33,
        .ldc_memory_bytes = 34,
        .abuffer_memory_bytes = 35,
        .ldc_layers_max = 36,
        .lost_after_ms = 37,
        .handshakes_per_second = 38,
    };
    for (size_t i = 0; i < HANDSHAKE_NONCE_BYTES; i++) {
        reply.nonce[i] = (uint8_t)(0xb0 + i);
        reply.session_token[i] = (uint8_t)(0xc0 + i);
    }
    strcpy(reply.name, "farlightd");
    strcpy(reply.text, "none in common");
    return reply;
}

/* Parses out of an allocation of exactly that size. */
static enum handshake_result parse_hello_copy(struct handshake_hello *out, const uint8_t *bytes, size_t count,
                                              size_t *consumed, struct decode_error *error)
{
    uint8_t *copy = malloc(count > 0 ? count : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, count);
    enum handshake_result result = handshake_hello_parse(out, copy, count, consumed, error);
    free(copy);
    return result;
}

static enum handshake_result parse_reply_copy(struct handshake_reply *out, const uint8_t *bytes, size_t count,
                                              size_t *consumed, struct decode_error *error)
{
    uint8_t *copy = malloc(count > 0 ? count : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, count);
    enum handshake_result result = handshake_reply_parse(out, copy, count, consumed, error);
    free(copy);
    return result;
}

TEST(the_first_bytes_of_the_client_have_their_frozen_layout)
{
    static const uint8_t expected[48] = {
        'F',  'A',  'R',  'L',  1,    0,    3,    0,    0x88, 0x77, 0x66, 0x55, 0x44, 0x33, 0x22, 0x11,
        0xa0, 0xa1, 0xa2, 0xa3, 0xa4, 0xa5, 0xa6, 0xa7, 0xa8, 0xa9, 0xaa, 0xab, 0xac, 0xad, 0xae, 0xaf,
        9,    'v',  'i',  'e',  'w',  'e',  'r',  ' ',  0xc3, 0xa9, 0,    0,    0,    0,    0,    0,
    };
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    struct handshake_hello hello = some_hello(), back;
    struct decode_error error;
    size_t consumed;
    assert_int_equal(handshake_hello_encode(bytes, &hello), sizeof(expected));
    assert_memory_equal(bytes, expected, sizeof(expected));
    assert_int_equal(parse_hello_copy(&back, bytes, sizeof(expected), &consumed, &error), HANDSHAKE_CONSUMED);
    assert_int_equal(consumed, sizeof(expected));
    assert_int_equal(back.version_min, 1);
    assert_int_equal(back.version_max, 3);
    assert_int_equal(back.capabilities, hello.capabilities);
    assert_memory_equal(back.nonce, hello.nonce, sizeof(hello.nonce));
    assert_string_equal(back.name, hello.name);
}

TEST(the_reply_has_its_frozen_layout)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    struct handshake_reply reply = some_reply(), back;
    struct decode_error error;
    size_t consumed, count = handshake_reply_encode(bytes, &reply);
    static const uint8_t head[] = {'F', 'A', 'R', 'L', 1, 0, 196, 0, 5, 0, 0, 0, 0, 0, 0, 0, 0xb0, 0xb1};
    static const uint8_t limits[] = {0,  0, 0, 0, 0,  1, 0, 0, 2,  0, 0, 0, 0,  0, 0, 0, 3,  0, 0, 0, 4, 0,
                                     0,  0, 5, 0, 0,  0, 6, 0, 0,  0, 7, 0, 0,  0, 8, 0, 0,  0, 9, 0, 0, 0,
                                     10, 0, 0, 0, 11, 0, 0, 0, 12, 0, 0, 0, 13, 0, 0, 0, 14, 0, 0, 0};
    static const uint8_t texts[] = {9, 'f', 'a', 'r', 'l', 'i', 'g', 'h', 't', 'd', 14, 'n'};
    assert_int_equal(count, 244 + 1 + 9 + 1 + 14 + 3);
    assert_memory_equal(bytes, head, sizeof(head));
    assert_int_equal(bytes[32], 0xc0);
    assert_memory_equal(bytes + 48, limits, sizeof(limits));
    /* Those that came later, from 15 on: 7 of 8 bytes, 12 of 4, the tracers', and two more. */
    size_t offset = 48 + sizeof(limits);
    for (uint8_t value = 15; value <= 38; value++) {
        size_t bytes_of_it = value < 22 || value == 34 || value == 35 ? 8 : 4;
        uint8_t expected[8] = {value};
        assert_memory_equal(bytes + offset, expected, bytes_of_it);
        offset += bytes_of_it;
    }
    assert_memory_equal(bytes + 244, texts, sizeof(texts));
    assert_int_equal(parse_reply_copy(&back, bytes, count, &consumed, &error), HANDSHAKE_CONSUMED);
    assert_int_equal(consumed, count);
    assert_int_equal(back.version, 1);
    assert_int_equal(back.capabilities, 5);
    assert_memory_equal(back.nonce, reply.nonce, sizeof(reply.nonce));
    assert_memory_equal(back.session_token, reply.session_token, sizeof(reply.session_token));
    struct handshake_limit sent, came;
    for (size_t i = 0; handshake_limit_at(&reply.limits, i, &sent); i++) {
        assert_true(handshake_limit_at(&back.limits, i, &came));
        assert_int_equal(came.value, sent.value);
    }
    assert_string_equal(back.name, reply.name);
    assert_string_equal(back.text, reply.text);
}

TEST(every_prefix_needs_more_and_bytes_that_follow_are_not_consumed)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES + 16];
    struct handshake_hello hello = some_hello(), hello_back;
    struct handshake_reply reply = some_reply(), reply_back;
    struct decode_error error;
    size_t consumed;
    size_t count = handshake_hello_encode(bytes, &hello);
    for (size_t length = 0; length < count; length++) {
        assert_int_equal(parse_hello_copy(&hello_back, bytes, length, &consumed, &error), HANDSHAKE_NEED_MORE);
        assert_int_equal(consumed, 0);
        assert_int_equal(hello_back.version_max, 0);
    }
    memset(bytes + count, 0xff, 16);
    assert_int_equal(parse_hello_copy(&hello_back, bytes, count + 16, &consumed, &error), HANDSHAKE_CONSUMED);
    assert_int_equal(consumed, count);
    count = handshake_reply_encode(bytes, &reply);
    for (size_t length = 0; length < count; length++) {
        assert_int_equal(parse_reply_copy(&reply_back, bytes, length, &consumed, &error), HANDSHAKE_NEED_MORE);
        assert_int_equal(consumed, 0);
        assert_int_equal(reply_back.version, 0);
    }
    memset(bytes + count, 0xff, 16);
    assert_int_equal(parse_reply_copy(&reply_back, bytes, count + 16, &consumed, &error), HANDSHAKE_CONSUMED);
    assert_int_equal(consumed, count);
}

TEST(names_of_the_maximum_length_fit)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    struct handshake_hello hello = some_hello();
    struct handshake_reply reply = some_reply();
    memset(hello.name, 'n', HANDSHAKE_NAME_MAX_BYTES);
    memset(reply.name, 'n', HANDSHAKE_NAME_MAX_BYTES);
    memset(reply.text, 't', HANDSHAKE_TEXT_MAX_BYTES);
    assert_int_equal(handshake_hello_encode(bytes, &hello), 104);
    assert_int_equal(handshake_reply_encode(bytes, &reply), 568);
    hello.name[HANDSHAKE_NAME_MAX_BYTES] = 'n'; /* no NUL any more */
    reply.text[HANDSHAKE_TEXT_MAX_BYTES] = 't';
    assert_int_equal(handshake_hello_encode(bytes, &hello), 0);
    assert_int_equal(handshake_reply_encode(bytes, &reply), 0);
    hello = some_hello();
    hello.name[0] = (char)0xff;
    assert_int_equal(handshake_hello_encode(bytes, &hello), 0);
    hello = some_hello();
    hello.version_min = 4;
    assert_int_equal(handshake_hello_encode(bytes, &hello), 0);
}

/* A hello with one byte changed; must be refused in `field`, at the earliest when `known` bytes have come. */
static void expect_fatal_hello(size_t at, uint8_t value, size_t known, const char *field)
{
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    struct handshake_hello hello = some_hello(), back;
    struct decode_error error;
    size_t consumed, count = handshake_hello_encode(bytes, &hello);
    bytes[at] = value;
    for (size_t length = 0; length <= count; length++) {
        enum handshake_result result = parse_hello_copy(&back, bytes, length, &consumed, &error);
        if (length < known) {
            assert_int_equal(result, HANDSHAKE_NEED_MORE);
            continue;
        }
        assert_int_equal(result, HANDSHAKE_FATAL);
        assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
        assert_string_equal(error.field, field);
        assert_int_equal(consumed, 0);
    }
}

TEST(bytes_that_are_no_handshake_are_refused_as_soon_as_they_come)
{
    expect_fatal_hello(0, 'G', 1, "magic"); /* "GET / HTTP/1.1" */
    expect_fatal_hello(3, 'l', 4, "magic");
    expect_fatal_hello(4, 0, 8, "version_min");
    expect_fatal_hello(4, 4, 8, "version_min");
    expect_fatal_hello(32, 65, 33, "name");
    expect_fatal_hello(33, 0, 42, "name");
    expect_fatal_hello(41, 'x', 42, "name"); /* the first half of a two-byte character */
    expect_fatal_hello(47, 1, 48, "padding");
}

TEST(a_version_without_overlap_is_named)
{
    struct handshake_hello hello = some_hello();
    struct handshake_reply reply = some_reply();
    struct decode_error error = {0};
    assert_int_equal(handshake_choose_version(&hello, &error), HANDSHAKE_VERSION_MAX);
    assert_int_equal(error.code, PROTOCOL_ERROR_NONE);
    hello.version_min = HANDSHAKE_VERSION_MAX + 1;
    hello.version_max = 900;
    assert_int_equal(handshake_choose_version(&hello, &error), 0);
    assert_int_equal(error.code, PROTOCOL_ERROR_VERSION);
    assert_non_null(strstr(error.text, "900"));
    assert_int_equal(handshake_choose_version(&hello, NULL), 0);

    hello = some_hello();
    reply.version = 0;
    memset(&error, 0, sizeof(error));
    assert_false(handshake_reply_accept(&hello, &reply, &error));
    assert_int_equal(error.code, PROTOCOL_ERROR_VERSION);
    assert_string_equal(error.text, "none in common");
    reply.version = 4; /* 1 to 3 were offered */
    memset(&error, 0, sizeof(error));
    assert_false(handshake_reply_accept(&hello, &reply, &error));
    assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
    reply.version = 3;
    assert_true(handshake_reply_accept(&hello, &reply, NULL));
}

TEST(limits_of_an_older_and_of_a_newer_daemon_are_understood)
{
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES], other[HANDSHAKE_REPLY_MAX_BYTES];
    struct handshake_reply reply = some_reply(), back;
    struct decode_error error;
    size_t consumed, count = handshake_reply_encode(bytes, &reply);
    size_t texts = 1 + strlen(reply.name) + 1 + strlen(reply.text);
    for (size_t limits_bytes = 0; limits_bytes <= 256; limits_bytes += 4) {
        size_t kept = limits_bytes < 196 ? limits_bytes : 196;
        memset(other, 0, sizeof(other));
        memcpy(other, bytes, 48 + kept);
        memset(other + 48 + kept, 0xee, limits_bytes - kept);
        other[6] = (uint8_t)limits_bytes;
        other[7] = (uint8_t)(limits_bytes >> 8);
        memcpy(other + 48 + limits_bytes, bytes + 244, texts);
        size_t length = (48 + limits_bytes + texts + 7) & ~(size_t)7;
        assert_int_equal(parse_reply_copy(&back, other, length, &consumed, &error), HANDSHAKE_CONSUMED);
        assert_int_equal(consumed, length);
        assert_string_equal(back.name, reply.name);
        assert_int_equal(back.limits.idle_seconds, limits_bytes >= 64 ? 14 : 0);
        assert_int_equal(back.limits.queued_soft_bytes, limits_bytes >= 72 ? 15 : 0);
        assert_int_equal(back.limits.ldc_layers_max, limits_bytes >= 188 ? 36 : 0);
        assert_int_equal(back.limits.lost_after_ms, limits_bytes >= 192 ? 37 : 0);
        assert_int_equal(back.limits.handshake_ms, limits_bytes >= 20 ? 3 : 0);
        assert_int_equal(back.limits.scene_memory_bytes, limits_bytes >= 16 ? 2 : 0);
    }
    other[6] = 1; /* 257 */
    other[7] = 1;
    assert_int_equal(parse_reply_copy(&back, other, sizeof(other), &consumed, &error), HANDSHAKE_FATAL);
    assert_string_equal(error.field, "limits_bytes");
    bytes[count - 1] = 1;
    assert_int_equal(parse_reply_copy(&back, bytes, count, &consumed, &error), HANDSHAKE_FATAL);
    assert_string_equal(error.field, "padding");
}
