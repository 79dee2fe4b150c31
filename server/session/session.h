/* SPDX-License-Identifier: MIT */
/* A session: one client with its resources and requests, from its hello to its goodbye. */
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

/* Blobs that the client has offered; see upload.h. */
struct session_blobs {
    struct hashmap offers; /* struct offer, by a keyed hash of its hash */
    uint8_t offers_key[SESSION_OFFERS_KEY_BYTES];
    size_t offer_count;
    uint64_t received_bytes; /* blob data received on channel 1 */
    uint64_t credit_bytes;   /* credit given to the client, absolute */
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
    bool introduced;  /* whether the hello is complete: the engine may know the client */
    bool can_h264;    /* whether the client can decode it and the daemon can encode it */
    bool can_abandon; /* whether frames of views may end unfinished */
    /* Command for its end, allocated early so that the end cannot fail for lack of memory. */
    struct engine_command *farewell;

    struct requests requests;
    struct hashmap scenes; /* struct session_scene *, by id; see scenes.h */
    bool scenes_changed;   /* whether there may be changes to notify of */
    struct session_blobs blobs;
    size_t transaction_edits;   /* edits in unanswered transactions */
    uint64_t transaction_bytes; /* their memory, including edits that the engine holds */
    struct job *jobs;           /* the first one sends the next frame */
    uint32_t job_count;
};

/* Creates the session of a client; see hub_add_client(). */
struct session *session_create(struct hub *hub, uint64_t number, int fd, const struct handover *handover,
                               struct error *error);
/* Moves the client to another worker, which reads `message` first. False: it cannot move, as it has more than
 * this one request, or does not read its messages; nothing is changed. */
bool session_move(struct session *session, uint32_t worker, uint32_t request, const struct message *message);
/* Disconnects the client if its key is no longer one of the daemon's. */
void session_check_key(struct session *session);
void session_stop(struct session *session); /* the daemon stops: goodbye */
void session_close(struct session *session);
void session_hold(struct session *session, bool held); /* whether to stop reading from the client */
void session_engine_event(struct session *session, struct engine_event *event); /* may take parts of the event */

/* ---- for the files of this folder ---- */
bool session_send(struct session *session, uint32_t request, uint32_t channel, const struct message *message);
void session_send_error(struct session *session, uint32_t request, const struct error *error);
/* ERROR on request 0, goodbye, end. */
void session_fail(struct session *session, const struct error *error);
void session_fail_for_memory(struct session *session);
/* Submits a request's command to the engine; NULL (out of memory) is answered with an error. */
void session_submit(struct session *session, struct request *request, struct engine_command *command);
#endif
