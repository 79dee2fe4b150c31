/* SPDX-License-Identifier: MIT */
/* Any first bytes, as a client's and as a daemon's: what parses must encode to the bytes that it came from. */
#include <string.h>

#include "protocol/handshake.h"
#include "tests/fuzz/fuzz.h"

static void check_hello(const uint8_t *data, size_t size)
{
    struct handshake_hello hello;
    struct decode_error error;
    size_t consumed;
    uint8_t bytes[HANDSHAKE_HELLO_MAX_BYTES];
    enum handshake_result result = handshake_hello_parse(&hello, data, size, &consumed, &error);
    FUZZ_REQUIRE((result == HANDSHAKE_FATAL) == (error.code != PROTOCOL_ERROR_NONE));
    FUZZ_REQUIRE(result != HANDSHAKE_NEED_MORE || size < HANDSHAKE_HELLO_MAX_BYTES);
    if (result != HANDSHAKE_CONSUMED) {
        FUZZ_REQUIRE(consumed == 0);
        return;
    }
    FUZZ_REQUIRE(consumed <= size && consumed <= sizeof(bytes) && consumed % 8 == 0);
    FUZZ_REQUIRE(handshake_hello_encode(bytes, &hello) == consumed);
    FUZZ_REQUIRE(memcmp(bytes, data, consumed) == 0);
    for (size_t length = 0; length < consumed; length++) {
        size_t none;
        FUZZ_REQUIRE(handshake_hello_parse(&hello, data, length, &none, NULL) == HANDSHAKE_NEED_MORE);
    }
    handshake_choose_version(&hello, NULL);
}

static void check_reply(const uint8_t *data, size_t size)
{
    struct handshake_reply reply;
    struct decode_error error;
    size_t consumed;
    uint8_t bytes[HANDSHAKE_REPLY_MAX_BYTES];
    enum handshake_result result = handshake_reply_parse(&reply, data, size, &consumed, &error);
    FUZZ_REQUIRE((result == HANDSHAKE_FATAL) == (error.code != PROTOCOL_ERROR_NONE));
    FUZZ_REQUIRE(result != HANDSHAKE_NEED_MORE || size < HANDSHAKE_REPLY_MAX_BYTES);
    if (result != HANDSHAKE_CONSUMED) {
        FUZZ_REQUIRE(consumed == 0);
        return;
    }
    FUZZ_REQUIRE(consumed <= size && consumed <= sizeof(bytes) && consumed % 8 == 0);
    size_t encoded = handshake_reply_encode(bytes, &reply);
    FUZZ_REQUIRE(encoded > 0);
    if (data[6] + 256u * data[7] == HANDSHAKE_LIMITS_BYTES) { /* nothing was skipped or missing */
        FUZZ_REQUIRE(encoded == consumed && memcmp(bytes, data, consumed) == 0);
    }
    struct handshake_hello hello = {.version_min = HANDSHAKE_VERSION_MIN, .version_max = HANDSHAKE_VERSION_MAX};
    handshake_reply_accept(&hello, &reply, NULL);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    check_hello(data, size);
    check_reply(data, size);
    return 0;
}
