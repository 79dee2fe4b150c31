/* SPDX-License-Identifier: MIT */
/* The buffers of a sealed connection between the socket and the messages: received bytes, and bytes to be sent.
 * They stay small until the peer has proved that it has the key. Sans-I/O, for both ends.
 *
 * Reading: fill sealed_link_space(), call sealed_link_came(); then sealed_link_handshake() until the link is open,
 * then sealed_link_open() while it returns something.
 * Writing: pass bytes to sealed_link_seal(), send those of sealed_link_waiting(), call sealed_link_sent(). */
#ifndef FARLIGHT_PROTOCOL_SEALED_LINK_H
#define FARLIGHT_PROTOCOL_SEALED_LINK_H

#include "protocol/sealed/sealed.h"

#ifdef __cplusplus
extern "C" {
#endif

#define SEALED_LINK_RECORDS 64u /* limit of records that wait to be sent */

struct sealed_link {
    struct sealed *sealed;
    uint8_t *in, *out;
    size_t in_capacity, in_start, in_end;
    size_t out_capacity, out_start, out_end;
    /* The records in `out` in order, from the first that is not sent completely. */
    struct sealed_link_record {
        size_t end; /* offset in `out` */
        size_t plain_bytes;
    } records[SEALED_LINK_RECORDS];
    size_t record_first, record_end;
};

/* A client's link starts with its first message queued. NULL: out of memory. */
struct sealed_link *sealed_link_client(const struct sealed_key *key);
struct sealed_link *sealed_link_server(const struct sealed_key *keys, size_t key_count);
void sealed_link_destroy(struct sealed_link *link); /* accepts NULL */

/* Save and restore an open link for another process (sealed_save()), before anything was sealed: its streams,
 * and received or queued bytes. Returns their number, and writes them to `out` unless that is NULL. */
size_t sealed_link_save(const struct sealed_link *link, uint8_t *out);
/* NULL: out of memory, or invalid bytes. */
struct sealed_link *sealed_link_restore(const uint8_t *saved, size_t bytes);

/* ---- from the socket ---- */

/* Space for received bytes. *bytes is above 0 unless a whole record is ready to be opened. */
uint8_t *sealed_link_space(struct sealed_link *link, size_t *bytes);
void sealed_link_came(struct sealed_link *link, size_t bytes);
/* Received bytes that are not used yet. */
size_t sealed_link_unopened(const struct sealed_link *link);
bool sealed_link_has_record(const struct sealed_link *link);
void sealed_link_drop_input(struct sealed_link *link);

/* Runs the handshake as far as the received bytes allow. CONSUMED: the link is open. Answers are queued, except
 * a server's refusal, which sealed_link_refuse() sends later. */
enum sealed_result sealed_link_handshake(struct sealed_link *link, struct decode_error *error);
/* Queues a server's refusal, after SEALED_REFUSED. */
void sealed_link_refuse(struct sealed_link *link);
/* Opens one record, as sealed_open() does. */
enum sealed_result sealed_link_open(struct sealed_link *link, uint8_t *plain, size_t plain_capacity,
                                    size_t *plain_bytes, struct decode_error *error);

/* ---- to the socket ---- */

/* Bytes of plain text that can be sealed into one record now. */
size_t sealed_link_room(const struct sealed_link *link);
/* Seals as many bytes as fit, in records as large as possible; returns their number. */
size_t sealed_link_seal(struct sealed_link *link, const uint8_t *plain, size_t plain_bytes);
/* Seals the last record; false: there is no space yet. Later calls return true and do nothing. */
bool sealed_link_seal_last(struct sealed_link *link);
/* The bytes to send next; NULL: none. */
const uint8_t *sealed_link_waiting(const struct sealed_link *link, size_t *bytes);
/* Removes sent bytes; returns the size of the plain text of the records that are now complete. */
size_t sealed_link_sent(struct sealed_link *link, size_t bytes);

#ifdef __cplusplus
}
#endif
#endif
