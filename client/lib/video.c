/* SPDX-License-Identifier: MIT */
/* The client's side of the video writer: frames go in, an answer at the beginning and one at the end come back. */
#include "lib/helper.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

struct fl_video {
    struct fl_helper helper;
    char folder[4097];
    char path[160];     /* path of the file, or the end of a long one */
    char temporary[65]; /* name of the unfinished file in the folder; empty: none */
    uint32_t frames;    /* sent whole */
    bool ending;        /* video_end is sent */
    bool answered;      /* the writer has ended: nothing more can be sent */
    struct fl_video_info info;
};

/* ---- answers ---- */

static bool take_failure(struct fl_video *video, const struct message *message, struct fl_error *error)
{
    struct fl_error why = {0};
    video->answered = true;
    video->temporary[0] = '\0';
    if (message->type != MESSAGE_ERROR)
        return fl_error_set(error, FL_ERROR_PROTOCOL, video->helper.program,
                            "the answer to a video has the wrong type: %s", message_type_text(message->type));
    fl_error_from_message(&why, &message->error);
    /* Whichever field the writer names, the caller learns that the file is not written. */
    fl_error_set(error, FL_ERROR_FILE, video->path, "%s", why.text);
    error->retryable = why.retryable;
    return fl_error_remedy(error, "%s", why.remedy);
}

static bool is_temporary_name(const char *name)
{
    static const char prefix[] = ".farlight-";
    return strncmp(name, prefix, sizeof(prefix) - 1) == 0 && !strchr(name, '/');
}

static bool await_begun(struct fl_video *video, struct fl_error *error)
{
    struct message message;
    if (!fl_helper_receive(&video->helper, &message, error))
        return false;
    if (message.type != MESSAGE_VIDEO_BEGUN)
        return take_failure(video, &message, error);
    snprintf(video->info.encoder, sizeof(video->info.encoder), "%s", message.video_begun.encoder);
    if (is_temporary_name(message.video_begun.temporary))
        snprintf(video->temporary, sizeof(video->temporary), "%s", message.video_begun.temporary);
    return true;
}

/* Checks for an answer before anything is sent: the writer may have failed already. */
static bool check(struct fl_video *video, struct fl_error *error)
{
    struct message message;
    if (video->answered)
        return fl_error_set(error, FL_ERROR_ARGUMENT, video->path, "this video has ended");
    const enum fl_stream_result result = fl_helper_poll(&video->helper, &message, error);
    if (result == FL_STREAM_MESSAGE)
        return take_failure(video, &message, error);
    return result == FL_STREAM_NOTHING;
}

/* ---- beginning ---- */

/* The only folder that the writer may write to. */
static bool set_folder(struct fl_video *video, const char *path, struct fl_error *error)
{
    const char *slash = strrchr(path, '/');
    const size_t length = !slash || slash == path ? 1 : (size_t)(slash - path);
    if (length >= sizeof(video->folder))
        return fl_error_set(error, FL_ERROR_FILE, "", "the path of the video is too long");
    memcpy(video->folder, !slash ? "." : path, length);
    video->folder[length] = '\0';
    return true;
}

/* A value that no message can hold is reported with the message's field, which has the option's name. Returns
 * false. */
static bool name_option(struct fl_error *error)
{
    static const char prefix[] = "video_begin.";
    const size_t skipped = sizeof(prefix) - 1;
    if (error && strncmp(error->field, prefix, skipped) == 0) {
        memmove(error->field, error->field + skipped, strlen(error->field) - skipped + 1);
        error->code = FL_ERROR_ARGUMENT;
    }
    return false;
}

static bool send_begin(struct fl_video *video, const struct fl_video_options *options, struct fl_error *error)
{
    char model[4096];
    struct message message = {.type = MESSAGE_VIDEO_BEGIN};
    struct message_video_begin *begin = &message.video_begin;
    fl_text_utf8(options->model ? options->model : "", model, sizeof(model));
    begin->quality = options->quality;
    begin->lossless = options->lossless ? 1 : 0;
    begin->frames_per_second = options->frames_per_second > 0 ? options->frames_per_second : 24;
    begin->path = options->path;
    begin->format = options->format ? options->format : "";
    begin->codec = options->codec ? options->codec : "";
    begin->model = model;
    if (!fl_helper_send(&video->helper, &message, error))
        return name_option(error);
    return fl_helper_flush(&video->helper, error) && await_begun(video, error);
}

/* The writer loads what that needs before it enters its sandbox. */
static bool is_gif(const struct fl_video_options *options)
{
    const char *dot = strrchr(options->path, '.');
    return (dot && strcasecmp(dot, ".gif") == 0) || (options->format && strcmp(options->format, "gif") == 0);
}

struct fl_video *fl_video_start(const struct fl_video_options *options, struct fl_error *error)
{
    struct fl_video *video = calloc(1, sizeof(*video));
    if (!video) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    video->helper = (struct fl_helper){.stream = {.fd = -1},
                                       .process = {.talk_fd = -1},
                                       .program = "farlight-video",
                                       .what = "the video writer",
                                       .interrupt_fd = options->interrupt_fd,
                                       .request = 1};
    fl_shorten_path(options->path, video->path, sizeof(video->path));
    const char *const arguments[] = {"--folder", video->folder, is_gif(options) ? "--gif" : NULL, NULL};
    if (!set_folder(video, options->path, error) || !fl_helper_start(&video->helper, arguments, error) ||
        !send_begin(video, options, error)) {
        fl_video_destroy(video);
        return NULL;
    }
    return video;
}

/* ---- frames ---- */

bool fl_video_write(struct fl_video *video, const struct fl_frame *frame, struct fl_error *error)
{
    if (frame->pixels_bytes != (size_t)frame->width * frame->height * fl_bytes_per_pixel(frame->format))
        return fl_error_set(error, FL_ERROR_ARGUMENT, "size", "%ux%u pixels are not %zu bytes", frame->width,
                            frame->height, frame->pixels_bytes);
    if (video->ending)
        return fl_error_set(error, FL_ERROR_ARGUMENT, video->path, "this video has ended");
    if (!check(video, error) || !fl_helper_send_frame(&video->helper, frame, error))
        return false;
    video->frames++; /* the frame arrives complete, even if the call is interrupted now */
    return fl_helper_flush(&video->helper, error);
}

bool fl_video_finish(struct fl_video *video, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_VIDEO_END};
    if (!video->ending) {
        if (!check(video, error))
            return false;
        message.video_end.frames = video->frames;
        if (!fl_helper_send(&video->helper, &message, error))
            return false;
        video->ending = true; /* also if the wait is interrupted: it can be resumed */
    } else if (video->answered) {
        return check(video, error);
    }
    if (!fl_helper_receive(&video->helper, &message, error))
        return false;
    if (message.type != MESSAGE_VIDEO_WRITTEN)
        return take_failure(video, &message, error);
    video->answered = true;
    video->temporary[0] = '\0';
    video->info.frames = message.video_written.frames;
    video->info.width = message.video_written.width;
    video->info.height = message.video_written.height;
    video->info.size_bytes = message.video_written.size_bytes;
    return true;
}

const struct fl_video_info *fl_video_info(const struct fl_video *video)
{
    return &video->info;
}

void fl_video_set_interrupt(struct fl_video *video, int interrupt_fd)
{
    video->helper.interrupt_fd = interrupt_fd;
}

void fl_video_destroy(struct fl_video *video)
{
    if (!video)
        return;
    fl_helper_finish(&video->helper);
    /* The writer removes an unfinished file itself, unless it was killed. */
    if (video->temporary[0] != '\0') {
        char path[sizeof(video->folder) + sizeof(video->temporary) + 1];
        snprintf(path, sizeof(path), "%s/%s", video->folder, video->temporary);
        unlink(path);
    }
    free(video);
}
