/* SPDX-License-Identifier: MIT */
/* The messages of a frame, filled from the engine's frame. */
#ifndef FARLIGHT_SESSION_FRAME_MESSAGES_H
#define FARLIGHT_SESSION_FRAME_MESSAGES_H

#include "engine/engine.h"
#include "protocol/messages.h"

#include <stdint.h>

/* Header and fixed part of a frame_data message, up to the bytes themselves. */
#define FRAME_DATA_HEAD_BYTES 32u

void frame_fill_begin(struct message_frame_begin *begin, const struct engine_frame *frame);
void frame_fill_parts(struct message_frame_parts *message, struct record_frame_part records[PARTS_MAX],
                      const struct engine_frame *frame);
/* The message refers to the frame, and to `rows`, which are filled. */
void frame_fill_end(struct message_frame_end *end, struct record_structure_row rows[STRUCTURE_ROWS_MAX],
                    struct engine_frame *frame);
void frame_data_head(uint8_t head[FRAME_DATA_HEAD_BYTES], uint32_t request, uint32_t channel,
                     uint64_t offset_bytes, uint32_t data_bytes);

#endif
