/* SPDX-License-Identifier: MIT */
/* Questions to the daemon's other workers, asked through the front, so that clients see one daemon. Network thread
 * only. */
#ifndef FARLIGHT_SESSION_OTHERS_H
#define FARLIGHT_SESSION_OTHERS_H

#include "net/channel.h"
#include "net/handover.h"
#include "protocol/codec.h"
#include "session/hub.h"
#include "session/requests.h"

struct others;

struct others_answer {
    struct others_answer *next;
    uint32_t worker;
    struct message message; /* STATS_REPLY or SCENE_LIST_REPLY */
    uint8_t scratch[SCRATCH_BYTES];
};

/* Receives the answers that came in time. `session` and `request` are NULL if the client or the request is gone:
 * then only the context must be freed. */
typedef void others_done_fn(void *context, struct session *session, struct request *request,
                            const struct others_answer *answers);

struct others *others_create(struct hub *hub); /* NULL: out of memory */
void others_destroy(struct others *others);    /* accepts NULL; ends pending questions, without a session */
/* Sets the channel to the front; without it there are no other workers. */
void others_reach(struct others *others, struct channel *front);
/* Asks for a client's request. done() is called once, possibly before this returns. */
void others_ask(struct others *others, enum channel_what what, struct session *session, struct request *request,
                uint64_t timeout_ns, others_done_fn *done, void *context);
/* Hands a client to the worker handover->to_worker, in the manner of handover_send(). */
bool others_hand_over(struct others *others, const struct connection *connection, const struct handover *handover,
                      const uint8_t *message, size_t message_bytes, struct error *error);

/* Handles a packet from the front, and the engine's answer to another worker's question. */
void others_received(struct others *others, enum channel_kind kind, const void *payload, size_t bytes);
void others_answer(struct others *others, const struct engine_event *event);

#endif
