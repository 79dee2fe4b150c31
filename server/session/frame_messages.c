/* SPDX-License-Identifier: MIT */
#include "session/frame_messages.h"

#include "protocol/framing.h"

#include <string.h>

#define MEASURE_MAX 3e38f /* the protocol's maximum */

static void put_u32(uint8_t *out, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        out[i] = (uint8_t)(value >> (8 * i));
}

/* Writes the bytes that message_write() makes of a frame_data message before the frame's own (a test compares the
 * two), without a copy of every frame. */
void frame_data_head(uint8_t head[FRAME_DATA_HEAD_BYTES], uint32_t request, uint32_t channel,
                     uint64_t offset_bytes, uint32_t data_bytes)
{
    memset(head, 0, FRAME_DATA_HEAD_BYTES);
    framing_header_encode(head, &(struct framing_header){
                                    .payload_bytes = FRAME_DATA_HEAD_BYTES - FRAMING_HEADER_BYTES + data_bytes,
                                    .type = MESSAGE_FRAME_DATA,
                                    .request = request,
                                    .channel = channel,
                                });
    uint8_t *payload = head + FRAMING_HEADER_BYTES;
    payload[0] = 8; /* struct_bytes: offset_bytes */
    put_u32(payload + 2, (uint32_t)offset_bytes);
    put_u32(payload + 6, (uint32_t)(offset_bytes >> 32));
    put_u32(payload + 10, data_bytes);
}

void frame_fill_begin(struct message_frame_begin *begin, const struct engine_frame *frame)
{
    begin->frame = frame->frame;
    const struct frame_crop crop = frame_request_crop(&frame->request);
    begin->width = crop.width;
    begin->height = crop.height;
    begin->samples = frame->result.samples;
    begin->noise = frame->result.noise;
    begin->revision = frame->result.revision;
    begin->size_bytes =
        frame->size_bytes - frame->coarse_bytes - frame->depth_bytes - frame->normal_bytes - frame->sticking_bytes;
    begin->attachments = frame->result.attachments;
    begin->depth_bytes = frame->depth_bytes;
    begin->normal_bytes = frame->normal_bytes;
    begin->sticking_bytes = frame->sticking_bytes;
    begin->depth_form = frame->depth_step > 0.0f ? PROTOCOL_DEPTH_FORM_INVERSE : PROTOCOL_DEPTH_FORM_METRES;
    begin->depth_step = frame->depth_step;
    begin->margin_x = frame->margin_x;
    begin->margin_y = frame->margin_y;
    begin->hidden_layer = frame->request.hidden_layer;
    begin->of_frame = frame->of_frame;
    begin->depth_less = frame->depth_less;
    begin->format = (enum protocol_pixel_format)frame->request.picture.format;
    begin->encoding = (enum protocol_encoding)frame->encoding;
    begin->tracer = (enum protocol_tracer)frame->request.tracing.tracer;
    begin->integrator = (enum protocol_integrator)frame->request.light.integrator;
    begin->digest = frame->digest;
    begin->exposure_stops = frame->request.picture.exposure_stops;
    memcpy(begin->world_from_view, frame->request.camera.world_from_view, sizeof(begin->world_from_view));
    begin->fov_y = frame->request.camera.fov_y;
    begin->ortho_height = frame->request.camera.ortho_height;
    begin->time_s = frame->time_s;
    begin->aperture = frame->request.aperture;
    begin->focus = frame->request.focus;
    begin->shutter_s = frame->shutter_s;
    begin->layers = frame->result.layers;
    begin->command = frame->command;
    begin->received_ns = frame->received_ns;
    begin->applied_ns = frame->applied_ns;
    begin->rendered_ns = frame->rendered_ns;
    begin->moving = frame->moving;
    begin->key_frame = frame->key_frame;
    begin->quality = frame->quality;
}

void frame_fill_parts(struct message_frame_parts *message, struct record_frame_part records[PARTS_MAX],
                      const struct engine_frame *frame)
{
    const struct part_list *list = &frame->parts;
    for (uint32_t i = 0; i < list->count; i++)
        records[i] = (struct record_frame_part){.kind = (enum protocol_frame_part_kind)list->parts[i].kind,
                                                .size_bytes = list->parts[i].bytes};
    message->frame = frame->frame;
    message->parts = records;
    message->parts_count = list->count;
}

static uint32_t fill_structure(struct record_structure_row *records, const struct frame_result *result)
{
    const struct structure_rows *from = &result->structure;
    for (uint32_t i = 0; i < from->count; i++) {
        const struct structure_row *row = &from->rows[i];
        records[i] = (struct record_structure_row){
            .name = row->name,
            .part = row->part,
            .unit = (enum protocol_unit)row->unit,
            .number = row->number,
            .measure = row->measure < MEASURE_MAX ? row->measure : MEASURE_MAX,
            .warning = row->warning,
        };
    }
    return from->count;
}

void frame_fill_end(struct message_frame_end *end, struct record_structure_row rows[STRUCTURE_ROWS_MAX],
                    struct engine_frame *frame)
{
    struct frame_result *result = &frame->result;
    end->frame = frame->frame;
    end->primary_rays = result->primary_rays;
    end->shadow_rays = result->shadow_rays;
    end->secondary_rays = result->secondary_rays;
    end->splits = result->splits;
    end->device_waits = result->device_waits;
    end->dispatches = result->dispatches;
    end->barriers = result->barriers;
    end->uploaded_bytes = result->uploaded_bytes;
    end->structure_bytes = result->structure_bytes;
    end->stages = result->times.spans;
    end->stages_count = result->times.count;
    end->comparisons = result->comparisons;
    end->comparisons_count =
        result->comparison_count < COMPARISONS_MAX ? result->comparison_count : COMPARISONS_MAX;
    end->structure = rows;
    end->structure_count = fill_structure(rows, result);
}
