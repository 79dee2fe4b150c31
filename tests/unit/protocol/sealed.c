/* SPDX-License-Identifier: MIT */
/* Both ends of sealed connections against each other, and against somebody on the way. Run from the top of the
 * tree; FARLIGHT_UPDATE_GOLDEN=1 writes the golden bytes anew (tests/integration/test_sealed.py holds a second
 * opinion on them). */
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <sodium.h>

#include "protocol/sealed/sealed.h"
#include "protocol/sealed/link.h"
#include "tests/harness/test.h"

#define GOLDEN_PATH "tests/unit/protocol/golden/sealed.hex"
#define TRAFFIC_BYTES ((size_t)1 << 20)

static const struct sealed_key full_key = {.bytes = "the key of clients who may edit"};
static const struct sealed_key reader_key = {.bytes = "the key of clients who may look"};
static const struct sealed_key other_key = {.bytes = "a key that the server never saw"};

/* ---- random numbers that the golden bytes are made with ------------------------------------------------ */

static const uint8_t *chosen; /* NULL: the system's */
static size_t chosen_left;

static const char *random_name(void)
{
    return "chosen";
}

static void random_fill(void *const out, const size_t count)
{
    if (!chosen) {
        randombytes_sysrandom_implementation.buf(out, count);
        return;
    }
    assert_true(count <= chosen_left);
    memcpy(out, chosen, count);
    chosen += count;
    chosen_left -= count;
}

static uint32_t random_number(void)
{
    uint32_t number;
    random_fill(&number, sizeof(number));
    return number;
}

static struct randombytes_implementation random_implementation = {
    .implementation_name = random_name, .random = random_number, .buf = random_fill};

/* ---- two ends and the bytes between them --------------------------------------------------------------- */

struct traffic {
    uint8_t bytes[TRAFFIC_BYTES];
    size_t count;
};

struct end {
    struct sealed *sealed;
    enum sealed_result last; /* result of the handshake */
    struct decode_error error;
};

/* Recorded traffic: message 1 and 3, and then records; message 2 and 4, and then records. */
static struct traffic up, down;
static struct end client, server;

static void tell(struct traffic *traffic, const uint8_t *bytes, size_t count)
{
    assert_true(TRAFFIC_BYTES - traffic->count >= count);
    memcpy(traffic->bytes + traffic->count, bytes, count);
    traffic->count += count;
}

/* Hands one message, at most `count` bytes, to an end; what it answers goes to `answers`. Out of an allocation of
 * exactly that size. */
static size_t hear(struct end *end, const uint8_t *bytes, size_t count, struct traffic *answers)
{
    uint8_t out[SEALED_MESSAGE_MAX_BYTES];
    size_t consumed = 0, out_bytes = 0;
    uint8_t *copy = malloc(count > 0 ? count : 1);
    assert_non_null(copy);
    memcpy(copy, bytes, count);
    end->last = sealed_handshake(end->sealed, copy, count, &consumed, out, &out_bytes, &end->error);
    free(copy);
    assert_true((end->last == SEALED_CONSUMED) == (consumed > 0));
    if (out_bytes > 0)
        tell(answers, out, out_bytes);
    return consumed;
}

static void end_both(void)
{
    sealed_destroy(client.sealed);
    sealed_destroy(server.sealed);
    client.sealed = server.sealed = NULL;
}

static int end(void **state)
{
    (void)state;
    end_both();
    return 0;
}

static void begin(const struct sealed_key *client_key, const struct sealed_key *server_keys, size_t key_count)
{
    uint8_t out[SEALED_MESSAGE_MAX_BYTES];
    end_both();
    up.count = down.count = 0;
    client = (struct end){.sealed = sealed_client(client_key)};
    server = (struct end){.sealed = sealed_server(server_keys, key_count)};
    assert_non_null(client.sealed);
    assert_non_null(server.sealed);
    tell(&up, out, sealed_begin(client.sealed, out));
}

/* The four messages; what is heard is what was told but for one bit of message 1 to 4 (0: none). */
static void shake_hands(unsigned message, size_t bit)
{
    size_t from_client = 0, from_server = 0;
    for (unsigned i = 1; i <= 4; i++) {
        struct end *hearing = i % 2 == 1 ? &server : &client;
        struct traffic *told = i % 2 == 1 ? &up : &down;
        size_t *from = i % 2 == 1 ? &from_client : &from_server;
        uint8_t *bytes = told->bytes + *from;
        if (told->count == *from)
            return;
        if (i == message)
            bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        *from += hear(hearing, bytes, told->count - *from, i % 2 == 1 ? &down : &up);
        if (hearing->last != SEALED_CONSUMED)
            return;
    }
}

static void open_both(void)
{
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    assert_true(sealed_is_open(client.sealed) && sealed_is_open(server.sealed));
    up.count = down.count = 0;
}

static void say(struct end *end, struct traffic *traffic, const void *plain, size_t count)
{
    assert_true(TRAFFIC_BYTES - traffic->count >= count + SEALED_RECORD_EXTRA_BYTES);
    const size_t sealed_bytes = sealed_seal(end->sealed, traffic->bytes + traffic->count, plain, count);
    assert_int_equal(sealed_bytes, count + SEALED_RECORD_EXTRA_BYTES);
    traffic->count += sealed_bytes;
}

static uint8_t opened[SEALED_PLAIN_MAX_BYTES];
static size_t opened_bytes;

/* Opens the record at *offset, which moves on. */
static enum sealed_result unseal(struct end *end, const uint8_t *bytes, size_t count, size_t *offset)
{
    size_t consumed = 0;
    enum sealed_result result = sealed_open(end->sealed, bytes + *offset, count - *offset, &consumed, opened,
                                            sizeof(opened), &opened_bytes, &end->error);
    assert_true((result == SEALED_CONSUMED) == (consumed > 0));
    assert_true(result == SEALED_CONSUMED || opened_bytes == 0);
    *offset += consumed;
    return result;
}

/* ---- what is meant to be ------------------------------------------------------------------------------- */

TEST(both_ends_open_and_understand_each_other)
{
    static uint8_t much[SEALED_PLAIN_MAX_BYTES];
    open_both();
    for (size_t i = 0; i < sizeof(much); i++)
        much[i] = (uint8_t)(i * 31 + i / 256);
    say(&client, &up, "a", 1);
    say(&client, &up, much, sizeof(much));
    say(&server, &down, "from the server", 15);
    say(&client, &up, NULL, 0);
    assert_true(sealed_has_sealed_last(client.sealed) && !sealed_has_sealed_last(server.sealed));
    size_t offset = 0;
    assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_CONSUMED);
    assert_int_equal(opened_bytes, 1);
    assert_int_equal(opened[0], 'a');
    assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_CONSUMED);
    assert_int_equal(opened_bytes, sizeof(much));
    assert_memory_equal(opened, much, sizeof(much));
    assert_false(sealed_has_opened_last(server.sealed));
    assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_CONSUMED);
    assert_true(sealed_has_opened_last(server.sealed));
    assert_int_equal(offset, up.count);
    offset = 0;
    assert_int_equal(unseal(&client, down.bytes, down.count, &offset), SEALED_CONSUMED);
    assert_memory_equal(opened, "from the server", 15);
}

TEST(the_server_knows_which_key_the_client_has)
{
    const struct sealed_key keys[2] = {full_key, reader_key};
    for (size_t i = 0; i < 2; i++) {
        begin(&keys[i], keys, 2);
        shake_hands(0, 0);
        assert_true(sealed_is_open(client.sealed) && sealed_is_open(server.sealed));
        assert_int_equal(sealed_key_index(server.sealed), i);
    }
    assert_int_not_equal(sealed_key_number(&keys[0]), sealed_key_number(&keys[1]));
    assert_null(sealed_server(keys, 0));
}

TEST(the_same_is_heard_byte_by_byte)
{
    static struct traffic whole_up, whole_down;
    begin(&full_key, &full_key, 1);
    size_t used[2] = {0, 0};
    for (unsigned i = 1; i <= 4; i++) {
        struct end *hearing = i % 2 == 1 ? &server : &client;
        struct traffic *told = i % 2 == 1 ? &up : &down;
        for (size_t count = 0; told->count > used[i % 2] + count; count++) {
            assert_int_equal(hear(hearing, told->bytes + used[i % 2], count, &whole_up), 0);
            assert_int_equal(hearing->last, SEALED_NEED_MORE);
        }
        used[i % 2] +=
            hear(hearing, told->bytes + used[i % 2], told->count - used[i % 2], i % 2 == 1 ? &down : &up);
        assert_int_equal(hearing->last, SEALED_CONSUMED);
    }
    assert_int_equal(whole_up.count, 0);
    assert_true(sealed_is_open(client.sealed) && sealed_is_open(server.sealed));
    whole_down.count = 0;
    say(&server, &whole_down, "seven!!", 7);
    for (size_t count = 0; count < whole_down.count; count++) {
        size_t offset = 0;
        uint8_t *copy = malloc(count > 0 ? count : 1);
        assert_non_null(copy);
        memcpy(copy, whole_down.bytes, count);
        assert_false(sealed_has_record(copy, count));
        assert_int_equal(unseal(&client, copy, count, &offset), SEALED_NEED_MORE);
        free(copy);
    }
    size_t offset = 0, consumed = 0;
    assert_true(sealed_has_record(whole_down.bytes, whole_down.count));
    assert_int_equal(sealed_open(client.sealed, whole_down.bytes, whole_down.count, &consumed, opened, 6,
                                 &opened_bytes, &client.error),
                     SEALED_NEED_ROOM);
    assert_int_equal(unseal(&client, whole_down.bytes, whole_down.count, &offset), SEALED_CONSUMED);
    assert_memory_equal(opened, "seven!!", 7);
}

/* ---- golden bytes -------------------------------------------------------------------------------------- */

/* Chosen random numbers, .. */
static struct {
    uint8_t client_secret[32], client_nonce[32], server_secret[32], server_nonce[32];
    uint8_t client_header[24], server_header[24];
} given;

static void fill_given(void)
{
    uint8_t *bytes = (uint8_t *)&given;
    for (size_t i = 0; i < sizeof(given); i++)
        bytes[i] = (uint8_t)(i * 7 + 1);
}

/* .. and what comes out, a name and its bytes for each line of the file. */
static void print_hex(FILE *file, const char *name, const void *bytes, size_t count)
{
    fprintf(file, "%s ", name);
    for (size_t i = 0; i < count; i++)
        fprintf(file, "%02x", ((const uint8_t *)bytes)[i]);
    fputc('\n', file);
}

static void print_session(FILE *file)
{
    static uint8_t long_plain[300];
    fill_given();
    chosen = (const uint8_t *)&given;
    chosen_left = sizeof(given);
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    assert_int_equal(chosen_left, 0);
    chosen = NULL;
    for (size_t i = 0; i < sizeof(long_plain); i++)
        long_plain[i] = (uint8_t)i;
    print_hex(file, "key", full_key.bytes, SEALED_KEY_BYTES);
    print_hex(file, "client_secret", given.client_secret, 32);
    print_hex(file, "client_nonce", given.client_nonce, 32);
    print_hex(file, "server_secret", given.server_secret, 32);
    print_hex(file, "server_nonce", given.server_nonce, 32);
    print_hex(file, "client_header", given.client_header, 24);
    print_hex(file, "server_header", given.server_header, 24);
    print_hex(file, "message_1", up.bytes, 72);
    print_hex(file, "message_2", down.bytes, 72);
    print_hex(file, "message_3", up.bytes + 72, 64);
    print_hex(file, "message_4", down.bytes + 72, 64);
    up.count = down.count = 0;
    say(&client, &up, "hello", 5);
    print_hex(file, "client_plain_1", "hello", 5);
    print_hex(file, "client_record_1", up.bytes, up.count);
    up.count = 0;
    say(&client, &up, long_plain, sizeof(long_plain));
    print_hex(file, "client_plain_2", long_plain, sizeof(long_plain));
    print_hex(file, "client_record_2", up.bytes, up.count);
    up.count = 0;
    say(&client, &up, NULL, 0);
    print_hex(file, "client_last_record", up.bytes, up.count);
    say(&server, &down, "welcome", 7);
    print_hex(file, "server_plain_1", "welcome", 7);
    print_hex(file, "server_record_1", down.bytes, down.count);
    down.count = 0;
    say(&server, &down, NULL, 0);
    print_hex(file, "server_last_record", down.bytes, down.count);
}

TEST(the_bytes_are_the_stored_ones)
{
    static char stored[8192];
    char *made = NULL;
    size_t made_bytes;
    FILE *file = fopen(GOLDEN_PATH, "r");
    if (!file)
        fail_msg("cannot read %s (run from the top of the tree)", GOLDEN_PATH);
    stored[fread(stored, 1, sizeof(stored) - 1, file)] = '\0';
    fclose(file);
    FILE *stream = open_memstream(&made, &made_bytes);
    assert_non_null(stream);
    print_session(stream);
    fclose(stream);
    assert_string_equal(made, stored);
    free(made);
}

static int update_golden(void)
{
    FILE *file = fopen(GOLDEN_PATH, "w");
    if (!file) {
        perror(GOLDEN_PATH);
        return 1;
    }
    print_session(file);
    return fclose(file) == 0 ? 0 : 1;
}

static int prepare(void **state)
{
    (void)state;
    randombytes_set_implementation(&random_implementation);
    if (sodium_init() < 0)
        return -1;
    return getenv("FARLIGHT_UPDATE_GOLDEN") ? update_golden() : 0;
}
ALL_TESTS(prepare, NULL)
EACH_TEST(NULL, end)

/* ---- who has no business there ------------------------------------------------------------------------- */

TEST(a_wrong_key_is_refused_without_a_reason)
{
    const struct sealed_key keys[2] = {full_key, reader_key};
    begin(&other_key, keys, 2);
    shake_hands(0, 0);
    assert_int_equal(server.last, SEALED_REFUSED);
    assert_int_equal(sealed_status(server.sealed), SEALED_WRONG_KEY);
    assert_int_equal(down.count, 72);
    assert_false(sealed_is_open(server.sealed));
    assert_false(sealed_may_seal(server.sealed));
    /* Nor can the right proof be tried after it. */
    hear(&server, up.bytes + 72, 64, &down);
    assert_int_equal(server.last, SEALED_FATAL);
}

TEST(a_server_without_the_key_is_found_out)
{
    /* The server lets everybody in, but cannot prove anything: the bytes of its proof come from another key. */
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    struct sealed *impostor = sealed_server(&other_key, 1);
    struct sealed *victim = sealed_client(&full_key);
    uint8_t out[SEALED_MESSAGE_MAX_BYTES], message[SEALED_MESSAGE_MAX_BYTES], proof[64];
    size_t consumed, out_bytes;
    memcpy(proof, down.bytes + 72, sizeof(proof));
    sealed_begin(victim, out);
    assert_int_equal(sealed_handshake(impostor, out, 72, &consumed, message, &out_bytes, NULL), SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(victim, message, 72, &consumed, out, &out_bytes, NULL), SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(victim, proof, 64, &consumed, out, &out_bytes, NULL), SEALED_FATAL);
    assert_false(sealed_is_open(victim));
    sealed_destroy(impostor);
    sealed_destroy(victim);
}

TEST(refusals_are_reported_with_their_reason)
{
    static const enum sealed_status at_once[] = {SEALED_NO_KEY, SEALED_OTHER_VERSION};
    uint8_t refusal[SEALED_REFUSAL_BYTES];
    for (size_t i = 0; i < 2; i++) {
        begin(&full_key, &full_key, 1);
        sealed_refuse(refusal, at_once[i]);
        hear(&client, refusal, sizeof(refusal), &up);
        assert_int_equal(client.last, SEALED_REFUSED);
        assert_int_equal(sealed_status(client.sealed), at_once[i]);
        assert_string_equal(client.error.text, sealed_status_text(at_once[i]));
    }
    begin(&full_key, &other_key, 1);
    shake_hands(0, 0);
    sealed_refuse(refusal, sealed_status(server.sealed));
    hear(&client, refusal, sizeof(refusal), &up);
    assert_int_equal(client.last, SEALED_REFUSED);
    assert_int_equal(sealed_status(client.sealed), SEALED_WRONG_KEY);
    begin(&full_key, &full_key, 1);
    up.bytes[5] = 2;
    hear(&server, up.bytes, up.count, &down);
    assert_int_equal(server.last, SEALED_REFUSED);
    assert_int_equal(sealed_status(server.sealed), SEALED_OTHER_VERSION);
}

/* ---- changed on the way -------------------------------------------------------------------------------- */

TEST(no_bit_of_the_handshake_can_be_changed)
{
    static const size_t sizes[5] = {0, 72, 72, 64, 64};
    for (unsigned message = 1; message <= 4; message++) {
        for (size_t bit = 0; bit < 8 * sizes[message]; bit++) {
            begin(&full_key, &full_key, 1);
            shake_hands(message, bit);
            /* Only the server's own last word can be changed once it has let the client in. */
            if (sealed_is_open(client.sealed) || (message < 4 && sealed_is_open(server.sealed)))
                fail_msg("bit %zu of message %u does not matter", bit, message);
        }
    }
}

TEST(no_bit_of_a_record_can_be_changed)
{
    static struct traffic changed;
    const size_t record_bytes = 40 + SEALED_RECORD_EXTRA_BYTES;
    uint8_t plain[40] = "forty bytes";
    for (size_t bit = 0; bit < 8 * record_bytes; bit++) {
        open_both();
        say(&client, &up, plain, sizeof(plain));
        /* Enough behind it that a length which has grown is there. */
        memset(up.bytes + up.count, 0x55, SEALED_RECORD_MAX_BYTES);
        changed.count = 0;
        tell(&changed, up.bytes, up.count + SEALED_RECORD_MAX_BYTES);
        changed.bytes[bit / 8] ^= (uint8_t)(1u << bit % 8);
        size_t offset = 0;
        if (unseal(&server, changed.bytes, changed.count, &offset) != SEALED_FATAL)
            fail_msg("bit %zu does not matter", bit);
        /* Not even the record as it was is taken after that. */
        assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_FATAL);
    }
}

TEST(a_weak_public_key_is_refused)
{
    /* Points of small order on the curve, with which the secret would be known: 0, 1 and p - 1. */
    uint8_t weak[3][32] = {{0}, {1}, {0}};
    memset(weak[2], 0xff, 32);
    weak[2][0] = 0xec;
    weak[2][31] = 0x7f;
    for (size_t i = 0; i < 3; i++) {
        begin(&full_key, &full_key, 1);
        memcpy(up.bytes + 8, weak[i], 32);
        hear(&server, up.bytes, up.count, &down);
        assert_int_equal(server.last, SEALED_FATAL);
        assert_int_equal(down.count, 0);
        begin(&full_key, &full_key, 1);
        hear(&server, up.bytes, up.count, &down);
        memcpy(down.bytes + 8, weak[i], 32);
        up.count = 0;
        hear(&client, down.bytes, down.count, &up);
        assert_int_equal(client.last, SEALED_FATAL);
        assert_int_equal(up.count, 0);
    }
}

TEST(lengths_tags_and_what_comes_too_late_are_refused)
{
    static const uint32_t lengths[] = {0, 16, SEALED_PLAIN_MAX_BYTES + 18, UINT32_MAX};
    for (size_t i = 0; i < sizeof(lengths) / sizeof(lengths[0]); i++) {
        size_t offset = 0;
        const uint8_t head[4] = {(uint8_t)lengths[i], (uint8_t)(lengths[i] >> 8), (uint8_t)(lengths[i] >> 16),
                                 (uint8_t)(lengths[i] >> 24)};
        open_both();
        assert_true(sealed_has_record(head, sizeof(head)));
        assert_int_equal(unseal(&server, head, sizeof(head), &offset), SEALED_FATAL);
    }
    open_both();
    size_t offset = 0;
    say(&client, &up, NULL, 0);
    say(&client, &up, "more", 4);
    assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_CONSUMED);
    assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_FATAL);
}

/* ---- said before, or to somebody else ------------------------------------------------------------------ */

TEST(a_recorded_session_cannot_be_played_again)
{
    static struct traffic said, answered;
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    say(&client, &up, "render", 6);
    say(&server, &down, "pixels", 6);
    said = up;
    answered = down;
    /* Replay to another connection of the server: the bytes are refused, whatever it answers. */
    begin(&full_key, &full_key, 1);
    assert_int_equal(hear(&server, said.bytes, 72, &down), 72);
    hear(&server, said.bytes + 72, 64, &down);
    assert_int_equal(server.last, SEALED_REFUSED);
    /* Replay to another client. */
    assert_int_equal(hear(&client, answered.bytes, 72, &up), 72);
    hear(&client, answered.bytes + 72, 64, &up);
    assert_int_equal(client.last, SEALED_FATAL);
}

TEST(a_record_cannot_be_repeated_left_out_or_moved)
{
    for (int change = 0; change < 3; change++) {
        size_t starts[4] = {0}, offset = 0;
        open_both();
        for (int i = 0; i < 3; i++) {
            say(&client, &up, "record", 6);
            starts[i + 1] = up.count;
        }
        if (change < 2) { /* 1 goes, or 2 in its place */
            assert_int_equal(unseal(&server, up.bytes, starts[1], &offset), SEALED_CONSUMED);
            offset = change == 0 ? starts[0] : starts[2];
        } else {
            offset = starts[1];
        }
        assert_int_equal(unseal(&server, up.bytes, up.count, &offset), SEALED_FATAL);
    }
}

TEST(a_message_cannot_be_reflected_to_its_sender)
{
    uint8_t first[72];
    begin(&full_key, &full_key, 1);
    memcpy(first, up.bytes, sizeof(first));
    /* Message as it is, and as the type that the client waits for. */
    hear(&client, first, sizeof(first), &up);
    assert_int_equal(client.last, SEALED_FATAL);
    begin(&full_key, &full_key, 1);
    memcpy(first, up.bytes, sizeof(first));
    first[4] = 2;
    first[5] = SEALED_WELCOME;
    hear(&client, first, sizeof(first), &up);
    assert_int_equal(client.last, SEALED_FATAL);
    /* Message 2 to the server in place of message 3; and 3 to the client in place of 4. */
    begin(&full_key, &full_key, 1);
    hear(&server, up.bytes, 72, &down);
    hear(&client, down.bytes, 72, &up);
    hear(&server, down.bytes, 72, &down);
    assert_int_equal(server.last, SEALED_FATAL);
    uint8_t proof[64];
    memcpy(proof, up.bytes + 72, sizeof(proof));
    proof[4] = 4;
    hear(&client, proof, sizeof(proof), &up);
    assert_int_equal(client.last, SEALED_FATAL);
    /* Message 4 after it was said, and records of either. */
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    hear(&server, down.bytes + 72, 64, &down);
    assert_int_equal(server.last, SEALED_FATAL);
    open_both();
    size_t offset = 0;
    say(&client, &up, "mine", 4);
    say(&server, &down, "yours", 5);
    assert_int_equal(unseal(&client, up.bytes, up.count, &offset), SEALED_FATAL);
    assert_int_equal(unseal(&server, down.bytes, down.count, &offset), SEALED_FATAL);
}

/* Two connections at once, with messages of one given to the other: a server in the middle without the key. */
TEST(connections_cannot_be_mixed)
{
    struct sealed *one = sealed_client(&full_key), *two = sealed_client(&full_key);
    struct sealed *served_one = sealed_server(&full_key, 1), *served_two = sealed_server(&full_key, 1);
    uint8_t hello_one[72], hello_two[72], answer_one[72], answer_two[72], proof_one[72], proof_two[72];
    size_t consumed, bytes;
    sealed_begin(one, hello_one);
    sealed_begin(two, hello_two);
    assert_int_equal(sealed_handshake(served_one, hello_one, 72, &consumed, answer_one, &bytes, NULL),
                     SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(served_two, hello_two, 72, &consumed, answer_two, &bytes, NULL),
                     SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(one, answer_two, 72, &consumed, proof_one, &bytes, NULL), SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(two, answer_one, 72, &consumed, proof_two, &bytes, NULL), SEALED_CONSUMED);
    assert_int_equal(sealed_handshake(served_two, proof_one, 64, &consumed, answer_two, &bytes, NULL),
                     SEALED_REFUSED);
    assert_int_equal(sealed_handshake(served_one, proof_two, 64, &consumed, answer_one, &bytes, NULL),
                     SEALED_REFUSED);
    sealed_destroy(one);
    sealed_destroy(two);
    sealed_destroy(served_one);
    sealed_destroy(served_two);
}

/* ---- cut ----------------------------------------------------------------------------------------------- */

/* The server's side of a session with three records and the last one. */
static size_t record_session(const uint8_t *client_randomness, struct traffic *told)
{
    chosen = client_randomness;
    chosen_left = sizeof(given);
    begin(&full_key, &full_key, 1);
    shake_hands(0, 0);
    chosen = NULL;
    say(&server, &down, "abc", 3);
    say(&server, &down, "defgh", 5);
    say(&server, &down, "i", 1);
    say(&server, &down, NULL, 0);
    *told = down;
    return down.count;
}

TEST(a_session_that_is_cut_anywhere_is_seen_to_be)
{
    static struct traffic told;
    fill_given();
    const size_t whole = record_session((const uint8_t *)&given, &told);
    for (size_t count = 0; count <= whole; count++) {
        uint8_t out[SEALED_MESSAGE_MAX_BYTES];
        char text[16] = "";
        size_t offset = 0, text_bytes = 0;
        enum sealed_result result = SEALED_CONSUMED;
        /* Repeated client: its random numbers are those of the record. */
        chosen = (const uint8_t *)&given;
        chosen_left = sizeof(given);
        up.count = 0;
        sealed_destroy(client.sealed);
        client = (struct end){.sealed = sealed_client(&full_key)};
        sealed_begin(client.sealed, out);
        chosen = given.client_header;
        while (result == SEALED_CONSUMED && !sealed_is_open(client.sealed)) {
            offset += hear(&client, told.bytes + offset, count - offset, &up);
            result = client.last;
        }
        chosen = NULL;
        while (result == SEALED_CONSUMED && !sealed_has_opened_last(client.sealed)) {
            result = unseal(&client, told.bytes, count, &offset);
            memcpy(text + text_bytes, opened, opened_bytes);
            text_bytes += opened_bytes;
        }
        assert_int_equal(result, count == whole ? SEALED_CONSUMED : SEALED_NEED_MORE);
        assert_int_equal(sealed_has_opened_last(client.sealed), count == whole);
        assert_memory_equal(text, "abcdefghi", text_bytes);
        assert_true(count < whole || text_bytes == 9);
    }
}

/* ---- links --------------------------------------------------------------------------------------------- */

/* Moves at most `maximum` bytes; what the sender learns of its plain text. */
static size_t carry(struct sealed_link *from, struct sealed_link *to, size_t maximum)
{
    size_t waiting_bytes, room_bytes;
    const uint8_t *waiting = sealed_link_waiting(from, &waiting_bytes);
    uint8_t *room = sealed_link_space(to, &room_bytes);
    size_t bytes = waiting_bytes < room_bytes ? waiting_bytes : room_bytes;
    bytes = bytes < maximum ? bytes : maximum;
    if (bytes == 0)
        return 0;
    memcpy(room, waiting, bytes);
    sealed_link_came(to, bytes);
    return sealed_link_sent(from, bytes);
}

TEST(a_link_carries_everything_however_little_goes_at_once)
{
    static const size_t steps[] = {1, 7, 100, 65536, 1 << 20};
    static uint8_t plain[300000], back[300000 + SEALED_PLAIN_MAX_BYTES];
    randombytes_buf(plain, sizeof(plain));
    for (size_t i = 0; i < sizeof(steps) / sizeof(steps[0]); i++) {
        struct sealed_link *one = sealed_link_client(&full_key), *two = sealed_link_server(&full_key, 1);
        struct decode_error error;
        size_t taken = 0, told = 0, got = 0;
        bool is_last = false;
        assert_non_null(one);
        assert_non_null(two);
        while (!sealed_has_opened_last(two->sealed)) {
            taken += sealed_link_seal(one, plain + taken, sizeof(plain) - taken);
            is_last = is_last || (taken == sizeof(plain) && sealed_link_seal_last(one));
            told += carry(one, two, steps[i]);
            carry(two, one, steps[i]);
            assert_true(told <= taken);
            enum sealed_result result = sealed_link_handshake(one, &error);
            assert_true(result == SEALED_CONSUMED || result == SEALED_NEED_MORE);
            result = sealed_link_handshake(two, &error);
            assert_true(result == SEALED_CONSUMED || result == SEALED_NEED_MORE);
            while (result == SEALED_CONSUMED && !sealed_has_opened_last(two->sealed)) {
                size_t bytes = 0;
                assert_true(sizeof(back) - got >= SEALED_PLAIN_MAX_BYTES);
                result = sealed_link_open(two, back + got, SEALED_PLAIN_MAX_BYTES, &bytes, &error);
                got += bytes;
            }
            assert_true(result == SEALED_CONSUMED || result == SEALED_NEED_MORE);
        }
        assert_int_equal(told, sizeof(plain));
        assert_int_equal(got, sizeof(plain));
        assert_memory_equal(back, plain, sizeof(plain));
        assert_int_equal(sealed_link_room(one), 0); /* after the last one */
        assert_true(sealed_link_seal_last(one));
        sealed_link_destroy(one);
        sealed_link_destroy(two);
    }
}

TEST(a_link_takes_little_memory_until_the_peer_is_known)
{
    struct sealed_link *link = sealed_link_server(&full_key, 1);
    struct decode_error error = {0};
    size_t bytes;
    assert_non_null(link);
    *sealed_link_space(link, &bytes) = 'S';
    assert_true(bytes <= 1024);
    sealed_link_came(link, 1);
    assert_int_equal(sealed_link_handshake(link, &error), SEALED_NEED_MORE);
    assert_int_equal(sealed_link_room(link), 0);
    assert_false(sealed_link_seal_last(link));
    uint8_t *space = sealed_link_space(link, &bytes);
    memset(space, 'S', bytes);
    sealed_link_came(link, bytes);
    assert_int_equal(sealed_link_handshake(link, &error), SEALED_FATAL);
    assert_int_equal(error.code, PROTOCOL_ERROR_PROTOCOL);
    sealed_link_destroy(link);
}

TEST(a_refusal_goes_over_the_link)
{
    struct sealed_link *one = sealed_link_client(&other_key), *two = sealed_link_server(&full_key, 1);
    struct decode_error error;
    assert_true(one && two);
    carry(one, two, 1000);
    assert_int_equal(sealed_link_handshake(two, &error), SEALED_NEED_MORE);
    carry(two, one, 1000);
    assert_int_equal(sealed_link_handshake(one, &error), SEALED_NEED_MORE);
    assert_int_equal(sealed_link_seal(one, (const uint8_t *)"hello", 5), 5);
    carry(one, two, 1000);
    assert_int_equal(sealed_link_handshake(two, &error), SEALED_REFUSED);
    size_t bytes;
    assert_null(sealed_link_waiting(two, &bytes));
    sealed_link_refuse(two);
    carry(two, one, 1000);
    assert_int_equal(sealed_link_handshake(one, &error), SEALED_REFUSED);
    assert_int_equal(sealed_status(one->sealed), SEALED_WRONG_KEY);
    sealed_link_destroy(one);
    sealed_link_destroy(two);
}
