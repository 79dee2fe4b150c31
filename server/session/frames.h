/* SPDX-License-Identifier: MIT */
/* Sends rendered frames to the client without a copy: FRAME_BEGIN, chunks that refer to the frame's bytes, and
 * FRAME_END once the kernel has accepted the last of them, so that it can contain the times. */
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
/* Header and fixed part of a frame_data message, up to the bytes themselves. */
#define FRAME_DATA_HEAD_BYTES 32u

/* Takes the frame over, in any case. */
void frames_add(struct job *job, struct engine_frame *frame);
/* Drops the job's frames that have not begun on the wire, and detaches the rest. Returns the request of a replaced
 * view, if one of those frames was that view's; 0: none was. */
uint32_t frames_drop(struct session *session, struct job *job);
/* Drops frames that have not begun, as another view replaces the job's. True: one frame of the request has begun
 * and will be finished; until its bytes are released it counts in addition to the job's share. */
bool frames_keep_begun(struct job *job);
/* The number of its frames under way that belong to a replaced view: 0 or 1. */
unsigned frames_of_before(const struct job *job);
uint64_t frames_bytes_of_before(const struct job *job);
/* Its frames whose first byte has gone, but not the last: 0 or 1. */
unsigned frames_on_the_wire(const struct job *job);
/* Abandons the rest of the view's frame on the wire, if motion has overtaken it and the client understands that.
 */
void frames_abandon(struct job *job);
/* Queues chunks while the connection wants bulk; jobs take turns. */
void frames_pump(struct session *session);
void frame_data_head(uint8_t head[FRAME_DATA_HEAD_BYTES], uint32_t request, uint32_t channel,
                     uint64_t offset_bytes, uint32_t data_bytes);

#endif
