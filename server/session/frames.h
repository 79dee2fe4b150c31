/* SPDX-License-Identifier: MIT */
/* Rendered frames on their way to the client, without a copy: FRAME_BEGIN, pieces that refer to the
 * frame's bytes, and FRAME_END once the last of them is with the kernel, so that it can tell the times. */
#ifndef FARLIGHT_SESSION_FRAMES_H
#define FARLIGHT_SESSION_FRAMES_H

#include "engine/engine.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct job;
struct session;

#define FRAME_PIECE_BYTES ((size_t)256 << 10)
/* Of a picture at rest: motion that overtakes it waits for one of them. */
#define FRAME_PIECE_AT_REST_BYTES ((size_t)32 << 10)
/* Header and fixed part of a frame_data message, up to the bytes themselves. */
#define FRAME_DATA_HEAD_BYTES 32u

/* Takes the frame over, in any case. */
void frames_add(struct job *job, struct engine_frame *frame);
/* Drops what of the job has not been begun on the wire, and forgets the rest. The request of a view whose place it
 * has taken, if one of those frames was that view's; 0: none was. */
uint32_t frames_drop(struct session *session, struct job *job);
/* Drops what has not been begun, as another view takes the job's place. True: one of the job's request has, and
 * will be finished; from now on until its bytes are let go it counts beside what the job may take. */
bool frames_keep_begun(struct job *job);
/* Its frames under way that are those of a view whose place it has taken: 0 or 1. */
unsigned frames_of_before(const struct job *job);
uint64_t frames_bytes_of_before(const struct job *job);
/* Its frames whose first byte has gone, but not the last: 0 or 1. */
unsigned frames_on_the_wire(const struct job *job);
/* Of the view's frame that is on the wire, what has not gone will not, if it is one that motion has overtaken and
 * the client understands that. */
void frames_abandon(struct job *job);
/* Queues pieces as long as the connection wants bulk; jobs take turns. */
void frames_pump(struct session *session);
void frame_data_head(uint8_t head[FRAME_DATA_HEAD_BYTES], uint32_t request, uint32_t channel,
                     uint64_t offset_bytes, uint32_t data_bytes);

#endif
