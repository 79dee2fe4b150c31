/* SPDX-License-Identifier: MIT */
/* Transactions: messages become edits of a scene, gathered until the client commits them. */
#ifndef FARLIGHT_SESSION_EDITS_H
#define FARLIGHT_SESSION_EDITS_H

#include "protocol/framing.h"
#include "scene/scene.h"
#include "session/requests.h"

struct transaction {
    uint32_t scene;
    uint64_t base_revision; /* the client's, from edit_begin */
    struct scene_edit *edits;
    size_t count, capacity;
    uint64_t bytes; /* memory of the edits, without blobs */
};

void edits_begin(struct session *session, struct request *request, const struct message_edit_begin *begin);
/* Adds an edit to an open transaction. */
void edits_add(struct session *session, struct request *request, const struct message *message);
void edits_commit(struct session *session, struct request *request);
/* Answers the request with the error; later messages of the transaction are skipped. */
void edits_fail(struct session *session, struct request *request, const struct error *error);
/* Adds to the numbers of waiting edits and their bytes; negative: subtracts. */
void edits_count(struct session *session, int64_t edits, int64_t bytes);
void transaction_destroy(struct session *session, struct transaction *transaction); /* accepts NULL */

/* Source of blobs to which edits refer, and the limit of textures. */
struct edit_source {
    /* Gets the blob of a reference, NULL for an empty one. False and *error, whose field is `field`: there is no
     * such blob. */
    bool (*resolve)(void *context, const struct record_blob_ref *reference, const char *field, struct blob **blob,
                    struct error *error);
    void *context;
    uint32_t texture_edge_texels; /* the limit */
};

/* Fills the edit from a SET_.. or REMOVE message. False and *error: a blob is not there, or no memory; the
 * edit is to be finished either way. */
bool edit_from_message(const struct edit_source *source, const struct message *message, struct scene_edit *edit,
                       struct error *error);

#endif
