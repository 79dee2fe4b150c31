/* SPDX-License-Identifier: MIT */
/* What a render asks for: whether it may be, what its frames take, and how the engine is told. */
#ifndef FARLIGHT_SESSION_JOB_TERMS_H
#define FARLIGHT_SESSION_JOB_TERMS_H

#include "engine/engine.h"
#include "protocol/messages.h"

#include <stdbool.h>
#include <stdint.h>

struct job;
struct session;

bool job_check(const struct session *session, const struct message_render *render, struct error *error);
/* The view whose place another one would take; NULL: nobody's. */
struct job *job_replaced_by(const struct session *session, const struct message_render *render);
/* How many frames of a batch may wait in memory to be sent: at least one, whatever its size. */
uint64_t job_window(const struct session *session, const struct message_render *render);
/* The maximum that its frames can take: those in the engine, and those that wait to be sent. */
uint64_t job_bytes(const struct session *session, const struct message_render *render);
/* All but credit and wishes. False: out of memory; what there is of it is the caller's all the same. */
bool job_fill(struct engine_job *job, const struct session *session, const struct message_render *render);

#endif
