/* SPDX-License-Identifier: MIT */
/* Keys and proofs of a sealed connection. */
#include "protocol/sealed/state.h"

#include "protocol/reader.h"

/* Labels that keep the derived keys of a connection apart; filled up with zeros. */
static const char label_client_proof[LABEL_BYTES] = "farlight sealed client proof";
static const char label_server_proof[LABEL_BYTES] = "farlight sealed server proof";
static const char label_client_stream[LABEL_BYTES] = "farlight sealed client stream";
static const char label_server_stream[LABEL_BYTES] = "farlight sealed server stream";

static void derive(const struct sealed *sealed, const struct sealed_key *key, const char label[LABEL_BYTES],
                   uint8_t out[SECRET_BYTES])
{
    crypto_generichash_state hash;
    crypto_generichash_init(&hash, key->bytes, sizeof(key->bytes), SECRET_BYTES);
    crypto_generichash_update(&hash, (const uint8_t *)label, LABEL_BYTES);
    crypto_generichash_update(&hash, sealed->up, sizeof(sealed->up));
    crypto_generichash_update(&hash, sealed->down, sizeof(sealed->down));
    crypto_generichash_update(&hash, sealed->hello[0], sizeof(sealed->hello[0]));
    crypto_generichash_update(&hash, sealed->hello[1], sizeof(sealed->hello[1]));
    crypto_generichash_final(&hash, out, SECRET_BYTES);
    sodium_memzero(&hash, sizeof(hash));
}

/* Proof 3 covers `first` alone. */
static void prove(const struct sealed *sealed, const struct sealed_key *key, const char label[LABEL_BYTES],
                  const uint8_t *first, size_t first_bytes, const uint8_t *second, size_t second_bytes,
                  uint8_t out[PROOF_BYTES])
{
    uint8_t secret[SECRET_BYTES];
    crypto_generichash_state hash;
    derive(sealed, key, label, secret);
    crypto_generichash_init(&hash, secret, sizeof(secret), PROOF_BYTES);
    crypto_generichash_update(&hash, first, first_bytes);
    crypto_generichash_update(&hash, second, second_bytes);
    crypto_generichash_final(&hash, out, PROOF_BYTES);
    sodium_memzero(&hash, sizeof(hash));
    sodium_memzero(secret, sizeof(secret));
}

void sealed_client_proof(const struct sealed *sealed, const struct sealed_key *key, uint8_t out[PROOF_BYTES])
{
    prove(sealed, key, label_client_proof, sealed->client_proving, UNPROVED_BYTES, NULL, 0, out);
}

void sealed_server_proof(const struct sealed *sealed, const uint8_t unproved[UNPROVED_BYTES],
                         uint8_t out[PROOF_BYTES])
{
    prove(sealed, &sealed->keys[sealed->key_index], label_server_proof, sealed->client_proving, PROVING_BYTES,
          unproved, UNPROVED_BYTES, out);
}

void sealed_begin_sending(struct sealed *sealed, uint8_t header[STREAM_HEADER_BYTES])
{
    uint8_t secret[SECRET_BYTES];
    derive(sealed, &sealed->keys[sealed->key_index], sealed->is_client ? label_client_stream : label_server_stream,
           secret);
    crypto_secretstream_xchacha20poly1305_init_push(&sealed->sending, header, secret);
    sodium_memzero(secret, sizeof(secret));
}

void sealed_begin_receiving(struct sealed *sealed, const uint8_t header[STREAM_HEADER_BYTES])
{
    uint8_t secret[SECRET_BYTES];
    derive(sealed, &sealed->keys[sealed->key_index], sealed->is_client ? label_server_stream : label_client_stream,
           secret);
    crypto_secretstream_xchacha20poly1305_init_pull(&sealed->receiving, header, secret);
    sodium_memzero(secret, sizeof(secret));
}

void sealed_forget_exchange(struct sealed *sealed)
{
    sodium_memzero(sealed->secret_key, sizeof(sealed->secret_key));
    sodium_memzero(sealed->up, sizeof(sealed->up));
    sodium_memzero(sealed->down, sizeof(sealed->down));
    sodium_memzero(sealed->keys, sizeof(sealed->keys));
}

uint64_t sealed_key_number(const struct sealed_key *key)
{
    static const char label[LABEL_BYTES] = "farlight sealed key number";
    uint8_t hash[crypto_generichash_BYTES_MIN];
    crypto_generichash(hash, sizeof(hash), (const uint8_t *)label, LABEL_BYTES, key->bytes, sizeof(key->bytes));
    struct reader reader;
    reader_init(&reader, hash, sizeof(hash));
    return reader_u64(&reader);
}
