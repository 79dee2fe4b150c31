/* SPDX-License-Identifier: MIT */
/* Talking to a helper program that receives frames. */
#include "lib/helper.h"
#include "protocol/common/clock.h"

#include <stdio.h>
#include <string.h>

/* A file on a slow disk may take long; a program that hangs must not block us for ever. */
#define ANSWER_NS 300000000000ull
#define PIECE_BYTES 262144u

bool fl_helper_start(struct fl_helper *helper, const char *const *arguments, struct fl_error *error)
{
    int fd = -1;
    helper->stream.fd = -1;
    return fl_process_start(&helper->process, helper->program, FL_WIRING_DESCRIPTOR, arguments, &fd, error) &&
           fl_stream_init(&helper->stream, fd, MESSAGE_FROM_SERVER | MESSAGE_FROM_LOCAL, helper->what, error);
}

void fl_helper_finish(struct fl_helper *helper)
{
    fl_stream_finish(&helper->stream);
    fl_process_end(&helper->process, 5000);
}

static bool explain(struct fl_helper *helper, struct fl_error *error)
{
    char words[520];
    helper->lost = true;
    fl_process_last_words(&helper->process, 1000, words, sizeof(words));
    return fl_error_set(error, FL_ERROR_SYSTEM, helper->program, "%s failed%s%s", helper->what,
                        words[0] != '\0' ? ": " : "", words);
}

static bool serve(struct fl_helper *helper, struct fl_error *error)
{
    struct pollfd polled = {.fd = helper->stream.fd, .events = fl_stream_events(&helper->stream)};
    const uint64_t answer_ns = helper->answer_ns > 0 ? helper->answer_ns : ANSWER_NS;
    if (helper->stream.ended)
        return explain(helper, error);
    if (!fl_wait(&polled, 1, helper->interrupt_fd, monotonic_now_ns() + answer_ns, error))
        return false;
    return fl_stream_transfer(&helper->stream, error) || explain(helper, error);
}

bool fl_helper_send(struct fl_helper *helper, const struct message *message, struct fl_error *error)
{
    while (!fl_stream_has_room(&helper->stream))
        if (!serve(helper, error))
            return false;
    return fl_stream_push(&helper->stream, helper->request, 0, message, error) &&
           (fl_stream_transfer(&helper->stream, error) || explain(helper, error));
}

bool fl_helper_flush(struct fl_helper *helper, struct fl_error *error)
{
    while (fl_stream_has_output(&helper->stream))
        if (!serve(helper, error))
            return false;
    return true;
}

enum fl_stream_result fl_helper_poll(struct fl_helper *helper, struct message *message, struct fl_error *error)
{
    for (;;) {
        struct frame frame;
        const enum fl_stream_result result = fl_stream_next(&helper->stream, &frame, message, error);
        if (result != FL_STREAM_MESSAGE || frame.header.request == helper->request)
            return result;
    }
}

bool fl_helper_receive(struct fl_helper *helper, struct message *message, struct fl_error *error)
{
    for (;;) {
        const enum fl_stream_result result = fl_helper_poll(helper, message, error);
        if (result != FL_STREAM_NOTHING)
            return result == FL_STREAM_MESSAGE;
        if (!serve(helper, error))
            return false;
    }
}

/* ---- frames ---- */

static void describe(struct message_frame_begin *begin, const struct fl_frame *frame)
{
    begin->frame = frame->frame;
    begin->width = frame->width;
    begin->height = frame->height;
    begin->samples = frame->samples;
    begin->noise = frame->noise;
    begin->revision = frame->revision;
    begin->size_bytes = frame->pixels_bytes;
    begin->format = frame->format;
    begin->encoding = PROTOCOL_ENCODING_RAW;
    begin->tracer = frame->tracer;
    begin->integrator = frame->integrator;
    begin->digest = frame->digest;
    begin->exposure_stops = frame->exposure_stops;
    memcpy(begin->world_from_view, frame->world_from_view, sizeof(begin->world_from_view));
    begin->fov_y = frame->fov_y;
    begin->ortho_height = frame->ortho_height;
    begin->time_s = frame->time_s;
    begin->aperture = frame->aperture;
    begin->focus = frame->focus;
    begin->shutter_s = frame->shutter_s;
    begin->layers = frame->layers;
}

static void describe_costs(struct message_frame_end *end, const struct fl_frame *frame)
{
    end->frame = frame->frame;
    end->primary_rays = frame->primary_rays;
    end->shadow_rays = frame->shadow_rays;
    end->secondary_rays = frame->secondary_rays;
    end->splits = frame->splits;
    end->device_waits = frame->device_waits;
    end->dispatches = frame->dispatches;
    end->barriers = frame->barriers;
    end->uploaded_bytes = frame->uploaded_bytes;
    end->structure_bytes = frame->structure_bytes;
    end->stages = frame->stages;
    end->stages_count = (uint32_t)frame->stage_count;
    end->structure = frame->structure;
    end->structure_count = (uint32_t)frame->structure_count;
}

static bool send_pixels(struct fl_helper *helper, const struct fl_frame *frame, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_FRAME_DATA};
    for (size_t sent = 0; sent < frame->pixels_bytes; sent += message.frame_data.data_bytes) {
        const size_t left = frame->pixels_bytes - sent;
        message.frame_data.offset_bytes = sent;
        message.frame_data.data = frame->pixels + sent;
        message.frame_data.data_bytes = left < PIECE_BYTES ? (uint32_t)left : PIECE_BYTES;
        if (!fl_helper_send(helper, &message, error))
            return false;
    }
    return true;
}

bool fl_helper_send_frame(struct fl_helper *helper, const struct fl_frame *frame, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_FRAME_BEGIN};
    describe(&message.frame_begin, frame);
    if (!fl_helper_send(helper, &message, error) || !send_pixels(helper, frame, error))
        return false;
    message = (struct message){.type = MESSAGE_FRAME_END};
    describe_costs(&message.frame_end, frame);
    return fl_helper_send(helper, &message, error);
}

void fl_shorten_path(const char *path, char *out, size_t out_bytes)
{
    const size_t length = strlen(path);
    const bool is_long = length >= out_bytes;
    snprintf(out, out_bytes, "%s%s", is_long ? "..." : "", path + (is_long ? length - out_bytes + 4 : 0));
}
