/* SPDX-License-Identifier: MIT */
/* Requests of one client: numbers are unique while in flight, each gets exactly one answer, and nothing
 * follows it. */
#ifndef FARLIGHT_SESSION_REQUESTS_H
#define FARLIGHT_SESSION_REQUESTS_H

#include "base/error.h"
#include "base/hashmap.h"

#include <stdbool.h>
#include <stdint.h>

struct session;

enum request_kind {
    REQUEST_SCENE_OPEN,
    REQUEST_SCENE_CLOSE,
    REQUEST_SCENE_ATTACH,
    REQUEST_SCENE_LIST,
    REQUEST_SCENE_DESCRIBE,
    REQUEST_SCENE_OBJECTS,
    REQUEST_OBJECT_GET,
    REQUEST_OFFER,
    REQUEST_UPLOAD,      /* object: struct offer */
    REQUEST_TRANSACTION, /* object: struct transaction; the client still adds to it */
    REQUEST_COMMIT,      /* submitted to the engine */
    REQUEST_JOB,         /* object: struct job */
    REQUEST_CANCEL,
    REQUEST_STATS,
};

struct request {
    uint32_t id;
    enum request_kind kind;
    uint32_t scene; /* scene_open, scene_attach and scene_close only */
    void *object;
    uint32_t cancelled_by; /* the cancel that is answered once this one is; 0: none */
    size_t edits;          /* commit only: edits, and their memory, that the engine holds until the answer */
    uint64_t edit_bytes;
};

/* Requests of several messages that failed before their last message: the rest of them is skipped. */
#define REQUESTS_DEAD_MAX 64

struct requests {
    struct hashmap in_flight; /* struct request *, by id */
    uint32_t dead[REQUESTS_DEAD_MAX];
    uint32_t dead_next;
};

void requests_finish(struct requests *requests); /* frees them; objects are their owners' */

/* A new request; NULL if that cannot be. A number that is 0 or in flight ends the connection, as no answer to it
 * could be told from another; beyond the limit the answer is an error. */
struct request *request_begin(struct session *session, uint32_t id, enum request_kind kind);
struct request *request_find(const struct session *session, uint32_t id); /* NULL: not in flight */

/* Send the answer and free the request. */
void request_answer_ok(struct session *session, struct request *request, uint64_t revision);
void request_answer_error(struct session *session, struct request *request, const struct error *error);
/* Ends a request that another message has answered. */
void request_answered(struct session *session, struct request *request);

void requests_bury(struct session *session, uint32_t id); /* more messages of it may come */
bool requests_is_dead(const struct session *session, uint32_t id);
void requests_forget_dead(struct session *session, uint32_t id); /* its last message has come */

/* CANCEL */
void request_cancel(struct session *session, struct request *cancel, uint32_t target_id);

#endif
