/* SPDX-License-Identifier: MIT */
/* Sends rendered frames to the client without a copy: FRAME_BEGIN, chunks that refer to the frame's bytes, and
 * FRAME_END once the kernel has accepted the last of them, so that it can contain the times. Frames in parts are
 * cut where something better waits behind them. */
#ifndef FARLIGHT_SESSION_FRAMES_H
#define FARLIGHT_SESSION_FRAMES_H

#include "engine/engine.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct job;
struct session;

#define FRAME_PIECE_BYTES ((size_t)256 << 10)
/* The chunk size of a picture at rest: a moving frame that overtakes it waits for one chunk. */
#define FRAME_PIECE_AT_REST_BYTES ((size_t)32 << 10)

/* Adds a frame from the engine; takes it over in any case. */
void frames_add(struct job *job, struct engine_frame *frame);
/* Drops the job's frames that have not begun on the wire, and detaches the rest. Returns the request of a replaced
 * view, if one of those frames was that view's; 0: none was. */
uint32_t frames_drop(struct session *session, struct job *job);
/* Drops frames that have not begun, as another view replaces the job's. True: a frame of the request has begun and
 * will be finished; until its bytes are released it counts in addition to the job's share. */
bool frames_keep_begun(struct job *job);
/* The number of its frames under way that belong to a replaced view: 0 or 1. */
unsigned frames_of_replaced(const struct job *job);
uint64_t frames_bytes_of_replaced(const struct job *job);
/* Number of its frames that are partly sent: 0 or 1. */
unsigned frames_on_the_wire(const struct job *job);
/* Ends the view's partly sent frame early if it is overtaken: a frame at rest, or a hidden layer, by motion; a
 * moving frame by a newer picture that waits. A frame in parts ends after its current part. Another frame is
 * abandoned if the client understands that, unless it shows motion. */
void frames_overtake(struct job *job);
/* Queues chunks while the connection wants bulk; jobs take turns. */
void frames_pump(struct session *session);

#endif
