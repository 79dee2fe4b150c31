/* SPDX-License-Identifier: MIT */
/* The handshake of a sealed connection. */
#include "protocol/sealed/sealed.h"

#include <string.h>

#include "protocol/sealed/secret.h"
#include "protocol/sealed/state.h"
#include "protocol/writer.h"

const char *sealed_status_text(enum sealed_status status)
{
    switch (status) {
    case SEALED_WELCOME:
        return "welcome";
    case SEALED_WRONG_KEY:
        return "the daemon has another key";
    case SEALED_NO_KEY:
        return "the daemon has no key";
    case SEALED_OTHER_VERSION:
        return "the daemon speaks another version of sealed connections";
    }
    return "the daemon refuses for a reason that is not known here";
}

/* ---- life ---- */

static struct sealed *create(const struct sealed_key *keys, size_t key_count, bool is_client)
{
    /* sodium_init() also chooses the fastest code for this processor. */
    if (sodium_init() < 0 || key_count < 1 || key_count > SEALED_KEYS_MAX) {
        return NULL;
    }
    struct sealed *sealed = secret_create(sizeof(*sealed));
    if (sealed) {
        sealed->is_client = is_client;
        sealed->key_count = key_count;
        memcpy(sealed->keys, keys, key_count * sizeof(*keys));
    }
    return sealed;
}

struct sealed *sealed_client(const struct sealed_key *key)
{
    return create(key, 1, true);
}

struct sealed *sealed_server(const struct sealed_key *keys, size_t key_count)
{
    return create(keys, key_count, false);
}

void sealed_destroy(struct sealed *sealed)
{
    secret_destroy(sealed);
}

bool sealed_is_open(const struct sealed *sealed)
{
    return sealed->stage == STAGE_OPEN;
}

bool sealed_may_seal(const struct sealed *sealed)
{
    return sealed->may_seal;
}

size_t sealed_key_index(const struct sealed *sealed)
{
    return sealed->key_index;
}

enum sealed_status sealed_status(const struct sealed *sealed)
{
    return sealed->status;
}

bool sealed_has_sealed_last(const struct sealed *sealed)
{
    return sealed->sealed_last;
}

bool sealed_has_opened_last(const struct sealed *sealed)
{
    return sealed->opened_last;
}

/* ---- on the way to another process ---- */

struct saved {
    crypto_secretstream_xchacha20poly1305_state sending, receiving;
    bool is_client;
};

size_t sealed_saved_bytes(void)
{
    return sizeof(struct saved);
}

void sealed_save(const struct sealed *sealed, uint8_t *out)
{
    struct saved saved;
    memset(&saved, 0, sizeof(saved));
    saved.sending = sealed->sending;
    saved.receiving = sealed->receiving;
    saved.is_client = sealed->is_client;
    memcpy(out, &saved, sizeof(saved));
    sodium_memzero(&saved, sizeof(saved));
}

struct sealed *sealed_restore(const uint8_t *bytes)
{
    struct saved saved;
    struct sealed *sealed = sodium_init() < 0 ? NULL : secret_create(sizeof(*sealed));
    if (!sealed) {
        return NULL;
    }
    memcpy(&saved, bytes, sizeof(saved));
    sealed->sending = saved.sending;
    sealed->receiving = saved.receiving;
    sealed->is_client = saved.is_client;
    sealed->stage = STAGE_OPEN;
    sealed->may_seal = true;
    sodium_memzero(&saved, sizeof(saved));
    return sealed;
}

/* ---- messages ---- */

static void put_head(uint8_t *out, unsigned number, unsigned third)
{
    struct writer writer;
    writer_init(&writer, out, HEAD_BYTES);
    writer_put_bytes(&writer, SEALED_MAGIC, 4);
    writer_put_u8(&writer, (uint8_t)number);
    writer_put_u8(&writer, (uint8_t)third);
    writer_put_zeros(&writer, 2);
}

void sealed_refuse(uint8_t out[SEALED_REFUSAL_BYTES], enum sealed_status status)
{
    put_head(out, status == SEALED_WRONG_KEY ? 4 : 2, (unsigned)status);
}

/* Makes message 1 or 2. */
static size_t make_hello(struct sealed *sealed, unsigned number, unsigned third, uint8_t *out)
{
    uint8_t *hello = sealed->hello[number - 1];
    put_head(hello, number, third);
    crypto_kx_keypair(hello + HEAD_BYTES, sealed->secret_key);
    randombytes_buf(hello + HEAD_BYTES + PUBLIC_KEY_BYTES, NONCE_BYTES);
    memcpy(out, hello, HELLO_BYTES);
    return HELLO_BYTES;
}

size_t sealed_begin(struct sealed *sealed, uint8_t out[SEALED_MESSAGE_MAX_BYTES])
{
    return make_hello(sealed, 1, SEALED_VERSION, out);
}

enum sealed_result sealed_fatal(struct sealed *sealed, struct decode_error *error, const char *field,
                                const char *text)
{
    sealed->stage = STAGE_BROKEN;
    decode_error_set(error, PROTOCOL_ERROR_PROTOCOL, field, "%s", text);
    return SEALED_FATAL;
}

/* Checks a head byte by byte, so that a fault is reported early. *third: version or status. */
static enum sealed_result get_head(struct sealed *sealed, const uint8_t *bytes, size_t count, unsigned number,
                                   unsigned *third, struct decode_error *error)
{
    uint8_t wanted[HEAD_BYTES];
    put_head(wanted, number, 0);
    for (size_t i = 0; i < HEAD_BYTES && i < count; i++) {
        if (i != 5 && bytes[i] != wanted[i]) {
            return sealed_fatal(sealed, error, "head",
                                i < 4 ? "these bytes begin no sealed connection"
                                      : "this is not the expected message");
        }
    }
    *third = count > 5 ? bytes[5] : 0;
    return count >= HEAD_BYTES ? SEALED_CONSUMED : SEALED_NEED_MORE;
}

static enum sealed_result refused(struct sealed *sealed, unsigned status, struct decode_error *error)
{
    if (status > SEALED_OTHER_VERSION) {
        return sealed_fatal(sealed, error, "status", "is none that there is");
    }
    sealed->stage = STAGE_BROKEN;
    sealed->status = (enum sealed_status)status;
    decode_error_set(error, PROTOCOL_ERROR_DENIED, "", "%s", sealed_status_text(sealed->status));
    return SEALED_REFUSED;
}

/* False: the peer's public key yields no secret, or is our own. */
static bool exchange(struct sealed *sealed)
{
    const uint8_t *ours = sealed->hello[sealed->is_client ? 0 : 1] + HEAD_BYTES;
    const uint8_t *theirs = sealed->hello[sealed->is_client ? 1 : 0] + HEAD_BYTES;
    if (memcmp(ours, theirs, PUBLIC_KEY_BYTES) == 0) {
        return false;
    }
    if (sealed->is_client) {
        return crypto_kx_client_session_keys(sealed->down, sealed->up, ours, sealed->secret_key, theirs) == 0;
    }
    return crypto_kx_server_session_keys(sealed->up, sealed->down, ours, sealed->secret_key, theirs) == 0;
}

/* Server: reads message 1, makes message 2. */
static enum sealed_result take_client_hello(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                            uint8_t *out, size_t *out_bytes, struct decode_error *error)
{
    unsigned version = 0;
    enum sealed_result result = get_head(sealed, bytes, count, 1, &version, error);
    if (result != SEALED_CONSUMED) {
        return result;
    }
    if (version != SEALED_VERSION) {
        return refused(sealed, SEALED_OTHER_VERSION, error);
    }
    if (count < HELLO_BYTES) {
        return SEALED_NEED_MORE;
    }
    memcpy(sealed->hello[0], bytes, HELLO_BYTES);
    const size_t made_bytes = make_hello(sealed, 2, SEALED_WELCOME, out);
    if (!exchange(sealed)) {
        return sealed_fatal(sealed, error, "public_key", "there is no secret with it");
    }
    *out_bytes = made_bytes;
    sealed->stage = STAGE_PROOF;
    return SEALED_CONSUMED;
}

/* Client: reads message 2, makes message 3. */
static enum sealed_result take_server_hello(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                            uint8_t *out, size_t *out_bytes, struct decode_error *error)
{
    unsigned status = 0;
    enum sealed_result result = get_head(sealed, bytes, count, 2, &status, error);
    if (result != SEALED_CONSUMED) {
        return result;
    }
    if (status != SEALED_WELCOME) {
        return refused(sealed, status, error);
    }
    if (count < HELLO_BYTES) {
        return SEALED_NEED_MORE;
    }
    memcpy(sealed->hello[1], bytes, HELLO_BYTES);
    if (!exchange(sealed)) {
        return sealed_fatal(sealed, error, "public_key", "there is no secret with it");
    }
    uint8_t *message = sealed->client_proving;
    put_head(message, 3, 0);
    sealed_begin_sending(sealed, message + HEAD_BYTES);
    sealed_client_proof(sealed, &sealed->keys[0], message + UNPROVED_BYTES);
    memcpy(out, message, PROVING_BYTES);
    *out_bytes = PROVING_BYTES;
    sealed->may_seal = true;
    sealed->stage = STAGE_PROOF;
    return SEALED_CONSUMED;
}

/* Index of the client's key; key_count: none matches. All are tried, so that the time reveals nothing. */
static size_t find_key(const struct sealed *sealed)
{
    size_t found = sealed->key_count;
    for (size_t i = 0; i < sealed->key_count; i++) {
        uint8_t proof[PROOF_BYTES];
        sealed_client_proof(sealed, &sealed->keys[i], proof);
        if (sodium_memcmp(proof, sealed->client_proving + UNPROVED_BYTES, PROOF_BYTES) == 0) {
            found = i;
        }
    }
    return found;
}

/* Server: reads message 3, makes message 4. */
static enum sealed_result take_client_proof(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                            uint8_t *out, size_t *out_bytes, struct decode_error *error)
{
    unsigned zero = 0;
    enum sealed_result result = get_head(sealed, bytes, count, 3, &zero, error);
    if (result == SEALED_CONSUMED && zero != 0) {
        return sealed_fatal(sealed, error, "head", "this is not the expected message");
    }
    if (result != SEALED_CONSUMED) {
        return result;
    }
    if (count < PROVING_BYTES) {
        return SEALED_NEED_MORE;
    }
    memcpy(sealed->client_proving, bytes, PROVING_BYTES);
    size_t found = find_key(sealed);
    if (found == sealed->key_count) {
        return refused(sealed, SEALED_WRONG_KEY, error);
    }
    sealed->key_index = found;
    put_head(out, 4, SEALED_WELCOME);
    sealed_begin_sending(sealed, out + HEAD_BYTES);
    sealed_begin_receiving(sealed, bytes + HEAD_BYTES);
    sealed_server_proof(sealed, out, out + UNPROVED_BYTES);
    *out_bytes = PROVING_BYTES;
    sealed->may_seal = true;
    sealed->stage = STAGE_OPEN;
    sealed_forget_exchange(sealed);
    return SEALED_CONSUMED;
}

/* Client: reads message 4. */
static enum sealed_result take_server_proof(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                            struct decode_error *error)
{
    unsigned status = 0;
    enum sealed_result result = get_head(sealed, bytes, count, 4, &status, error);
    if (result != SEALED_CONSUMED) {
        return result;
    }
    if (status != SEALED_WELCOME) {
        return refused(sealed, status, error);
    }
    if (count < PROVING_BYTES) {
        return SEALED_NEED_MORE;
    }
    uint8_t proof[PROOF_BYTES];
    sealed_server_proof(sealed, bytes, proof);
    if (sodium_memcmp(proof, bytes + UNPROVED_BYTES, PROOF_BYTES) != 0) {
        return sealed_fatal(sealed, error, "proof", "the other side does not have the key");
    }
    sealed_begin_receiving(sealed, bytes + HEAD_BYTES);
    sealed->stage = STAGE_OPEN;
    sealed_forget_exchange(sealed);
    return SEALED_CONSUMED;
}

static enum sealed_result take(struct sealed *sealed, const uint8_t *bytes, size_t count, uint8_t *out,
                               size_t *out_bytes, struct decode_error *error)
{
    if (sealed->stage == STAGE_HELLO && sealed->is_client) {
        return take_server_hello(sealed, bytes, count, out, out_bytes, error);
    }
    if (sealed->stage == STAGE_HELLO) {
        return take_client_hello(sealed, bytes, count, out, out_bytes, error);
    }
    if (sealed->stage == STAGE_PROOF && sealed->is_client) {
        return take_server_proof(sealed, bytes, count, error);
    }
    if (sealed->stage == STAGE_PROOF) {
        return take_client_proof(sealed, bytes, count, out, out_bytes, error);
    }
    return sealed_fatal(sealed, error, "head", "no further message of the handshake is expected");
}

enum sealed_result sealed_handshake(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                    size_t *consumed_bytes, uint8_t out[SEALED_MESSAGE_MAX_BYTES],
                                    size_t *out_bytes, struct decode_error *error)
{
    if (error) {
        memset(error, 0, sizeof(*error));
    }
    const size_t size = sealed->stage == STAGE_HELLO ? HELLO_BYTES : PROVING_BYTES;
    *consumed_bytes = *out_bytes = 0;
    enum sealed_result result = take(sealed, bytes, count, out, out_bytes, error);
    *consumed_bytes = result == SEALED_CONSUMED ? size : 0;
    return result;
}
