/* SPDX-License-Identifier: MIT */
/* The exporter program as seen from here: frames go in, one answer a file comes back. */
#include "lib/connection.h"
#include "lib/text.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A file on a slow disk may take long; a program that hangs must not hold us for ever. */
#define WRITE_NS 300000000000ull
#define PIECE_BYTES 262144u

struct fl_exporter {
    struct fl_stream stream;
    struct fl_process process;
    int interrupt_fd;
    uint32_t last_request;
    bool waiting; /* the answer for last_request has not come */
    char model[4096];
    char path[160]; /* of the request, or its end: names the file at fault */
};

struct fl_exporter *fl_exporter_start(const struct fl_exporter_options *options, struct fl_error *error)
{
    struct fl_exporter *exporter = calloc(1, sizeof *exporter);
    if (exporter == NULL) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    exporter->stream.fd = -1;
    exporter->interrupt_fd = options->interrupt_fd;
    fl_text_utf8(options->model != NULL ? options->model : "", exporter->model, sizeof exporter->model);
    char rate[32];
    snprintf(rate, sizeof rate, "%.9g", (double)options->frames_per_second);
    const char *const arguments[] = {"--folder", options->folder, options->frames_per_second > 0 ? "--fps" : NULL,
                                     rate, NULL};
    int fd = -1;
    if (!fl_process_start(&exporter->process, "farlight-export", FL_WIRING_DESCRIPTOR, arguments, &fd, error) ||
        !fl_stream_init(&exporter->stream, fd, MESSAGE_FROM_SERVER, "the exporter", error)) {
        fl_exporter_destroy(exporter);
        return NULL;
    }
    return exporter;
}

static bool explain(struct fl_exporter *exporter, struct fl_error *error)
{
    char words[520];
    exporter->waiting = false;
    fl_process_last_words(&exporter->process, 1000, words, sizeof words);
    return fl_error_set(error, FL_ERROR_SYSTEM, "farlight-export", "the image writer gave up%s%s",
                        words[0] != '\0' ? ": " : "", words);
}

static bool serve(struct fl_exporter *exporter, struct fl_error *error)
{
    struct pollfd polled = {.fd = exporter->stream.fd, .events = fl_stream_events(&exporter->stream)};
    if (exporter->stream.ended)
        return explain(exporter, error);
    if (!fl_wait(&polled, 1, exporter->interrupt_fd, fl_now_ns() + WRITE_NS, error))
        return false;
    return fl_stream_transfer(&exporter->stream, error) || explain(exporter, error);
}

static bool send_message(struct fl_exporter *exporter, const struct message *message, struct fl_error *error)
{
    while (!fl_stream_has_room(&exporter->stream))
        if (!serve(exporter, error))
            return false;
    return fl_stream_push(&exporter->stream, exporter->last_request, 0, message, error) &&
           (fl_stream_transfer(&exporter->stream, error) || explain(exporter, error));
}

bool fl_exporter_wait(struct fl_exporter *exporter, struct fl_error *error)
{
    while (exporter->waiting) {
        struct frame frame;
        struct message message;
        const enum fl_stream_result result = fl_stream_next(&exporter->stream, &frame, &message, error);
        if (result == FL_STREAM_ERROR)
            return false;
        if (result == FL_STREAM_NOTHING) {
            if (!serve(exporter, error))
                return false;
            continue;
        }
        if (frame.header.request != exporter->last_request)
            continue;
        exporter->waiting = false;
        if (message.type != MESSAGE_OK && message.type != MESSAGE_ERROR)
            return fl_error_set(error, FL_ERROR_PROTOCOL, "farlight-export", "a file is not answered by %s",
                                message_type_text(message.type));
        if (message.type == MESSAGE_ERROR) {
            fl_error_from_message(error, &message.error);
            error->code = FL_ERROR_FILE;
            memcpy(error->field, exporter->path, sizeof error->field);
            return false;
        }
    }
    return true;
}

static void describe(struct message_frame_begin *begin, const struct fl_frame *frame)
{
    begin->frame = frame->frame;
    begin->width = frame->width;
    begin->height = frame->height;
    begin->samples = frame->samples;
    begin->revision = frame->revision;
    begin->size_bytes = frame->pixels_bytes;
    begin->format = frame->format;
    begin->encoding = PROTOCOL_ENCODING_RAW;
    begin->tracer = frame->tracer;
    begin->integrator = frame->integrator;
    begin->digest = frame->digest;
    begin->exposure_stops = frame->exposure_stops;
    memcpy(begin->world_from_view, frame->world_from_view, sizeof begin->world_from_view);
    begin->fov_y = frame->fov_y;
    begin->ortho_height = frame->ortho_height;
    begin->time_s = frame->time_s;
}

static void describe_costs(struct message_frame_end *end, const struct fl_frame *frame)
{
    end->frame = frame->frame;
    end->primary_rays = frame->primary_rays;
    end->shadow_rays = frame->shadow_rays;
    end->secondary_rays = frame->secondary_rays;
    end->splits = frame->splits;
    end->uploaded_bytes = frame->uploaded_bytes;
    end->structure_bytes = frame->structure_bytes;
    end->stages = frame->stages;
    end->stages_count = (uint32_t)frame->stage_count;
}

static bool send_pixels(struct fl_exporter *exporter, const struct fl_frame *frame, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_FRAME_DATA};
    for (size_t sent = 0; sent < frame->pixels_bytes; sent += message.frame_data.data_bytes) {
        const size_t left = frame->pixels_bytes - sent;
        message.frame_data.offset_bytes = sent;
        message.frame_data.data = frame->pixels + sent;
        message.frame_data.data_bytes = left < PIECE_BYTES ? (uint32_t)left : PIECE_BYTES;
        if (!send_message(exporter, &message, error))
            return false;
    }
    return true;
}

bool fl_exporter_write(struct fl_exporter *exporter, const struct fl_frame *frame,
                       const struct fl_export_options *options, struct fl_error *error)
{
    if (!fl_exporter_wait(exporter, error))
        return false;
    struct message message = {.type = MESSAGE_EXPORT_IMAGE};
    message.export_image.half = options->half ? 1 : 0;
    message.export_image.quality = options->quality > 0 ? options->quality : 95;
    message.export_image.path = options->path;
    message.export_image.format = options->format != NULL ? options->format : "";
    message.export_image.model = exporter->model;
    const size_t length = strlen(options->path);
    const bool is_long = length >= sizeof exporter->path;
    snprintf(exporter->path, sizeof exporter->path, "%s%s", is_long ? "..." : "",
             options->path + (is_long ? length - sizeof exporter->path + 4 : 0));
    exporter->last_request++;
    exporter->waiting = true;
    if (!send_message(exporter, &message, error))
        return false;
    message = (struct message){.type = MESSAGE_FRAME_BEGIN};
    describe(&message.frame_begin, frame);
    if (!send_message(exporter, &message, error) || !send_pixels(exporter, frame, error))
        return false;
    message = (struct message){.type = MESSAGE_FRAME_END};
    describe_costs(&message.frame_end, frame);
    if (!send_message(exporter, &message, error))
        return false;
    /* What still lies in our buffer must reach the program while the caller does other things. */
    while (fl_stream_has_output(&exporter->stream))
        if (!serve(exporter, error))
            return false;
    return true;
}

void fl_exporter_destroy(struct fl_exporter *exporter)
{
    if (exporter == NULL)
        return;
    fl_stream_finish(&exporter->stream);
    fl_process_end(&exporter->process, 5000);
    free(exporter);
}
