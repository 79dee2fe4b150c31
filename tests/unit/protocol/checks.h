/* SPDX-License-Identifier: MIT */
/* Encode and decode with everything checked that holds for every message. One buffer each, so one message at a
 * time. */
#ifndef FARLIGHT_TESTS_PROTOCOL_CHECKS_H
#define FARLIGHT_TESTS_PROTOCOL_CHECKS_H

#include <setjmp.h>
#include <stdarg.h>
#include <stdlib.h>

#include <cmocka.h>

#include "tests/unit/protocol/cases.h"

static struct case_maker maker;
static struct plain_bytes plain;
static uint8_t encoded[CODEC_BULK_PAYLOAD_MAX_BYTES];
static uint8_t scratch_memory[SCRATCH_BYTES];

/* Decodes out of an allocation of exactly that size, so that a read beyond it is seen by the sanitizer. */
static inline bool decode_copy(struct message *out, uint16_t type, const uint8_t *payload, size_t count,
                               struct decode_error *error)
{
    static uint8_t *copy; /* bulk data of the result points into it until the next call */
    struct scratch scratch;
    free(copy);
    copy = malloc(count > 0 ? count : 1);
    assert_non_null(copy);
    memcpy(copy, payload, count);
    scratch_init(&scratch, scratch_memory, sizeof(scratch_memory));
    bool ok = message_decode(out, type, copy, count, &scratch, error);
    if (!ok) {
        struct message zero;
        memset(&zero, 0, sizeof(zero));
        assert_memory_equal(out, &zero, sizeof(zero));
        assert_int_not_equal(error->code, PROTOCOL_ERROR_NONE);
        assert_true(error->text[0] != '\0');
        free(copy);
        copy = NULL;
    }
    return ok;
}

/* Encodes with message_encode() and compares with the plain encoder. */
static inline size_t encode_both(const struct message *message)
{
    struct writer writer;
    writer_init(&writer, encoded, sizeof(encoded));
    if (!message_encode(&writer, message))
        fail_msg("%s: %s: %s", message_type_text(message->type), writer.error.field, writer.error.text);
    plain_encode(&plain, message);
    assert_int_equal(writer.used_bytes, plain.count);
    assert_memory_equal(encoded, plain.data, plain.count);
    assert_int_equal(message_payload_bytes(message), plain.count);
    return writer.used_bytes;
}

static inline void check_round_trip(const struct message *message)
{
    struct message back;
    struct decode_error error;
    size_t count = encode_both(message);
    if (!decode_copy(&back, (uint16_t)message->type, encoded, count, &error))
        fail_msg("%s: %s: %s", message_type_text(message->type), error.field, error.text);
    const char *difference = message_difference(message, &back);
    if (difference)
        fail_msg("%s.%s came back otherwise", message_type_text(message->type), difference);
}

#endif
