/* SPDX-License-Identifier: MIT */
/* An engine without threads or GL, behind the same port: it keeps real scenes, applies real edits, and answers
 * every command as the engine may, frames included. One at a time. */
#ifndef FARLIGHT_TESTS_ENGINE_RECORDER_H
#define FARLIGHT_TESTS_ENGINE_RECORDER_H

#include "session/engine_port.h"

/* Conditions that the next commands find; bits. */
#define RECORDER_FULL 1u  /* the queue has no room */
#define RECORDER_FAILS 2u /* they are refused */
#define RECORDER_HOLDS 4u /* answers wait until the condition has changed */
#define RECORDER_LARGE 8u /* frames of several pieces, more than a socket holds */

#define RECORDER_FRAME_BYTES 44u
#define RECORDER_LARGE_FRAME_BYTES 600001u

struct engine_port recorder_begin(void);
void recorder_set_mood(unsigned mood);
/* Counts of what clients hold; 0 once all are gone. */
size_t recorder_jobs(void);
size_t recorder_references(void);
void recorder_end(void);

/* While its own functions run: their memory is not the session's. */
extern bool recorder_at_work;

#endif
