/* SPDX-License-Identifier: MIT */
/* Blobs of one session: offered by hash, sent in chunks if the daemon lacks them, verified. */
#ifndef FARLIGHT_SESSION_UPLOAD_H
#define FARLIGHT_SESSION_UPLOAD_H

#include "base/blob.h"
#include "base/hashmap.h"
#include "protocol/framing.h"
#include "session/edits.h"
#include "session/requests.h"

#include <stdbool.h>
#include <stdint.h>

#define UPLOAD_CHANNEL 1u

/* A blob that the client has offered. Once complete, it is held until the connection ends. */
struct offer {
    struct hashmap_link same_key;
    uint8_t hash[BLOB_HASH_BYTES];
    uint64_t size_bytes;
    struct blob *held;     /* complete and checked */
    struct blob *arriving; /* the blob while its chunks arrive */
    uint64_t arrived_bytes;
    uint8_t *chunk_hashes;   /* hashes of the complete chunks that have arrived */
    size_t chunk_hashes_max; /* capacity, in hashes */
    uint32_t hashes_left;    /* hashes that the hasher has not finished */
};

void upload_begin(struct session *session); /* sends the first credit */
void upload_finish(struct session *session);

void upload_offer(struct session *session, struct request *request, const struct message_blob_offer *offer);
void upload_data(struct session *session, const struct framing_header *header,
                 const struct message_blob_data *data);
/* A chunk with an invalid field: its request fails. */
void upload_invalid(struct session *session, uint32_t request_id, const struct error *error);
void upload_abandon(struct session *session, struct offer *offer); /* drops the chunks that have arrived */

/* Offer of this session; NULL: none has this hash. */
struct offer *upload_find(const struct session *session, const uint8_t hash[BLOB_HASH_BYTES]);
/* Adds a new offer, with nothing held. NULL and *error: too many, or no memory. */
struct offer *upload_add(struct session *session, const struct record_blob_ref *reference, struct error *error);

/* Source of blobs for the edits of a session: blobs that it has offered and that are held. */
struct edit_source upload_source(struct session *session);

#endif
