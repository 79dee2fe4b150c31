/* SPDX-License-Identifier: MIT */
/* What of a sealed connection lies between the socket and the messages: bytes as they came, and bytes to be sent.
 * Small until the peer has proved that it has the key. Sans-I/O, for both ends.
 *
 * Reading: sealed_link_space(), fill it, sealed_link_came(); then sealed_link_handshake() until the link is open,
 * then sealed_link_open() while it gives something.
 * Writing: sealed_link_seal() as much as it takes, send what sealed_link_waiting() gives, sealed_link_sent(). */
#ifndef FARLIGHT_PROTOCOL_SEALED_LINK_H
#define FARLIGHT_PROTOCOL_SEALED_LINK_H

#include "protocol/sealed/sealed.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SEALED_LINK_RECORDS 64u /* that can wait to be sent */

struct sealed_link {
    struct sealed *sealed;
    uint8_t *in, *out;
    size_t in_capacity, in_start, in_end;
    size_t out_capacity, out_start, out_end;
    /* The records in `out` in their order, from the first that has not been sent to its last byte. */
    struct sealed_link_record {
        size_t end; /* in `out` */
        size_t plain_bytes;
    } records[SEALED_LINK_RECORDS];
    size_t record_first, record_end;
};

/* A client's begins with its first message waiting. NULL: no memory. */
struct sealed_link *sealed_link_client(const struct sealed_key *key);
struct sealed_link *sealed_link_server(const struct sealed_key *keys, size_t key_count);
void sealed_link_destroy(struct sealed_link *link); /* accepts NULL */

/* An open link to which nothing was given to seal, for another process (sealed_save()): its streams, and the bytes
 * that came or wait. Returns their number, and writes them to `out` unless that is NULL. */
size_t sealed_link_save(const struct sealed_link *link, uint8_t *out);
/* NULL: no memory, or the bytes are not those of a link. */
struct sealed_link *sealed_link_restore(const uint8_t *saved, size_t bytes);

/* ---- from the socket ---- */

/* Where to read to. *bytes is above 0 unless a whole record waits to be opened. */
uint8_t *sealed_link_space(struct sealed_link *link, size_t *bytes);
void sealed_link_came(struct sealed_link *link, size_t bytes);
/* Bytes that came and were not used yet. */
size_t sealed_link_unopened(const struct sealed_link *link);
bool sealed_link_has_record(const struct sealed_link *link);
void sealed_link_drop_input(struct sealed_link *link);

/* As far as the bytes go. CONSUMED: the link is open. What it has to say waits; on a server not so a refusal,
 * which is for sealed_link_refuse() to say in its time. */
enum sealed_result sealed_link_handshake(struct sealed_link *link, struct decode_error *error);
/* Server, after SEALED_REFUSED. */
void sealed_link_refuse(struct sealed_link *link);
/* One record, as sealed_open(). */
enum sealed_result sealed_link_open(struct sealed_link *link, uint8_t *plain, size_t plain_capacity,
                                    size_t *plain_bytes, struct decode_error *error);

/* ---- to the socket ---- */

/* Bytes of plain text that can be sealed into one record now. */
size_t sealed_link_room(const struct sealed_link *link);
/* As many of the bytes as fit, in records as large as may be; how many that were. */
size_t sealed_link_seal(struct sealed_link *link, const uint8_t *plain, size_t plain_bytes);
/* The last record; false: there is no room yet. Once is enough: then it is true without doing anything. */
bool sealed_link_seal_last(struct sealed_link *link);
/* NULL: nothing waits. */
const uint8_t *sealed_link_waiting(const struct sealed_link *link, size_t *bytes);
/* So many of the bytes that wait were sent; the plain text of the records that are complete with them. */
size_t sealed_link_sent(struct sealed_link *link, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
