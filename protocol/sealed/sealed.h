/* SPDX-License-Identifier: MIT */
/* Sealed connections: whoever is on the way can neither read nor change what is said, nor say anything, nor repeat
 * what was said before, nor leave off the end unnoticed; and both ends know that the other one has the same key,
 * 32 random bytes. Sans-I/O, for both ends; the caller owns the buffers and the socket. Cryptography is
 * libsodium's.
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
 * Then records, u32 sealed_bytes and so many bytes: crypto_secretstream_xchacha20poly1305 with K("client stream")
 * or K("server stream"), the 4 bytes of the length as additional data. A record has 1 to 65,536 bytes of plain
 * text, 17 fewer than sealed; the last one of a direction has none and the tag FINAL, every other the tag MESSAGE.
 * The client may send records right behind message 3. What the records carry is what an open connection carries,
 * from the handshake on; they are cut anywhere. */
#ifndef FARLIGHT_PROTOCOL_SEALED_SEALED_H
#define FARLIGHT_PROTOCOL_SEALED_SEALED_H

#include "protocol/decode_error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SEALED_KEY_BYTES 32u
#define SEALED_KEYS_MAX 2u /* that a server may know */
#define SEALED_VERSION 1u
#define SEALED_MAGIC "SEAL" /* its first byte differs from that of an open handshake */
#define SEALED_MESSAGE_MAX_BYTES 72u
#define SEALED_REFUSAL_BYTES 8u
#define SEALED_PLAIN_MAX_BYTES 65536u
#define SEALED_RECORD_EXTRA_BYTES 21u /* what a record has beside its plain text */
#define SEALED_RECORD_MAX_BYTES (SEALED_PLAIN_MAX_BYTES + SEALED_RECORD_EXTRA_BYTES)

struct sealed_key {
    uint8_t bytes[SEALED_KEY_BYTES];
};

/* In messages 2 and 4. */
enum sealed_status {
    SEALED_WELCOME = 0,
    SEALED_WRONG_KEY = 1,     /* message 4: the proof fits no key of the server's */
    SEALED_NO_KEY = 3,        /* message 2: the server has no key at all */
    SEALED_OTHER_VERSION = 4, /* message 2: it does not speak this version */
};
const char *sealed_status_text(enum sealed_status status);

enum sealed_result {
    SEALED_CONSUMED,  /* *consumed_bytes bytes were a message, or a record */
    SEALED_NEED_MORE, /* so far it is the beginning of one */
    SEALED_NEED_ROOM, /* the record's plain text is larger than what there is for it */
    SEALED_REFUSED,   /* sealed_status() says why: the client was, or the server has to (sealed_refuse()) */
    SEALED_FATAL,     /* *error says why: code PROTOCOL. Nothing more can come on this connection */
};

struct sealed; /* one end of one connection; secrets are wiped when it goes */

/* NULL: no memory, or no random numbers. */
struct sealed *sealed_client(const struct sealed_key *key);
/* Knows 1 to SEALED_KEYS_MAX keys, which are copied. */
struct sealed *sealed_server(const struct sealed_key *keys, size_t key_count);
void sealed_destroy(struct sealed *sealed); /* accepts NULL */

/* The client's first message; the number of its bytes. */
size_t sealed_begin(struct sealed *sealed, uint8_t out[SEALED_MESSAGE_MAX_BYTES]);
/* Takes the next message of the handshake. Consumed: *out_bytes bytes of `out`, which may be 0, are to be sent.
 * Anything but NEED_MORE and CONSUMED is final. */
enum sealed_result sealed_handshake(struct sealed *sealed, const uint8_t *bytes, size_t count,
                                    size_t *consumed_bytes, uint8_t out[SEALED_MESSAGE_MAX_BYTES],
                                    size_t *out_bytes, struct decode_error *error);
/* Server: what it answers where it lets nobody in; after a wrong key it does well to wait before. */
void sealed_refuse(uint8_t out[SEALED_REFUSAL_BYTES], enum sealed_status status);

/* Both have proved that they have the key, which each did with its last message. */
bool sealed_is_open(const struct sealed *sealed);
/* Records may be sent; a client may do so before the server's proof, which is the first thing it reads. */
bool sealed_may_seal(const struct sealed *sealed);
/* Server, once open: which of its keys the client has. */
size_t sealed_key_index(const struct sealed *sealed);
enum sealed_status sealed_status(const struct sealed *sealed);

/* Makes a record of 1 to SEALED_PLAIN_MAX_BYTES bytes, or with none the last one. `out` has room for that and
 * SEALED_RECORD_EXTRA_BYTES, apart from `plain`; the number of its bytes. */
size_t sealed_seal(struct sealed *sealed, uint8_t *out, const uint8_t *plain, size_t plain_bytes);
bool sealed_has_sealed_last(const struct sealed *sealed);

/* Another process of the same build may go on with an open end that has not sealed or opened its last record: its
 * streams as sealed_saved_bytes() bytes, secret as they are. The keys of the connection's ends are not in them. */
size_t sealed_saved_bytes(void);
void sealed_save(const struct sealed *sealed, uint8_t *out);
/* NULL: no memory, or no random numbers. */
struct sealed *sealed_restore(const uint8_t *saved);

/* Whether sealed_open() would ask for no more bytes. */
bool sealed_has_record(const uint8_t *bytes, size_t count);
/* Opens one record into `plain`, which lies apart from `bytes`. */
enum sealed_result sealed_open(struct sealed *sealed, const uint8_t *bytes, size_t count, size_t *consumed_bytes,
                               uint8_t *plain, size_t plain_capacity, size_t *plain_bytes,
                               struct decode_error *error);
/* The last record has come: nothing was left off. */
bool sealed_has_opened_last(const struct sealed *sealed);

/* A number that stands for the key, the same for each connection with it, and says nothing about it. */
uint64_t sealed_key_number(const struct sealed_key *key);

#ifdef __cplusplus
}
#endif
#endif
