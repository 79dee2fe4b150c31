/* SPDX-License-Identifier: MIT */
/* Messages of clients in sessions with a bit of everything: the start of the fuzzer, and the sessions that
 * are cut, starved and interrupted at every place. */
#ifndef FARLIGHT_TESTS_RECORDED_SESSION_H
#define FARLIGHT_TESTS_RECORDED_SESSION_H

#include "protocol/messages.h"

#include <stdint.h>

/* Gets each message of a session, in order. */
typedef void recorded_say_fn(void *context, uint32_t request, uint32_t channel, const struct message *message);

/* A shared scene: offer, upload, commit; a batch, a view with cameras, acknowledgements, one in the place of
 * another; cancel, stats, close, goodbye. */
void recorded_session(recorded_say_fn *say, void *context);
/* Somebody else meanwhile: finds and describes that scene, edits it, looks on. */
void recorded_onlooker(recorded_say_fn *say, void *context);
/* Refusals: identifiers that name nothing, transactions that fail, cancels of all kinds. */
void recorded_blunders(recorded_say_fn *say, void *context);

#endif
