/* SPDX-License-Identifier: MIT */
/* Any payload of any type: what decodes must encode, decode to the same and encode to the same bytes.
 * Input: u16 position in the table (modulo its length), then the payload. */
#include "tests/fuzz/fuzz.h"
#include "tests/unit/protocol/cases.h"

#define ROOM_BYTES (CODEC_BULK_PAYLOAD_MAX_BYTES + 1024u)

static uint8_t first_bytes[ROOM_BYTES], second_bytes[ROOM_BYTES];
static uint8_t scratch_memory[2][SCRATCH_BYTES];

static void check_refusal(const struct message *message, const struct decode_error *error)
{
    static const struct message zero;
    FUZZ_REQUIRE(memcmp(message, &zero, sizeof(zero)) == 0);
    FUZZ_REQUIRE(error->code == PROTOCOL_ERROR_PROTOCOL || error->code == PROTOCOL_ERROR_INVALID);
    FUZZ_REQUIRE(error->text[0] != '\0');
}

static void check_round_trip(const struct message *message, size_t payload_bytes)
{
    const struct message_desc *desc = message_describe(message->type);
    struct scratch scratch;
    struct writer first, second;
    struct message again;
    struct decode_error error;
    writer_init(&first, first_bytes, sizeof(first_bytes));
    if (!message_encode(&first, message)) {
        /* Only this: the fixed part came short, and with the defaults it no longer fits. */
        FUZZ_REQUIRE(first.error.code == PROTOCOL_ERROR_LIMIT);
        FUZZ_REQUIRE(payload_bytes + desc->body()->wire_fixed_bytes + 8 > desc->info.payload_max_bytes);
        return;
    }
    FUZZ_REQUIRE(first.used_bytes == message_payload_bytes(message));
    FUZZ_REQUIRE(first.used_bytes >= desc->info.payload_min_bytes);
    scratch_init(&scratch, scratch_memory[1], sizeof(scratch_memory[1]));
    FUZZ_REQUIRE(message_decode(&again, (uint16_t)message->type, first_bytes, first.used_bytes, &scratch, &error));
    FUZZ_REQUIRE(!message_difference(message, &again));
    writer_init(&second, second_bytes, sizeof(second_bytes));
    FUZZ_REQUIRE(message_encode(&second, &again));
    FUZZ_REQUIRE(first.used_bytes == second.used_bytes);
    FUZZ_REQUIRE(memcmp(first_bytes, second_bytes, first.used_bytes) == 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    struct scratch scratch;
    struct message message;
    struct decode_error error;
    if (size < 2) {
        return 0;
    }
    size_t index = ((size_t)data[0] | (size_t)data[1] << 8) % protocol_message_count;
    /* no more scratch than the header promises to suffice */
    size_t promised = 2 * (size - 2) + 8;
    scratch_init(&scratch, scratch_memory[0], promised < SCRATCH_BYTES ? promised : SCRATCH_BYTES);
    if (!message_decode(&message, protocol_messages[index].info.type, data + 2, size - 2, &scratch, &error)) {
        check_refusal(&message, &error);
        return 0;
    }
    check_round_trip(&message, size - 2);
    return 0;
}
