/* SPDX-License-Identifier: MIT */
/* The inside of one end of a sealed connection, for its files. */
#ifndef FARLIGHT_PROTOCOL_SEALED_STATE_H
#define FARLIGHT_PROTOCOL_SEALED_STATE_H

#include <sodium.h>

#include "protocol/sealed/sealed.h"

#define HEAD_BYTES 8u
#define LABEL_BYTES 32u
#define NONCE_BYTES 32u
#define PROOF_BYTES 32u
#define PUBLIC_KEY_BYTES 32u
#define SECRET_BYTES 32u
#define STREAM_HEADER_BYTES 24u
#define LENGTH_BYTES 4u
#define TAG_BYTES 17u
#define HELLO_BYTES (HEAD_BYTES + PUBLIC_KEY_BYTES + NONCE_BYTES)      /* messages 1 and 2 */
#define PROVING_BYTES (HEAD_BYTES + STREAM_HEADER_BYTES + PROOF_BYTES) /* messages 3 and 4 */
#define UNPROVED_BYTES (HEAD_BYTES + STREAM_HEADER_BYTES) /* part before the proof in messages 3 and 4 */

_Static_assert(HELLO_BYTES == SEALED_MESSAGE_MAX_BYTES && PROVING_BYTES <= SEALED_MESSAGE_MAX_BYTES, "sizes");
_Static_assert(HEAD_BYTES == SEALED_REFUSAL_BYTES, "sizes");
_Static_assert(LENGTH_BYTES + TAG_BYTES == SEALED_RECORD_EXTRA_BYTES, "sizes");
_Static_assert(PUBLIC_KEY_BYTES == crypto_kx_PUBLICKEYBYTES && SECRET_BYTES == crypto_kx_SESSIONKEYBYTES &&
                   SECRET_BYTES == crypto_kx_SECRETKEYBYTES,
               "sizes");
_Static_assert(STREAM_HEADER_BYTES == crypto_secretstream_xchacha20poly1305_HEADERBYTES &&
                   SECRET_BYTES == crypto_secretstream_xchacha20poly1305_KEYBYTES &&
                   TAG_BYTES == crypto_secretstream_xchacha20poly1305_ABYTES,
               "sizes");

enum stage {
    STAGE_HELLO,  /* waits for message 1 or 2 */
    STAGE_PROOF,  /* waits for message 3 or 4 */
    STAGE_OPEN,   /* records */
    STAGE_BROKEN, /* every further byte is rejected */
};

struct sealed {
    bool is_client;
    enum stage stage;
    struct sealed_key keys[SEALED_KEYS_MAX];
    size_t key_count, key_index;
    enum sealed_status status;
    uint8_t secret_key[SECRET_BYTES]; /* key pair of this connection */
    uint8_t up[SECRET_BYTES], down[SECRET_BYTES];
    uint8_t hello[2][HELLO_BYTES]; /* messages 1 and 2 */
    uint8_t client_proving[PROVING_BYTES];
    bool may_seal, sealed_last, opened_last;
    crypto_secretstream_xchacha20poly1305_state sending, receiving;
};

/* Computes the client's proof from its message 3, as far as it is filled in, with one of the keys. */
void sealed_client_proof(const struct sealed *sealed, const struct sealed_key *key, uint8_t out[PROOF_BYTES]);
/* Computes the server's proof from message 3 and the part of message 4 before the proof. */
void sealed_server_proof(const struct sealed *sealed, const uint8_t unproved[UNPROVED_BYTES],
                         uint8_t out[PROOF_BYTES]);
/* Start the streams of this end; the other end needs the header for reading. */
void sealed_begin_sending(struct sealed *sealed, uint8_t header[STREAM_HEADER_BYTES]);
void sealed_begin_receiving(struct sealed *sealed, const uint8_t header[STREAM_HEADER_BYTES]);
/* Wipes everything from which the secrets of the exchange could be derived again. */
void sealed_forget_exchange(struct sealed *sealed);

/* Ends the connection with an error. */
enum sealed_result sealed_fatal(struct sealed *sealed, struct decode_error *error, const char *field,
                                const char *text);

#endif
