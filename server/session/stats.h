/* SPDX-License-Identifier: MIT */
/* The daemon's state as a message. */
#ifndef FARLIGHT_SESSION_STATS_H
#define FARLIGHT_SESSION_STATS_H

#include "engine/engine.h"
#include "session/hub.h"
#include "session/requests.h"

struct message;

/* The asker, which determines the figures that it may know. */
struct stats_asker {
    const struct hub *hub;
    const struct session *session; /* NULL: a client of another worker */
    blob_principal principal;
    bool read_only; /* whether it may know only of itself and of scenes that it may attach to */
};

/* Answers with the figures of all workers; takes over the stats. */
void stats_answer(struct session *session, struct request *request, struct engine_stats *stats);
/* Fills a STATS_REPLY of this worker, which refers to the returned storage; the caller frees that. NULL: out of
 * memory. */
struct stats_storage *stats_fill(struct message *message, const struct stats_asker *asker,
                                 const struct engine_stats *stats);

#endif
