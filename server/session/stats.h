/* SPDX-License-Identifier: MIT */
/* The daemon's state as a message. */
#ifndef FARLIGHT_SESSION_STATS_H
#define FARLIGHT_SESSION_STATS_H

#include "engine/engine.h"
#include "session/requests.h"

void stats_answer(struct session *session, struct request *request, const struct engine_stats *stats);

#endif
