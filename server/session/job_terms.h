/* SPDX-License-Identifier: MIT */
/* Terms of a render message: checks, the memory of its frames, and the engine's job. */
#ifndef FARLIGHT_SESSION_JOB_TERMS_H
#define FARLIGHT_SESSION_JOB_TERMS_H

#include "engine/engine.h"
#include "protocol/messages.h"

#include <stdbool.h>
#include <stdint.h>

struct job;
struct session;

bool job_check(const struct session *session, const struct message_render *render, struct error *error);
/* View that the render would replace; NULL: none. */
struct job *job_replaced_by(const struct session *session, const struct message_render *render);
/* Maximum of a batch's frames that wait in memory to be sent: at least one, whatever its size. */
uint64_t job_window(const struct session *session, const struct message_render *render);
/* Maximum memory of its frames, in the engine and waiting to be sent. */
uint64_t job_bytes(const struct session *session, const struct message_render *render);
/* Fills the job except credit and requests. False: out of memory; the caller owns the incomplete job all the same.
 */
bool job_fill(struct engine_job *job, const struct session *session, const struct message_render *render);

#endif
