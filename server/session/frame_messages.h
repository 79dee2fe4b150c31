/* SPDX-License-Identifier: MIT */
/* The messages of a frame, filled from the engine's frame. */
#ifndef FARLIGHT_SESSION_FRAME_MESSAGES_H
#define FARLIGHT_SESSION_FRAME_MESSAGES_H

#include "engine/engine.h"
#include "protocol/messages.h"

#include <stdint.h>

/* Header and fixed part of a frame_data message, up to the bytes themselves. */
#define FRAME_DATA_HEAD_BYTES 32u

/* Records to which a FRAME_END refers. */
struct frame_end_records {
    struct record_stage_time stages[STAGE_SPANS_MAX];
    struct record_wave_comparison comparisons[COMPARISONS_MAX];
    struct record_structure_row structure[STRUCTURE_ROWS_MAX];
};

void frame_fill_begin(struct message_frame_begin *begin, const struct engine_frame *frame);
void frame_fill_parts(struct message_frame_parts *message, struct record_frame_part records[PARTS_MAX],
                      const struct engine_frame *frame);
void frame_fill_end(struct message_frame_end *end, struct frame_end_records *records,
                    const struct engine_frame *frame);
void frame_data_head(uint8_t head[FRAME_DATA_HEAD_BYTES], uint32_t request, uint32_t channel,
                     uint64_t offset_bytes, uint32_t data_bytes);

#endif
