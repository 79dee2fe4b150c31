/* SPDX-License-Identifier: MIT */
/* The loop of requests of the video writer. */
#include "serve.h"
#include "encode.h"
#include "helper/channel.h"
#include "helper/file.h"
#include "helper/incoming.h"

#include <stdio.h>
#include <sys/stat.h>

enum state {
    STATE_IDLE,   /* no video */
    STATE_OPEN,   /* receives frames */
    STATE_FAILED, /* drops further frames: the request has its answer */
};

struct session {
    struct channel channel;
    enum state state;
    uint32_t number; /* number of the request */
    char path[4097], model[4097];
    int fd; /* unfinished file */
    struct video_plan plan;
    struct video_encoder *encoder; /* NULL before the first frame */
    uint32_t width, height;        /* size of the first frame */
    uint32_t frames;
    struct incoming incoming;
};

/* ---- ends ---- */

static void drop_video(struct session *session)
{
    video_encoder_destroy(session->encoder);
    session->encoder = NULL;
    incoming_finish(&session->incoming);
    if (session->fd >= 0)
        file_abandon(session->fd);
    session->fd = -1;
}

/* Removes the video and sends the failure as its answer. */
static bool fail(struct session *session, const struct video_failure *failure)
{
    drop_video(session);
    session->state = STATE_FAILED;
    return channel_send_failure(
        &session->channel, session->number,
        &(struct channel_failure){.field = failure->field,
                                  .reason = failure->reason,
                                  .remedy = failure->remedy,
                                  .retryable = failure->lacks_space || file_lacked_space()});
}

/* ---- beginning ---- */

static bool begin_video(struct session *session, uint32_t number, const struct message_video_begin *wanted)
{
    struct video_failure failure = {.field = ""};
    if (session->state != STATE_IDLE)
        return false;
    session->state = STATE_OPEN;
    session->number = number;
    session->frames = 0;
    snprintf(session->path, sizeof(session->path), "%s", wanted->path);
    snprintf(session->model, sizeof(session->model), "%s", wanted->model);
    if (!video_plan(&session->plan, wanted, &failure))
        return fail(session, &failure);
    session->fd = file_begin(session->path, failure.reason, sizeof(failure.reason));
    if (session->fd < 0) {
        failure.field = "path";
        return fail(session, &failure);
    }
    struct message message = {.type = MESSAGE_VIDEO_BEGUN};
    message.video_begun.temporary = file_temporary_name();
    message.video_begun.encoder = session->plan.encoder;
    return channel_send(&session->channel, number, &message);
}

/* ---- frames ---- */

static bool check_frame(const struct session *session, const struct message_frame_begin *begin,
                        struct video_failure *failure)
{
    if (begin->format != PROTOCOL_PIXEL_FORMAT_RGBA8)
        return video_fail(failure, "format", "render with the pixel format rgba8",
                          "a video cannot store %s pixels", protocol_pixel_format_text(begin->format));
    if (begin->layers != 1u << PROTOCOL_LAYER_BEAUTY)
        return video_fail(failure, "layers", "render without layers", "a video can store only the picture");
    if (session->frames > 0 && (begin->width != session->width || begin->height != session->height))
        return video_fail(failure, "size", "all frames of a video must have the size of the first",
                          "frame %u has %ux%u pixels, but the video has %ux%u", begin->frame, begin->width,
                          begin->height, session->width, session->height);
    return video_plan_allows(&session->plan, begin->width, begin->height, failure);
}

static bool begin_frame(struct session *session, const struct message_frame_begin *begin)
{
    struct video_failure failure = {.field = ""};
    const bool is_open = session->state == STATE_OPEN;
    const bool is_good = is_open && check_frame(session, begin, &failure);
    if (!incoming_begin(&session->incoming, begin, is_good))
        return false;
    if (is_open && is_good && !session->incoming.pixels)
        video_fail(&failure, "size", "render smaller frames", "no memory for a picture of %ux%u", begin->width,
                   begin->height);
    else if (is_good || !is_open)
        return true;
    if (!fail(session, &failure))
        return false;
    /* The rest of this frame is still received and counted. */
    return incoming_begin(&session->incoming, begin, false);
}

static bool encode_frame(struct session *session, struct video_failure *failure)
{
    const struct incoming *incoming = &session->incoming;
    if (!session->encoder) {
        session->width = incoming->begin.width;
        session->height = incoming->begin.height;
        const struct video_source source = {
            .width = session->width, .height = session->height, .model = session->model, .fd = session->fd};
        session->encoder = video_encoder_create(&session->plan, &source, failure);
    }
    return session->encoder && video_encoder_write(session->encoder, incoming->pixels, failure);
}

static bool end_frame(struct session *session)
{
    struct video_failure failure = {.field = ""};
    struct incoming *incoming = &session->incoming;
    if (!incoming->begun)
        return false;
    if (session->state == STATE_OPEN && !incoming_is_whole(incoming)) {
        video_fail(&failure, "frame", "send all of its bytes", "frame %u ended after %llu of %llu bytes",
                   incoming->begin.frame, (unsigned long long)incoming->received_bytes,
                   (unsigned long long)incoming->begin.size_bytes);
        return fail(session, &failure);
    }
    if (session->state == STATE_OPEN && !encode_frame(session, &failure))
        return fail(session, &failure);
    session->frames++;
    incoming_finish(incoming);
    return true;
}

/* ---- the file's end ---- */

static bool finish_video(struct session *session, struct video_failure *failure)
{
    struct stat status = {0};
    struct message message = {.type = MESSAGE_VIDEO_WRITTEN};
    if (!video_encoder_finish(session->encoder, failure))
        return fail(session, failure);
    const int fd = session->fd;
    fstat(fd, &status);
    session->fd = -1;
    if (!file_finish(fd, session->path, failure->reason, sizeof(failure->reason))) {
        failure->field = "path";
        return fail(session, failure);
    }
    message.video_written.frames = session->frames;
    message.video_written.size_bytes = (uint64_t)status.st_size;
    video_encoder_size(session->encoder, &message.video_written.width, &message.video_written.height);
    drop_video(session);
    return channel_send(&session->channel, session->number, &message);
}

static bool end_video(struct session *session, const struct message_video_end *end)
{
    struct video_failure failure = {.field = "", .remedy = NULL};
    bool good = true;
    if (session->state == STATE_OPEN && session->frames != end->frames) {
        video_fail(&failure, "frames", "send every frame complete, and the number of frames at the end",
                   "%u frames were announced, but %u came", end->frames, session->frames);
        good = fail(session, &failure);
    } else if (session->state == STATE_OPEN && session->frames == 0) {
        video_fail(&failure, "frames", "render at least one frame", "a video needs at least one frame");
        good = fail(session, &failure);
    } else if (session->state == STATE_OPEN) {
        good = finish_video(session, &failure);
    }
    drop_video(session);
    session->state = STATE_IDLE;
    return good;
}

static bool handle(void *user, uint32_t number, const struct message *message)
{
    struct session *session = user;
    if (message->type == MESSAGE_VIDEO_BEGIN)
        return begin_video(session, number, &message->video_begin);
    if (session->state == STATE_IDLE || number != session->number)
        return false;
    switch (message->type) {
    case MESSAGE_FRAME_BEGIN:
        return begin_frame(session, &message->frame_begin);
    case MESSAGE_FRAME_DATA:
        return incoming_take(&session->incoming, &message->frame_data);
    case MESSAGE_FRAME_END:
        return end_frame(session);
    case MESSAGE_VIDEO_END:
        return end_video(session, &message->video_end);
    default:
        return false;
    }
}

bool video_serve(int fd)
{
    struct session session = {.fd = -1};
    session.channel = (struct channel){.fd = fd, .program = "farlight-video", .handle = handle, .user = &session};
    const bool good = channel_run(&session.channel);
    drop_video(&session);
    return good;
}
