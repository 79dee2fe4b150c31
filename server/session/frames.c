/* SPDX-License-Identifier: MIT */
#include "session/frames.h"

#include "base/clock.h"
#include "base/timeline.h"
#include "session/jobs.h"
#include "session/session.h"
#include "session/views.h"

#include <stdlib.h>
#include <string.h>

#define MEASURE_MAX 3e38f /* the message's */

/* Lives until the last message that refers to its bytes is gone. */
struct pending_frame {
    struct out_chunk chunk; /* first: release() gets its address */
    struct pending_frame *next;
    struct job *job;  /* NULL: dropped */
    uint32_t request; /* the job's, or that of a view that it has replaced */
    struct engine_frame *frame;
    struct hub *counted_by; /* its bytes, counted apart from those of jobs; NULL: they count as the job's */
    struct owner *owner;    /* as whose, a reference; NULL: likewise */
    bool begun;
    bool queued; /* all of it is with the connection */
    size_t queued_bytes;
    uint64_t begun_ns; /* FRAME_BEGIN was handed to the kernel */
};

static void engine_frame_destroy(struct engine_frame *frame)
{
    frame_result_finish(&frame->result);
    free(frame->bytes);
    free(frame);
}

static void release(struct out_chunk *chunk)
{
    struct pending_frame *pending = (struct pending_frame *)(void *)chunk;
    if (pending->counted_by) {
        hub_count_frames(pending->counted_by, pending->owner, -(int64_t)pending->chunk.size_bytes);
        owner_unref(&pending->counted_by->owners, pending->owner);
    }
    engine_frame_destroy(pending->frame);
    free(pending);
}

void frames_add(struct job *job, struct engine_frame *frame)
{
    struct pending_frame *pending = job->cancelled ? NULL : calloc(1, sizeof(*pending));
    if (!pending) {
        engine_frame_destroy(frame);
        if (!job->cancelled)
            session_fail_for_memory(job->session);
        return;
    }
    *pending = (struct pending_frame){
        .chunk = {.references = 1, .data = frame->bytes, .size_bytes = frame->size_bytes, .release = release},
        .job = job,
        .request = job->request,
        .frame = frame,
    };
    *job->end = pending;
    job->end = &pending->next;
    if (job->view)
        view_frame_made(job, frame);
    connection_wake(job->session->connection);
}

static void remove_first(struct job *job)
{
    struct pending_frame *pending = job->first;
    job->first = pending->next;
    if (!job->first)
        job->end = &job->first;
    pending->job = NULL;
    out_chunk_unref(&pending->chunk);
}

uint32_t frames_drop(struct session *session, struct job *job)
{
    uint32_t before = job->first && job->first->request != job->request ? job->first->request : 0;
    while (job->first) {
        out_queue_drop_bulk(&session->connection->out, job->first->request);
        remove_first(job);
    }
    return before;
}

unsigned frames_of_before(const struct job *job)
{
    return job->first && job->first->request != job->request;
}

uint64_t frames_bytes_of_before(const struct job *job)
{
    return job->first && job->first->counted_by ? job->first->chunk.size_bytes : 0;
}

unsigned frames_on_the_wire(const struct job *job)
{
    return job->first && job->first->begun_ns;
}

bool frames_keep_begun(struct job *job)
{
    struct pending_frame *begun = job->first && job->first->begun ? job->first : NULL;
    if (begun)
        job->first = begun->next;
    while (job->first)
        remove_first(job);
    if (!begun)
        return false;
    begun->next = NULL;
    job->first = begun;
    job->end = &begun->next;
    if (!begun->counted_by) {
        begun->counted_by = job->session->hub;
        begun->owner = owner_ref(job->session->owner);
        hub_count_frames(begun->counted_by, begun->owner, (int64_t)begun->chunk.size_bytes);
    }
    return begun->request == job->request;
}

/* ---- messages ---------------------------------------------------------------------------------------- */

static void put_u32(uint8_t *out, uint32_t value)
{
    for (int i = 0; i < 4; i++)
        out[i] = (uint8_t)(value >> (8 * i));
}

/* The same bytes as message_write() makes of a frame_data message, up to the frame's own (a test compares the
 * two): writing them here avoids a copy of every frame. */
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

static void fill_begin(struct message_frame_begin *begin, const struct engine_frame *frame)
{
    begin->frame = frame->frame;
    begin->width = frame->request.width;
    begin->height = frame->request.height;
    begin->samples = frame->result.samples;
    begin->revision = frame->result.revision;
    begin->size_bytes = frame->size_bytes - frame->depth_bytes - frame->normal_bytes - frame->sticking_bytes;
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
    begin->format = (enum protocol_pixel_format)frame->request.format;
    begin->encoding = (enum protocol_encoding)frame->encoding;
    begin->tracer = (enum protocol_tracer)frame->request.tracer;
    begin->integrator = (enum protocol_integrator)frame->request.integrator;
    begin->digest = frame->digest;
    begin->exposure_stops = frame->request.exposure_stops;
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

static uint32_t fill_comparisons(struct record_wave_comparison *records, const struct frame_result *result)
{
    uint32_t count = result->comparison_count < COMPARISONS_MAX ? result->comparison_count : COMPARISONS_MAX;
    for (uint32_t i = 0; i < count; i++) {
        const struct wave_comparison *from = &result->comparisons[i];
        records[i] = (struct record_wave_comparison){
            .wave = from->wave,
            .kind = (enum protocol_ray_kind)from->kind,
            .rays = from->rays,
            .both_hit = from->both_hit,
            .both_missed = from->both_missed,
            .only_tracer = from->only_first,
            .only_reference = from->only_second,
            .far = from->far,
            .edges = from->edges,
            .other_surface = from->other_surface,
            .tracer_ns = from->first_ns,
            .reference_ns = from->second_ns,
            .distance_median = from->distance_median,
            .distance_p99 = from->distance_p99,
            .distance_max = from->distance_max,
            .relative_median = from->relative_median,
            .normal_median = from->normal_median,
            .normal_p99 = from->normal_p99,
            .normal_max = from->normal_max,
        };
    }
    return count;
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

static void send_end(struct pending_frame *pending, bool abandoned, uint64_t now_ns)
{
    struct job *job = pending->job;
    struct engine_frame *frame = pending->frame;
    struct stage_times *times = &frame->result.times;
    uint64_t queue_ns = pending->begun_ns > frame->encoded_ns ? pending->begun_ns - frame->encoded_ns : 0;
    uint64_t send_ns = now_ns - pending->begun_ns;
    stage_times_add(times, STAGE_QUEUE, CLOCK_CPU, 0, frame->encoded_ns, queue_ns);
    stage_times_add(times, STAGE_SEND, CLOCK_CPU, 0, pending->begun_ns, send_ns);
    struct record_stage_time stages[STAGE_SPANS_MAX];
    for (uint32_t i = 0; i < times->count; i++) {
        const struct stage_span *span = &times->spans[i];
        stages[i] = (struct record_stage_time){
            .stage = (enum protocol_stage)span->stage,
            .clock = (enum protocol_clock)span->clock,
            .wave = span->wave < UINT16_MAX ? span->wave : UINT16_MAX,
            .start_ns = span->start_ns,
            .duration_ns = span->duration_ns,
        };
    }
    struct record_wave_comparison comparisons[COMPARISONS_MAX];
    struct record_structure_row structure[STRUCTURE_ROWS_MAX];
    struct message message;
    message_init(&message, MESSAGE_FRAME_END);
    message.frame_end.frame = frame->frame;
    message.frame_end.primary_rays = frame->result.primary_rays;
    message.frame_end.shadow_rays = frame->result.shadow_rays;
    message.frame_end.secondary_rays = frame->result.secondary_rays;
    message.frame_end.splits = frame->result.splits;
    message.frame_end.device_waits = frame->result.device_waits;
    message.frame_end.uploaded_bytes = frame->result.uploaded_bytes;
    message.frame_end.structure_bytes = frame->result.structure_bytes;
    message.frame_end.abandoned = abandoned;
    message.frame_end.stages = stages;
    message.frame_end.stages_count = times->count;
    message.frame_end.comparisons = comparisons;
    message.frame_end.comparisons_count = fill_comparisons(comparisons, &frame->result);
    message.frame_end.structure = structure;
    message.frame_end.structure_count = fill_structure(structure, &frame->result);
    session_send(job->session, pending->request, job->channel, &message);
    const struct hub_options *hub = &job->session->hub->options;
    timeline_frame(hub->timeline, &(struct timeline_frame){.client = job->session->number,
                                                           .client_name = job->session->name,
                                                           .job = pending->request,
                                                           .frame = frame->frame,
                                                           .times = times});
    const struct engine_port *engine = &hub->engine;
    engine->report_sent(engine->context, queue_ns, send_ns);
}

/* ---- on the way -------------------------------------------------------------------------------------- */

static void on_begin_sent(void *context, uint64_t begun_ns, uint64_t now_ns)
{
    (void)now_ns;
    struct pending_frame *pending = context;
    pending->begun_ns = begun_ns;
    if (pending->job && pending->job->view)
        view_frame_begun(pending->job, pending->frame, begun_ns);
}

static void on_last_sent(void *context, uint64_t begun_ns, uint64_t now_ns)
{
    (void)begun_ns;
    struct pending_frame *pending = context;
    struct job *job = pending->job;
    if (!job)
        return;
    uint32_t request = pending->request;
    send_end(pending, false, now_ns);
    remove_first(job);
    job_frame_sent(job, request);
}

static bool may_be_abandoned(const struct job *job, const struct pending_frame *pending)
{
    size_t with_kernel_bytes = pending->queued_bytes, waiting_bytes = job->session->connection->out.queued_bytes;
    with_kernel_bytes -= waiting_bytes < with_kernel_bytes ? waiting_bytes : with_kernel_bytes;
    return job->session->can_abandon && pending->begun && view_is_overtaken(job, pending->frame) &&
           view_is_long(job, pending->frame->size_bytes - with_kernel_bytes);
}

void frames_abandon(struct job *job)
{
    struct pending_frame *pending = job->first;
    if (!pending || !may_be_abandoned(job, pending))
        return;
    uint32_t request = pending->request;
    if (!out_queue_drop_unbegun(&job->session->connection->out, request) && pending->queued)
        return; /* the last of it is under way */
    uint64_t now_ns = clock_now_ns();
    bool announced = pending->begun_ns || pending->chunk.references > 1; /* or a part of that is under way */
    if (!pending->begun_ns)
        pending->begun_ns = now_ns;
    if (announced)
        send_end(pending, true, now_ns);
    view_frame_abandoned(job, pending->frame);
    remove_first(job);
    job_frame_abandoned(job, request);
}

static bool queue_begin(struct pending_frame *pending)
{
    struct message message;
    message_init(&message, MESSAGE_FRAME_BEGIN);
    fill_begin(&message.frame_begin, pending->frame);
    struct out_message *out = out_message_create(message_write_bytes(&message));
    if (!out)
        return false;
    struct writer writer;
    writer_init(&writer, out->head, out->head_bytes);
    struct job *job = pending->job;
    if (!message_write(&writer, pending->request, job->channel, &message)) {
        free(out);
        return false;
    }
    out->request = pending->request;
    out->sent = on_begin_sent;
    out->context = pending;
    out->body = &pending->chunk; /* no bytes of it: it keeps the frame alive */
    out_chunk_ref(&pending->chunk);
    pending->begun = true;
    connection_send_raw(job->session->connection, out, true);
    return true;
}

static bool queue_piece(struct pending_frame *pending)
{
    struct job *job = pending->job;
    size_t left_bytes = pending->frame->size_bytes - pending->queued_bytes;
    size_t max_bytes = job->view && !pending->frame->moving ? FRAME_PIECE_AT_REST_BYTES : FRAME_PIECE_BYTES;
    size_t piece_bytes = left_bytes < max_bytes ? left_bytes : max_bytes;
    struct out_message *out = out_message_create(FRAME_DATA_HEAD_BYTES);
    if (!out)
        return false;
    frame_data_head(out->head, pending->request, job->channel, pending->queued_bytes, (uint32_t)piece_bytes);
    out->request = pending->request;
    out->context = pending;
    out->body = &pending->chunk;
    out->body_offset_bytes = pending->queued_bytes;
    out->body_bytes = piece_bytes;
    out->padding_bytes = -piece_bytes & 7;
    out_chunk_ref(&pending->chunk);
    pending->queued_bytes += piece_bytes;
    pending->queued = pending->queued_bytes == pending->frame->size_bytes;
    if (pending->queued)
        out->sent = on_last_sent;
    connection_send_raw(job->session->connection, out, true);
    return true;
}

static bool has_something_to_queue(const struct job *job)
{
    const struct pending_frame *pending = job->first;
    if (!pending || pending->queued)
        return false;
    if (pending->begun)
        return true;
    /* The credit of a view's frame may have been used since by a frame of the replaced view. */
    return job->frames_sent < job->client_credit && (!job->view || view_may_send(job));
}

/* The first job with something to queue moves to the end of the list, so that jobs take turns. */
static struct job *next_job(struct session *session)
{
    struct job **place = &session->jobs;
    while (*place && !has_something_to_queue(*place))
        place = &(*place)->next;
    struct job *job = *place;
    if (!job)
        return NULL;
    *place = job->next;
    job->next = NULL;
    while (*place)
        place = &(*place)->next;
    *place = job;
    return job;
}

/* Frames that waited for the link until they were not worth it any more. */
static void drop_outdated(struct session *session)
{
    for (struct job *job = session->jobs; job; job = job->next) {
        bool dropped = false;
        while (job->view && job->first && !job->first->begun && view_is_outdated(job, job->first->frame)) {
            remove_first(job);
            view_frame_dropped(job);
            job->frames_gone++;
            dropped = true;
        }
        if (dropped)
            job_pace(job);
    }
}

void frames_pump(struct session *session)
{
    struct job *job;
    drop_outdated(session);
    while (connection_wants_bulk(session->connection) && (job = next_job(session))) {
        struct pending_frame *pending = job->first;
        if ((pending->begun || queue_begin(pending)) && queue_piece(pending))
            continue;
        struct error error = {0};
        error_set(&error, ERROR_INTERNAL, NULL, "a frame cannot be sent");
        session_fail(session, &error);
    }
}
