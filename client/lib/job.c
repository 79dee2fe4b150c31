/* SPDX-License-Identifier: MIT */
/* A batch job: started, its frames fetched in order, ended. */
#include "lib/frame.h"
#include "lib/scene.h"
#include "protocol/common/clock.h"

#include <limits.h>
#include <stdlib.h>

#define CANCEL_NS 10000000000ull

struct fl_job {
    struct fl_receiver receiver; /* first */
    struct fl_connection *connection;
    uint32_t request, channel;
    uint64_t credit;     /* frames that the daemon may have sent by now */
    uint64_t next_frame; /* 64 bits: one step beyond the last frame cannot wrap */
    uint32_t last_frame, frame_step;
    bool answered;           /* the daemon has sent its only answer: nothing more follows */
    struct fl_error failure; /* the reason of an early end; code NONE: there was none */
    struct fl_assembly assembly;
    struct fl_frame_queue done; /* frames ready for the caller */
};

static fl_take_fn take_message;

struct message_render fl_render_defaults(void)
{
    struct message message;
    message_init(&message, MESSAGE_RENDER);
    return message.render;
}

struct fl_job *fl_render_start(struct fl_scene *scene, const struct message_render *wanted, struct fl_error *error)
{
    struct fl_connection *connection = scene->connection;
    if (connection->has_job) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "another job runs on this connection");
        return NULL;
    }
    if ((wanted->picture.layers & ~FL_LAYERS_PICTURE) != 0 &&
        (wanted->picture.format != PROTOCOL_PIXEL_FORMAT_RGBA32F || wanted->encoding == PROTOCOL_ENCODING_JPEG)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "layers",
                     "need the pixel format rgba32f and the encoding raw or zstd");
        return NULL;
    }
    struct fl_job *job = calloc(1, sizeof(*job));
    if (!job) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    struct message message = {.type = MESSAGE_RENDER, .render = *wanted};
    struct message_render *render = &message.render;
    job->connection = connection;
    job->request = fl_connection_next_request(connection);
    job->channel = ++connection->last_channel;
    job->credit = render->credit;
    job->next_frame = render->first_frame;
    job->last_frame = render->last_frame;
    job->frame_step = render->frame_step;
    job->assembly.expected = (struct fl_frame_expected){
        .width = render->picture.crop_width > 0 ? render->picture.crop_width
                                                : render->picture.width * render->picture.views_across,
        .height = render->picture.crop_width > 0 ? render->picture.crop_height
                                                 : render->picture.height * render->picture.views_down,
        .format = render->picture.format,
        .encoding = render->encoding,
        .layers = render->picture.layers != 0 ? render->picture.layers : FL_LAYERS_PICTURE,
    };
    render->kind = PROTOCOL_JOB_BATCH;
    render->scene = scene->scene;
    render->channel = job->channel;
    if (!fl_frame_queue_init(&job->done, render->credit, error) ||
        !fl_connection_send(connection, job->request, 0, &message, error)) {
        fl_frame_queue_finish(&job->done);
        free(job);
        return NULL;
    }
    job->receiver.take = take_message;
    connection->has_job = true;
    fl_connection_add(connection, &job->receiver);
    return job;
}

/* Gives credit for the frame that was fetched. */
static bool grant(struct fl_job *job, struct fl_error *error)
{
    struct message credit = {.type = MESSAGE_CREDIT};
    credit.credit.channel = job->channel;
    credit.credit.total = ++job->credit;
    return fl_connection_send(job->connection, 0, 0, &credit, error);
}

/* The job's one answer has come. */
static bool conclude(struct fl_job *job, const struct message *message, struct fl_error *error)
{
    job->answered = true;
    if (message->type == MESSAGE_ERROR)
        return fl_error_from_message(error, &message->error);
    if (job->assembly.frame || job->next_frame <= job->last_frame)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "render", "the job ended before its last frame");
    return true;
}

/* Handles one message of the job. */
static bool take(struct fl_job *job, const struct message *message, struct fl_error *error)
{
    struct fl_frame *frame = NULL;
    switch (message->type) {
    case MESSAGE_FRAME_BEGIN:
        if (job->next_frame > job->last_frame)
            return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_begin", "a frame arrived after the last one");
        return fl_assembly_begin(&job->assembly, &message->frame_begin, (uint32_t)job->next_frame,
                                 monotonic_now_ns(), error);
    case MESSAGE_FRAME_DATA:
        return fl_assembly_data(&job->assembly, &message->frame_data, error);
    case MESSAGE_FRAME_END:
        frame = fl_assembly_end(&job->assembly, &message->frame_end, monotonic_now_ns(), error);
        job->next_frame += job->frame_step;
        return frame && fl_frame_queue_push(&job->done, frame, error);
    case MESSAGE_OK:
    case MESSAGE_ERROR:
        return conclude(job, message, error);
    default:
        return fl_error_set(error, FL_ERROR_PROTOCOL, "render", "the answer to a job has the wrong type: %s",
                            message_type_text(message->type));
    }
}

/* Complete frames are kept until the caller fetches them. */
static int take_message(struct fl_receiver *receiver, const struct framing_header *header,
                        const struct message *message, struct fl_error *error)
{
    struct fl_job *job = (struct fl_job *)receiver;
    struct fl_error why = {0};
    if (header->request != job->request)
        return 0;
    /* Remaining messages of an abandoned job are dropped. */
    if (job->answered || job->failure.code != FL_ERROR_NONE || take(job, message, &why))
        return 1;
    fl_assembly_finish(&job->assembly);
    job->failure = why;
    if (why.code != FL_ERROR_PROTOCOL)
        return 1;
    *error = why;
    return -1;
}

struct fl_frame *fl_render_poll(struct fl_job *job, unsigned timeout_ms, bool *done, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns();
    const uint64_t deadline_ns = timeout_ms < UINT_MAX ? begin_ns + timeout_ms * 1000000ull : UINT64_MAX;
    *error = (struct fl_error){0};
    *done = false;
    /* While frames come faster than the caller takes them, nothing below waits. */
    if (!fl_check_interrupt(job->connection->interrupt_fd, error))
        return NULL;
    while (job->done.count == 0 && !job->answered && job->failure.code == FL_ERROR_NONE) {
        struct fl_received ignored; /* a late answer to something given up */
        if (!fl_connection_check(job->connection, error) ||
            fl_connection_step(job->connection, &ignored, deadline_ns, error) == FL_STEP_FAILED) {
            if (error->code == FL_ERROR_TIMEOUT)
                *error = (struct fl_error){0};
            return NULL; /* a frame that has begun is kept: neither ends the job */
        }
    }
    struct fl_frame *frame = fl_frame_queue_pop(&job->done);
    *done = !frame;
    if (!frame) {
        *error = job->failure;
        return NULL;
    }
    frame->wait_ns = monotonic_now_ns() - begin_ns;
    if (job->next_frame <= job->last_frame && !job->answered && !grant(job, error)) {
        fl_frame_destroy(frame);
        return NULL;
    }
    return frame;
}

struct fl_frame *fl_render_next(struct fl_job *job, struct fl_error *error)
{
    bool done = false;
    return fl_render_poll(job, UINT_MAX, &done, error);
}

bool fl_render_cancel(struct fl_job *job, struct fl_error *error)
{
    struct fl_connection *connection = job->connection;
    fl_assembly_finish(&job->assembly);
    fl_frame_queue_clear(&job->done);
    if (job->answered || job->failure.code != FL_ERROR_NONE)
        return true;
    struct message cancel = {.type = MESSAGE_CANCEL};
    cancel.cancel.target_request = job->request;
    const uint32_t request = fl_connection_next_request(connection);
    const uint64_t deadline_ns = monotonic_now_ns() + CANCEL_NS;
    struct fl_received received;
    job->answered = true; /* remaining messages are dropped by their request */
    fl_connection_send_late(connection, request, &cancel);
    return fl_connection_answer(connection, request, MESSAGE_OK, &received, deadline_ns, error);
}

void fl_render_destroy(struct fl_job *job)
{
    if (!job)
        return;
    struct fl_error ignored;
    if (!job->answered && job->connection->broken.code == FL_ERROR_NONE)
        fl_render_cancel(job, &ignored);
    fl_assembly_finish(&job->assembly);
    fl_frame_queue_finish(&job->done);
    job->connection->has_job = false;
    fl_connection_remove(job->connection, &job->receiver);
    free(job);
}
