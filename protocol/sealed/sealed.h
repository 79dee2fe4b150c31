/* SPDX-License-Identifier: MIT */
/* Sealed connections: an attacker on the network can neither read nor change messages, nor inject or replay any,
 * nor cut off the end unnoticed, and each end knows that the other one has the same key, 32 random bytes.
 * Sans-I/O, for both ends; the caller owns the buffers and the socket. Cryptography is libsodium's.
 *
 * Four messages, little-endian; the client is first:
 *   1  client   "SEAL", u8 1, u8 version, u16 0, X25519 public key (32 bytes), nonce (32 bytes)
 *   2  server   "SEAL", u8 2, u8 status,  u16 0, X25519 public key (32 bytes), nonce (32 bytes)
 *   3  client   "SEAL", u8 3, u8 0,       u16 0, header of its stream (24 bytes), proof (32 bytes)
 *   4  server   "SEAL", u8 4, u8 status,  u16 0, header of its stream (24 bytes), proof (32 bytes)
 * Public keys and nonces are made for this connection alone. A status other than 0 ends its message after the 8
 * bytes of its head, and the connection: enum sealed_status.
 *
 * Keys: crypto_kx turns the exchange into two secrets of 32 bytes, `up` for client to server and `down` for the
 * other way. Then, for each of the four labels of protocol/sealed/keys.c (32 bytes each),
 *   K(label) = BLAKE2b-256, keyed with the key of the connection, of label, up, down, message 1, message 2.
 * Proof 3 is BLAKE2b-256, keyed with K("client proof"), of the 32 bytes of message 3 before it; proof 4, keyed
 * with K("server proof"), of message 3 and the 32 bytes of message 4 before it.
 *
 * Then records, u32 sealed_bytes and as many bytes: crypto_secretstream_xchacha20poly1305 with K("client stream")
 * or K("server stream"), the 4 bytes of the length as additional data. A record has 1 to 65,536 bytes of plain
 * text, 17 fewer than sealed; the last one of a direction has none and the tag FINAL, every other the tag MESSAGE.
 * The client may send records right after message 3. Together the records carry the bytes of an open connection,
 * from the handshake on; a record may begin and end anywhere in them. */
#ifndef FARLIGHT_PROTOCOL_SEALED_SEALED_H
#define FARLIGHT_PROTOCOL_SEALED_SEALED_H

#include "protocol/decode_error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SEALED_KEY_BYTES 32u
#define SEALED_KEYS_MAX 2u /* number of keys that a server may know */
#define SEALED_VERSION 1u
#define SEALED_MAGIC "SEAL" /* differs in the first byte from an open handshake */
#define SEALED_MESSAGE_MAX_BYTES 72u
#define SEALED_REFUSAL_BYTES 8u
#define SEALED_PLAIN_MAX_BYTES 65536u
#define SEALED_RECORD_EXTRA_BYTES 21u /* record size minus plain text */
#define SEALED_RECORD_MAX_BYTES (SEALED_PLAIN_MAX_BYTES + SEALED_RECORD_EXTRA_BYTES)

struct sealed_key {
    uint8_t bytes[SEALED_KEY_BYTES];
};

/* Status in messages 2 and 4. */
enum sealed_status {
    SEALED_WELCOME = 0,
    SEALED_WRONG_KEY = 1,     /* message 4: the proof matches no key of the server */
    SEALED_NO_KEY = 3,        /* message 2: the server has no key */
    SEALED_OTHER_VERSION = 4, /* message 2: the server does not speak this version */
};
const char *sealed_status_text(enum sealed_status status);

enum sealed_result {
    SEALED_CONSUMED,  /* a message or a record was *consumed_bytes bytes */
    SEALED_NEED_MORE, /* the bytes are the beginning of one */
    SEALED_NEED_ROOM, /* the record's plain text exceeds plain_capacity */
    /* sealed_status() has the reason: the client was refused, or the server must refuse (sealed_refuse()) */
    SEALED_REFUSED,
    SEALED_FATAL, /* *error has the reason: code PROTOCOL. The connection is unusable */
};

struct sealed; /* an end of a connection; its secrets are wiped when it is destroyed */

/* NULL: out of memory, or no random numbers. */
struct sealed *sealed_client(const struct sealed_key *key);
/* Copies 1 to SEALED_KEYS_MAX keys. */
struct sealed *sealed_server(const struct sealed_key *keys, size_t key_count);
void sealed_destroy(struct sealed *sealed); /* accepts NULL */

/* Makes the client's first message; returns its size. */
size_t sealed_begin(struct sealed *sealed, uint8_t out[SEALED_MESSAGE_MAX_BYTES]);
/* Processes the next message of the handshake. Consumed: *out_bytes bytes of `out`, possibly 0, must be sent.
 * Every result except NEED_MORE and CONSUMED is final. */
enum sealed_result sealed_handshake(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                    size_t *consumed_bytes, uint8_t out[SEALED_MESSAGE_MAX_BYTES],
                                    size_t *out_bytes, struct decode_error *error);
/* Makes a server's refusal; after a wrong key the server should wait before sending it. */
void sealed_refuse(uint8_t out[SEALED_REFUSAL_BYTES], enum sealed_status status);

/* True once both ends have proved that they have the key, each with its last message. */
bool sealed_is_open(const struct sealed *sealed);
/* True once records may be sent: for a client before the server's proof, which is the first thing that it
 * reads. */
bool sealed_may_seal(const struct sealed *sealed);
/* Server, once open: index of the client's key. */
size_t sealed_key_index(const struct sealed *sealed);
enum sealed_status sealed_status(const struct sealed *sealed);

/* Makes a record of 1 to SEALED_PLAIN_MAX_BYTES bytes, or of none, which is the last record. `out` does not
 * overlap `plain` and has SEALED_RECORD_EXTRA_BYTES more. Returns the record's size. */
size_t sealed_seal(struct sealed *sealed, uint8_t *out, const uint8_t *plain, size_t plain_bytes);
bool sealed_has_sealed_last(const struct sealed *sealed);

/* Save an open end that has neither sealed nor opened its last record, for another process of the same build:
 * the streams in sealed_saved_bytes() bytes, which are as secret as the streams. Keys are not included. */
size_t sealed_saved_bytes(void);
void sealed_save(const struct sealed *sealed, uint8_t *out);
/* NULL: out of memory, or no random numbers. */
struct sealed *sealed_restore(const uint8_t *saved);

/* True if sealed_open() would not return SEALED_NEED_MORE. */
bool sealed_has_record(const uint8_t *bytes, size_t count);
/* Opens one record into `plain`, which must not overlap `bytes`. */
enum sealed_result sealed_open(struct sealed *sealed, const uint8_t *bytes, size_t count, size_t *consumed_bytes,
                               uint8_t *plain, size_t plain_capacity, size_t *plain_bytes,
                               struct decode_error *error);
/* True once the last record was opened: nothing is missing. */
bool sealed_has_opened_last(const struct sealed *sealed);

/* A number that identifies the key, the same on every connection, and reveals nothing about it. */
uint64_t sealed_key_number(const struct sealed_key *key);

#ifdef __cplusplus
}
#endif
#endif
