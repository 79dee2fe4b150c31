/* SPDX-License-Identifier: MIT */
/* One client, from its hello to its goodbye: its resources and its requests. */
#ifndef FARLIGHT_SESSION_SESSION_H
#define FARLIGHT_SESSION_SESSION_H

#include "base/hashmap.h"
#include "session/hub.h"
#include "session/requests.h"
#include "session/scenes.h"

#include <stdbool.h>
#include <stdint.h>

struct job;

#define SESSION_OFFERS_KEY_BYTES 16

/* Blobs that the client named; see upload.h. */
struct session_blobs {
    struct hashmap offers; /* struct offer, by a keyed hash of its hash */
    uint8_t offers_key[SESSION_OFFERS_KEY_BYTES];
    size_t offer_count;
    uint64_t received_bytes; /* of blob data, on channel 1 */
    uint64_t credit_bytes;   /* told to the client, absolute */
};

struct session {
    struct hub *hub;
    uint64_t number;
    struct connection *connection;
    struct auth_identity identity;
    struct address peer;
    blob_principal principal;
    uint64_t owner; /* auth_owner_number() */
    char name[HANDSHAKE_NAME_MAX_BYTES + 1];
    bool introduced;                 /* the hello is done: the engine may know it */
    bool can_h264;                   /* the client decodes it, and an encoder is here */
    bool can_abandon;                /* frames of views may end unfinished */
    struct engine_command *farewell; /* for when it is gone, which must not fail for lack of memory */

    struct requests requests;
    struct hashmap scenes; /* struct session_scene *, by id; see scenes.h */
    bool scenes_changed;   /* there may be changes to tell */
    struct session_blobs blobs;
    size_t transaction_edits;   /* in all transactions that are not answered */
    uint64_t transaction_bytes; /* of them: memory, also of those that the engine has */
    struct job *jobs;           /* whose frame goes next is first */
    uint32_t job_count;
};

/* As hub_add_client(). */
struct session *session_create(struct hub *hub, uint64_t number, int fd, const struct handover *handover,
                               struct error *error);
/* Another worker is to serve it, which is to read `message` first. False: it cannot go, as it has more than this
 * one request, or does not read what it is told; nothing is changed. */
bool session_move(struct session *session, uint32_t worker, uint32_t request, const struct message *message);
/* After the daemon's keys were replaced: goodbye to one whose key is none of them. */
void session_check_key(struct session *session);
void session_stop(struct session *session); /* the daemon stops: goodbye */
void session_close(struct session *session);
void session_hold(struct session *session, bool held);                          /* reads no further */
void session_engine_event(struct session *session, struct engine_event *event); /* may take its parts */

/* ---- for the files of this folder ---- */
bool session_send(struct session *session, uint32_t request, uint32_t channel, const struct message *message);
void session_send_error(struct session *session, uint32_t request, const struct error *error);
/* ERROR on request 0, goodbye, end. */
void session_fail(struct session *session, const struct error *error);
void session_fail_for_memory(struct session *session);
/* Submits a request's command to the engine; NULL (out of memory) is answered with an error. */
void session_submit(struct session *session, struct request *request, struct engine_command *command);
#endif
