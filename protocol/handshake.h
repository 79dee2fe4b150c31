/* SPDX-License-Identifier: MIT */
/* The handshake: the first bytes of a connection. All versions share this layout. Sans-I/O. Little-endian.
 *
 * Client, at most 256 bytes:
 *    0  "FARL"
 *    4  u16 version_min, u16 version_max    1 <= min <= max
 *    8  u64 capabilities                    bits that the client understands
 *   16  nonce, 16 bytes
 *   32  u8 name_bytes (at most 64), name in UTF-8
 *       zeros up to a multiple of 8
 * Reply, at most 640 bytes:
 *    0  "FARL"
 *    4  u16 version                         0: refused; `text` has the reason
 *    6  u16 limits_bytes                    size of the limits; at most 256
 *    8  u64 capabilities                    bits that both sides understand
 *   16  nonce, 16 bytes
 *   32  session token, 16 bytes
 *   48  limits, in the order of limits.def, packed; missing ones are 0, further ones are skipped
 *       u8 name_bytes (at most 64), name; u8 text_bytes, text (empty unless version is 0)
 *       zeros up to a multiple of 8 */
#ifndef FARLIGHT_PROTOCOL_HANDSHAKE_H
#define FARLIGHT_PROTOCOL_HANDSHAKE_H

#include "protocol/decode_error.h"

#ifdef __cplusplus
extern "C" {
#endif

#define HANDSHAKE_VERSION_MIN 2u
#define HANDSHAKE_VERSION_MAX 2u
#define HANDSHAKE_HELLO_MAX_BYTES 256u
#define HANDSHAKE_REPLY_MAX_BYTES 640u
#define HANDSHAKE_NAME_MAX_BYTES 64u
#define HANDSHAKE_TEXT_MAX_BYTES 255u
#define HANDSHAKE_NONCE_BYTES 16u
#define HANDSHAKE_TOKEN_BYTES 16u

/* Bits of `capabilities`. */
#define HANDSHAKE_CAN_H264 (UINT64_C(1) << 0)      /* client: decodes H.264; daemon: encodes it */
#define HANDSHAKE_CAN_READ_ONLY (UINT64_C(1) << 1) /* reply: this client may view scenes but not edit them */
/* Reply of version 0: the daemon accepts sealed connections only. */
#define HANDSHAKE_NEEDS_KEY (UINT64_C(1) << 2)
#define HANDSHAKE_TRY_AGAIN (UINT64_C(1) << 4)   /* reply of version 0: the daemon may have a place later */
#define HANDSHAKE_CAN_ABANDON (UINT64_C(1) << 3) /* frames of views may end unfinished, as frame_end says */

struct handshake_hello {
    uint16_t version_min;
    uint16_t version_max;
    uint64_t capabilities;
    uint8_t nonce[HANDSHAKE_NONCE_BYTES];
    char name[HANDSHAKE_NAME_MAX_BYTES + 1];
};

/* The daemon's limits; 0: not sent. In wire order. */
struct handshake_limits {
#define LIMIT(type, name, what) LIMIT_##type(name)
#define LIMIT_u64(name) uint64_t name;
#define LIMIT_u32(name) uint32_t name;
#include "protocol/limits.def"
#undef LIMIT_u64
#undef LIMIT_u32
#undef LIMIT
};

enum {
    HANDSHAKE_LIMITS_BYTES = 0 /* size on the wire */
#define LIMIT(type, name, what) +sizeof(((struct handshake_limits *)0)->name)
#include "protocol/limits.def"
#undef LIMIT
};

struct handshake_limit {
    const char *name, *what; /* identifier, and a description for people */
    unsigned bytes;          /* size on the wire: 4 or 8 */
    uint64_t value;
};

/* Gets the limit `index` in wire order; false: there is none. */
bool handshake_limit_at(const struct handshake_limits *limits, size_t index, struct handshake_limit *out);

struct handshake_reply {
    uint16_t version;
    uint64_t capabilities;
    uint8_t nonce[HANDSHAKE_NONCE_BYTES];
    uint8_t session_token[HANDSHAKE_TOKEN_BYTES];
    struct handshake_limits limits;
    char name[HANDSHAKE_NAME_MAX_BYTES + 1]; /* the daemon's name */
    char text[HANDSHAKE_TEXT_MAX_BYTES + 1]; /* reason of a refusal, for people */
};

enum handshake_result {
    HANDSHAKE_CONSUMED,  /* the handshake was *consumed_bytes bytes; messages follow */
    HANDSHAKE_NEED_MORE, /* the bytes are the beginning of a handshake */
    HANDSHAKE_FATAL,     /* *error has the reason: code PROTOCOL */
};

/* Return the number of bytes written, a multiple of 8; 0 if a field is invalid (name too long or not UTF-8,
 * versions in disorder). */
size_t handshake_hello_encode(uint8_t out[HANDSHAKE_HELLO_MAX_BYTES], const struct handshake_hello *hello);
size_t handshake_reply_encode(uint8_t out[HANDSHAKE_REPLY_MAX_BYTES], const struct handshake_reply *reply);

/* Parse the bytes received so far: a wrong first byte is refused at once. *out is zeroed unless consumed. */
enum handshake_result handshake_hello_parse(struct handshake_hello *out, const uint8_t *bytes, size_t count,
                                            size_t *consumed_bytes, struct decode_error *error);
enum handshake_result handshake_reply_parse(struct handshake_reply *out, const uint8_t *bytes, size_t count,
                                            size_t *consumed_bytes, struct decode_error *error);

/* The newest version that both sides speak. 0: none; *error (may be NULL) gets code VERSION and a text for the
 * reply. */
uint16_t handshake_choose_version(const struct handshake_hello *hello, struct decode_error *error);
/* Client: checks that the reply has one of the offered versions. False: *error (may be NULL) has code VERSION,
 * with the daemon's text if it sent one, or PROTOCOL for a version outside the offer. */
bool handshake_reply_accept(const struct handshake_hello *hello, const struct handshake_reply *reply,
                            struct decode_error *error);

#ifdef __cplusplus
}
#endif
#endif
