/* SPDX-License-Identifier: MIT */
#include "session/frames.h"

#include "base/clock.h"
#include "base/timeline.h"
#include "session/frame_messages.h"
#include "session/jobs.h"
#include "session/session.h"
#include "session/views.h"

#include <stdlib.h>
#include <string.h>

/* A frame from the engine, kept until the last message that refers to its bytes is gone. */
struct pending_frame {
    struct out_chunk chunk; /* first: release() gets its address */
    struct pending_frame *next;
    struct job *job;  /* NULL: dropped */
    uint32_t request; /* the job's request, or that of a view that the job has replaced */
    struct engine_frame *frame;
    struct hub *counted_by; /* counts its bytes apart from the job's; NULL: they count as the job's */
    bool begun;
    bool queued;      /* whether the connection has all bytes up to end_bytes */
    size_t end_bytes; /* bytes to send: all, or fewer where the frame is cut */
    /* Bytes given to the connection; bytes accepted by the kernel, in complete chunks. */
    size_t queued_bytes, sent_bytes;
    uint64_t begun_ns; /* time at which FRAME_BEGIN was handed to the kernel; 0: not yet */
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
    if (pending->counted_by)
        pending->counted_by->frame_bytes -= pending->chunk.size_bytes;
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
        .end_bytes = frame->size_bytes,
    };
    *job->end = pending;
    job->end = &pending->next;
    if (job->view) {
        view_frame_made(job, frame);
        frames_overtake(job);
    }
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

unsigned frames_of_replaced(const struct job *job)
{
    return job->first && job->first->request != job->request;
}

uint64_t frames_bytes_of_replaced(const struct job *job)
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
        begun->counted_by->frame_bytes += begun->chunk.size_bytes;
    }
    return begun->request == job->request;
}

/* ---- messages ---------------------------------------------------------------------------------------- */

static void send_end(struct pending_frame *pending, bool abandoned, uint64_t now_ns)
{
    struct job *job = pending->job;
    struct engine_frame *frame = pending->frame;
    struct stage_times *times = &frame->result.times;
    uint64_t queue_ns = pending->begun_ns > frame->encoded_ns ? pending->begun_ns - frame->encoded_ns : 0;
    uint64_t send_ns = now_ns - pending->begun_ns;
    stage_times_add(times, STAGE_QUEUE, CLOCK_CPU, 0, frame->encoded_ns, queue_ns);
    stage_times_add(times, STAGE_SEND, CLOCK_CPU, 0, pending->begun_ns, send_ns);
    struct record_structure_row rows[STRUCTURE_ROWS_MAX];
    struct message message;
    message_init(&message, MESSAGE_FRAME_END);
    frame_fill_end(&message.frame_end, rows, frame);
    message.frame_end.abandoned = abandoned;
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

/* Bytes of the chunk from there on, within a part; chunks never change. */
static size_t chunk_bytes(const struct pending_frame *pending, size_t from_bytes, bool is_view)
{
    const struct engine_frame *frame = pending->frame;
    const bool in_parts = frame->parts.count > 0;
    const size_t end_bytes = in_parts ? parts_end(&frame->parts, from_bytes + 1) : frame->size_bytes;
    const size_t max_bytes =
        in_parts || (is_view && !frame->moving) ? FRAME_PIECE_AT_REST_BYTES : FRAME_PIECE_BYTES;
    return end_bytes - from_bytes < max_bytes ? end_bytes - from_bytes : max_bytes;
}

static void on_begin_sent(void *context, uint64_t begun_ns, uint64_t now_ns)
{
    (void)now_ns;
    struct pending_frame *pending = context;
    pending->begun_ns = begun_ns;
    if (pending->job && pending->job->view)
        view_frame_begun(pending->job, pending->frame, pending->end_bytes, begun_ns);
}

static void end(struct job *job, struct pending_frame *pending, uint64_t now_ns)
{
    uint32_t request = pending->request;
    send_end(pending, pending->end_bytes < pending->frame->size_bytes, now_ns);
    remove_first(job);
    job_frame_sent(job, request);
}

static void on_piece_sent(void *context, uint64_t begun_ns, uint64_t now_ns)
{
    (void)begun_ns;
    struct pending_frame *pending = context;
    struct job *job = pending->job;
    if (!job)
        return;
    pending->sent_bytes += chunk_bytes(pending, pending->sent_bytes, job->view);
    if (pending->sent_bytes == pending->end_bytes)
        end(job, pending, now_ns);
}

/* ---- overtaken --------------------------------------------------------------------------------------- */

static size_t with_kernel_bytes(const struct job *job, const struct pending_frame *pending)
{
    size_t waiting_bytes = job->session->connection->out.queued_bytes;
    return pending->queued_bytes - (waiting_bytes < pending->queued_bytes ? waiting_bytes : pending->queued_bytes);
}

static void abandon(struct job *job, struct pending_frame *pending)
{
    uint32_t request = pending->request;
    if (!view_is_long(job, pending->frame->size_bytes - with_kernel_bytes(job, pending)))
        return;
    if (!out_queue_drop_unbegun(&job->session->connection->out, request, 0) && pending->queued)
        return; /* its last bytes are under way */
    uint64_t now_ns = clock_now_ns();
    bool announced = pending->begun_ns || pending->chunk.references > 1; /* or FRAME_BEGIN is partly sent */
    if (!pending->begun_ns)
        pending->begun_ns = now_ns;
    if (announced)
        send_end(pending, true, now_ns);
    view_frame_abandoned(job, pending->frame);
    remove_first(job);
    job_frame_abandoned(job, request);
}

/* Whether a later picture waits behind it. */
static bool has_newer(const struct pending_frame *pending)
{
    const struct pending_frame *newer = pending->next;
    while (newer && newer->frame->request.hidden_layer > 0)
        newer = newer->next;
    return newer;
}

/* Earliest end of the frame that leaves its client a picture; 0: there is none. A frame that yields to motion does
 * not wait for a long rest of a part; a moving frame shows something in any case. */
static size_t early_end(const struct job *job, const struct pending_frame *pending, bool yields)
{
    const struct part_list *parts = &pending->frame->parts;
    if (!parts->count)
        return 0;
    size_t begun = out_queue_begun_end(&job->session->connection->out, pending->request);
    begun = begun > pending->sent_bytes ? begun : pending->sent_bytes;
    const size_t needed = parts_needed_bytes(parts), part_end = parts_end(parts, begun);
    const size_t wanted = part_end > needed ? part_end : needed;
    if (!yields || !view_is_long(job, wanted - begun))
        return wanted;
    return begun >= needed ? begun : 0;
}

static void cut(struct job *job, struct pending_frame *pending, size_t end_bytes, bool yields)
{
    out_queue_drop_unbegun(&job->session->connection->out, pending->request, end_bytes);
    pending->end_bytes = end_bytes;
    if (pending->queued_bytes > end_bytes)
        pending->queued_bytes = end_bytes;
    pending->queued = pending->queued_bytes == end_bytes;
    view_frame_cut(job, pending->frame, end_bytes, yields);
    if (pending->sent_bytes == end_bytes)
        end(job, pending, clock_now_ns());
}

void frames_overtake(struct job *job)
{
    struct pending_frame *pending = job->first;
    if (!pending || !pending->begun || pending->end_bytes < pending->frame->size_bytes)
        return;
    const bool yields = view_is_overtaken(job, pending->frame);
    const bool is_behind = pending->frame->moving && has_newer(pending);
    const size_t end_bytes = yields || is_behind ? early_end(job, pending, yields) : 0;
    if (end_bytes && end_bytes < pending->end_bytes)
        cut(job, pending, end_bytes, yields);
    else if (!end_bytes && yields && job->session->can_abandon)
        abandon(job, pending);
}

/* ---- on the way -------------------------------------------------------------------------------------- */

/* Queues a message and copies the records to which it refers. */
static bool queue_message(struct pending_frame *pending, const struct message *message, out_sent_fn *sent)
{
    struct out_message *out = out_message_create(message_write_bytes(message));
    if (!out)
        return false;
    struct writer writer;
    writer_init(&writer, out->head, out->head_bytes);
    struct job *job = pending->job;
    if (!message_write(&writer, pending->request, job->channel, message)) {
        free(out);
        return false;
    }
    out->request = pending->request;
    out->sent = sent;
    out->context = pending;
    out->body = &pending->chunk; /* a reference without bytes, which keeps the frame alive */
    out_chunk_ref(&pending->chunk);
    connection_send_raw(job->session->connection, out, true);
    return true;
}

static bool queue_begin(struct pending_frame *pending)
{
    struct message message;
    struct record_frame_part parts[PARTS_MAX];
    message_init(&message, MESSAGE_FRAME_BEGIN);
    frame_fill_begin(&message.frame_begin, pending->frame);
    if (!queue_message(pending, &message, on_begin_sent))
        return false;
    pending->begun = true;
    if (!pending->frame->parts.count)
        return true;
    message_init(&message, MESSAGE_FRAME_PARTS);
    frame_fill_parts(&message.frame_parts, parts, pending->frame);
    return queue_message(pending, &message, NULL);
}

static bool queue_piece(struct pending_frame *pending)
{
    struct job *job = pending->job;
    size_t piece_bytes = chunk_bytes(pending, pending->queued_bytes, job->view);
    struct out_message *out = out_message_create(FRAME_DATA_HEAD_BYTES);
    if (!out)
        return false;
    frame_data_head(out->head, pending->request, job->channel, pending->queued_bytes, (uint32_t)piece_bytes);
    out->request = pending->request;
    out->sent = on_piece_sent;
    out->context = pending;
    out->body = &pending->chunk;
    out->body_offset_bytes = pending->queued_bytes;
    out->body_bytes = piece_bytes;
    out->padding_bytes = -piece_bytes & 7;
    out_chunk_ref(&pending->chunk);
    pending->queued_bytes += piece_bytes;
    pending->queued = pending->queued_bytes == pending->end_bytes;
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

/* Drops frames that have waited for the link until a newer one is better. */
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
        bool begins = !pending->begun;
        if ((!begins || queue_begin(pending)) && queue_piece(pending)) {
            if (begins && job->view)
                frames_overtake(job); /* a frame may have been overtaken while it waited */
            continue;
        }
        struct error error = {0};
        error_set(&error, ERROR_INTERNAL, NULL, "a frame cannot be sent");
        session_fail(session, &error);
    }
}
