/* SPDX-License-Identifier: MIT */
/* A batch job: started, its frames taken one after the other, ended. */
#include "lib/frame.h"
#include "lib/scene.h"
#include "protocol/common/clock.h"

#include <limits.h>
#include <stdlib.h>

#define CANCEL_NS 10000000000ull
#define DEFAULT_FRAMES_IN_FLIGHT 2u

struct fl_job {
    struct fl_connection *connection;
    uint32_t request, channel;
    uint64_t credit;     /* frames that the daemon may have sent by now */
    uint64_t next_frame; /* 64 bits: one step beyond the last cannot wrap */
    uint32_t last_frame, frame_step;
    bool answered;           /* the daemon has given its one answer: nothing more comes */
    struct fl_error failure; /* why it ended early; code NONE: it did not */
    struct fl_assembly assembly;
    struct fl_frame_queue done; /* that nobody has asked for yet */
};

void fl_job_fill_render(struct message_render *render, const struct fl_job_options *options)
{
    const unsigned default_quality = options->encoding == PROTOCOL_ENCODING_JPEG   ? 90
                                     : options->encoding == PROTOCOL_ENCODING_H264 ? 80
                                                                                   : 1;
    render->width = options->width > 0 ? options->width : 1280;
    render->height = options->height > 0 ? options->height : 720;
    render->samples = options->samples > 0 ? options->samples : 1;
    render->depth = options->depth == 0 ? 8 : options->depth < 0 ? 0 : (uint32_t)options->depth;
    render->seed = options->seed;
    render->first_frame = options->first_frame;
    render->last_frame = options->last_frame;
    render->frame_step = options->frame_step > 0 ? options->frame_step : 1;
    render->frames_per_second = options->frames_per_second > 0 ? options->frames_per_second : 24;
    render->time_origin_frame = options->time_origin_frame;
    render->tracer = options->tracer;
    render->bvh_bounds = options->bvh_bounds;
    render->integrator = options->integrator;
    render->primary = options->primary;
    render->tone_map = options->tone_map;
    render->exposure_stops = options->exposure_stops;
    render->format = options->format;
    render->encoding = options->encoding;
    render->quality = options->quality > 0 ? options->quality : default_quality;
    render->camera_path = options->camera_path;
    render->camera_node = options->camera_node;
    render->orbit_turn = options->orbit_turn;
    render->orbit_seconds = options->orbit_seconds;
    render->compare = options->compare ? 1 : 0;
    render->compare_with = options->compare_with;
    render->compare_far = options->compare_far;
    render->aperture = options->aperture;
    render->focus = options->focus;
    render->shutter = options->shutter;
    render->pixel_filter = options->pixel_filter;
    render->bvh_rays_together = options->bvh_rays_together;
    render->accumulate = options->accumulate ? 1 : 0;
    render->ldc_resolution = options->ldc_resolution;
    render->ldc_block = options->ldc_block;
    render->ldc_build = options->ldc_build;
    render->ldc_levels = options->ldc_levels;
    render->ldc_images = options->ldc_images;
    render->ldc_tolerance = options->ldc_tolerance;
    render->ldc_rays_together = options->ldc_rays_together;
    render->abuffer_resolution = options->abuffer_resolution;
    render->abuffer_voxels = options->abuffer_voxels;
    render->abuffer_search = options->abuffer_search;
    render->brdf = options->brdf;
    render->ao_distance = options->ao_distance;
    render->ao_falloff = options->ao_falloff;
    render->ao_rays = options->ao_rays;
    render->layer_opacity = options->layer_opacity;
    render->layers = options->layers;
    render->clips = (struct record_clip_use *)(uintptr_t)options->clips; /* only read */
    render->clips_count = (uint32_t)options->clip_count;
    render->keys = (struct record_camera_key *)(uintptr_t)options->keys; /* only read */
    render->keys_count = (uint32_t)options->key_count;
    render->credit = options->frames_in_flight > 0 ? options->frames_in_flight : DEFAULT_FRAMES_IN_FLIGHT;
}

struct fl_job *fl_render_start(struct fl_scene *scene, const struct fl_job_options *options,
                               struct fl_error *error)
{
    struct fl_connection *connection = scene->connection;
    if (connection->job) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "another job runs on this connection");
        return NULL;
    }
    if ((options->layers & ~FL_LAYERS_PICTURE) != 0 &&
        (options->format != PROTOCOL_PIXEL_FORMAT_RGBA32F || options->encoding == PROTOCOL_ENCODING_JPEG)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "layers",
                     "need the pixel format rgba32f and the encoding raw or zstd");
        return NULL;
    }
    struct fl_job *job = calloc(1, sizeof(*job));
    if (!job) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    struct message message = {.type = MESSAGE_RENDER};
    struct message_render *render = &message.render;
    fl_job_fill_render(render, options);
    job->connection = connection;
    job->request = fl_connection_next_request(connection);
    job->channel = ++connection->last_channel;
    job->credit = render->credit;
    job->next_frame = render->first_frame;
    job->last_frame = render->last_frame;
    job->frame_step = render->frame_step;
    job->assembly.expected = (struct fl_frame_expected){
        .width = render->width,
        .height = render->height,
        .format = render->format,
        .encoding = render->encoding,
        .layers = render->layers != 0 ? render->layers : FL_LAYERS_PICTURE,
    };
    render->scene = scene->scene;
    render->channel = job->channel;
    if (!fl_frame_queue_init(&job->done, render->credit, error) ||
        !fl_connection_send(connection, job->request, 0, &message, error)) {
        fl_frame_queue_finish(&job->done);
        free(job);
        return NULL;
    }
    connection->job = job;
    return job;
}

/* One more frame may come for the one that was taken. */
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

/* One message of the job's. */
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

int fl_job_take(struct fl_job *job, const struct framing_header *header, const struct message *message,
                struct fl_error *error)
{
    struct fl_error why = {0};
    if (header->request != job->request)
        return 0;
    /* What still comes of a job that was given up is dropped. */
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
    while (job->done.count == 0 && !job->answered && job->failure.code == FL_ERROR_NONE) {
        struct fl_received ignored; /* a late answer to something given up */
        if (!fl_connection_check(job->connection, error) ||
            fl_connection_step(job->connection, &ignored, deadline_ns, error) == FL_STEP_FAILED) {
            if (error->code == FL_ERROR_TIMEOUT)
                *error = (struct fl_error){0};
            return NULL; /* a frame that has begun is kept: neither is an end */
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
    job->answered = true; /* whatever still comes is dropped by request */
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
    job->connection->job = NULL;
    free(job);
}
