/* SPDX-License-Identifier: MIT */
/* Any bytes to either end of a sealed connection, cut anywhere. Its random numbers are those with which the seeds
 * were made, so that the fuzzer starts from whole sessions. The first byte says which end hears the rest, and in
 * what pieces. */
#include <string.h>

#include "tests/fuzz/fuzz.h"
#include "tests/fuzz/sealed_random.h"

static uint8_t plain[SEALED_PLAIN_MAX_BYTES];

/* Everything that can be opened now; false: nothing more will be heard. */
static bool hear(struct sealed_link *link, size_t room)
{
    struct decode_error error;
    enum sealed_result result = sealed_link_handshake(link, &error);
    while (result == SEALED_CONSUMED && !sealed_has_opened_last(link->sealed)) {
        size_t bytes = 0;
        bool has_record = sealed_link_has_record(link);
        result = sealed_link_open(link, plain, room, &bytes, &error);
        FUZZ_REQUIRE(has_record == (result != SEALED_NEED_MORE));
        FUZZ_REQUIRE(bytes <= room && (bytes == 0 || result == SEALED_CONSUMED));
        FUZZ_REQUIRE((bytes == 0 && result == SEALED_CONSUMED) == sealed_has_opened_last(link->sealed));
    }
    if (result == SEALED_REFUSED || result == SEALED_FATAL) {
        FUZZ_REQUIRE(error.code != PROTOCOL_ERROR_NONE && error.text[0] != '\0');
        FUZZ_REQUIRE(!sealed_is_open(link->sealed));
    }
    return result == SEALED_NEED_MORE;
}

static void speak(struct sealed_link *link)
{
    size_t bytes;
    static const uint8_t word[] = "word";
    size_t sealed_bytes = sealed_link_seal(link, word, sizeof(word));
    FUZZ_REQUIRE(sealed_bytes == 0 || sealed_may_seal(link->sealed));
    const uint8_t *waiting = sealed_link_waiting(link, &bytes);
    FUZZ_REQUIRE((waiting != NULL) == (bytes > 0));
    FUZZ_REQUIRE(sealed_link_sent(link, bytes) == sealed_bytes);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static bool begun;
    if (!begun) {
        randombytes_set_implementation(&sealed_random);
        begun = true;
    }
    if (size == 0) {
        return 0;
    }
    const size_t piece = 1 + ((data[0] & 0x7eu) >> 1) * 37u;
    sealed_random_begin();
    sealed_random_end = data[0] & 1;
    struct sealed_link *link =
        sealed_random_end == 0 ? sealed_link_client(&sealed_fuzz_key) : sealed_link_server(&sealed_fuzz_key, 1);
    FUZZ_REQUIRE(link);
    bool open = true;
    for (size_t used = 1; open && used < size;) {
        size_t room;
        uint8_t *space = sealed_link_space(link, &room);
        FUZZ_REQUIRE(room > 0);
        size_t bytes = piece < room ? piece : room;
        bytes = bytes < size - used ? bytes : size - used;
        memcpy(space, data + used, bytes);
        sealed_link_came(link, bytes);
        used += bytes;
        open = hear(link, (data[0] & 0x80) != 0 ? sizeof(plain) : 4) || sealed_link_has_record(link);
        if ((data[0] & 0x80) == 0 && sealed_link_has_record(link)) {
            open = hear(link, sizeof(plain)); /* after there was no room */
        }
        speak(link);
    }
    sealed_link_destroy(link);
    return 0;
}
