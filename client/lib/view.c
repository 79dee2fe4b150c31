/* SPDX-License-Identifier: MIT */
/* A view: cameras go out, frames of the newest one come in and are acknowledged. */
#include "lib/frame.h"
#include "lib/scene.h"
#include "protocol/common/clock.h"
#include "protocol/common/margin.h"

#include <stdlib.h>
#include <string.h>

#define DEFAULT_FRAMES_PER_SECOND 60
#define DEFAULT_SAMPLES 64u
#define DEFAULT_FRAMES_IN_FLIGHT 4u
/* The maximum number of unanswered renders: further ones wait for the daemon. */
#define ASKED_MAX 8u
#define ANSWER_NS 30000000000ull
#define COMMANDS_REMEMBERED 256u /* four seconds of cameras at 60 a second */

/* A render of kind view that the daemon has not answered yet; the newest one counts, frames of earlier ones may
 * still arrive. */
struct asked {
    uint32_t request;
    uint64_t change; /* counted from 0 */
    struct fl_frame_expected expected;
};

struct fl_view {
    struct fl_receiver receiver; /* first */
    struct fl_connection *connection;
    uint32_t scene, channel;
    uint64_t credit;     /* frames that the daemon may have sent by now */
    uint32_t next_frame; /* the minimum number of the next one */
    uint32_t last_frame; /* the last complete frame, .. */
    bool has_frame;      /* .. if there is one */
    bool ack_pending;    /* its acknowledgement, and .. */
    bool credit_pending; /* .. its credit, found no space to be sent */
    struct asked asked[ASKED_MAX];
    size_t asked_count;
    uint64_t changes;
    uint64_t last_command;
    uint64_t command_sent_ns[COMMANDS_REMEMBERED]; /* by number, modulo the size */
    struct fl_error failure; /* why a render was refused; reported once while an older one continues */
    struct fl_assembly assembly;
    uint32_t assembled_request;
    bool delivers_parts; /* parts are delivered as soon as they show something; set by the caller */
    bool delivered;      /* the assembled frame's first parts were delivered */
    bool keeps_jpeg;
    struct fl_frame_queue done; /* frames ready for the caller */
};

/* ---- going out ---- */

struct message_render fl_view_defaults(void)
{
    struct message_render render = fl_render_defaults();
    render.kind = PROTOCOL_JOB_VIEW;
    render.sampling.samples = DEFAULT_SAMPLES;
    render.frames_per_second = DEFAULT_FRAMES_PER_SECOND;
    render.credit = DEFAULT_FRAMES_IN_FLIGHT;
    render.picture.denoise = PROTOCOL_DENOISE_AUTO;
    return render;
}

static void fill_render(struct message_render *render, const struct fl_view *view)
{
    render->kind = PROTOCOL_JOB_VIEW;
    render->scene = view->scene;
    render->channel = view->channel;
    render->credit = (uint32_t)view->done.capacity;
    render->picture.format = PROTOCOL_PIXEL_FORMAT_RGBA8;
    render->first_frame = render->last_frame = 0;
}

/* Sends the credit of the view's channel, which all its requests share. */
static bool grant_credit(struct fl_view *view, struct fl_error *error)
{
    struct message credit = {.type = MESSAGE_CREDIT};
    credit.credit.channel = view->channel;
    credit.credit.total = view->credit;
    return fl_connection_send(view->connection, 0, 0, &credit, error);
}

/* Sends a request on the view's channel. */
static bool ask(struct fl_view *view, const struct message_render *wanted, struct fl_error *error)
{
    struct message message = {.type = MESSAGE_RENDER, .render = *wanted};
    struct message_render *render = &message.render;
    fill_render(render, view);
    const uint32_t eyes = render->picture.views_across * render->picture.views_down;
    struct asked *asked = &view->asked[view->asked_count];
    asked->request = fl_connection_next_request(view->connection);
    asked->change = view->changes;
    asked->expected =
        (struct fl_frame_expected){.width = render->picture.width * render->picture.views_across,
                                   .height = render->picture.height * render->picture.views_down,
                                   .format = render->picture.format,
                                   .encoding = render->encoding,
                                   .still_encoding = render->view.still_encoding,
                                   .layers = FL_LAYERS_PICTURE,
                                   .attachments = render->view.attachments,
                                   .is_view = true,
                                   .margin_x_max = margin_pixels(render->view.margin, render->picture.width),
                                   .hidden_layers = render->view.hidden_layers,
                                   .parts = render->view.parts != 0,
                                   .is_bare_at_rest = render->view.margin > 0 && eyes > 1,
                                   .margin_y_max = margin_pixels(render->view.margin, render->picture.height)};
    if (!fl_connection_send(view->connection, asked->request, 0, &message, error))
        return false;
    view->asked_count++;
    return true;
}

static fl_take_fn take_message;

struct fl_view *fl_view_start(struct fl_scene *scene, const struct message_render *wanted, struct fl_error *error)
{
    struct fl_connection *connection = scene->connection;
    if (connection->has_view) {
        fl_error_set(error, FL_ERROR_ARGUMENT, "", "another view runs on this connection");
        return NULL;
    }
    struct fl_view *view = calloc(1, sizeof(*view));
    if (!view) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
        return NULL;
    }
    view->connection = connection;
    view->scene = scene->scene;
    view->channel = ++connection->last_channel;
    if (!fl_frame_queue_init(&view->done, wanted->credit, error) || !ask(view, wanted, error)) {
        fl_frame_queue_finish(&view->done);
        free(view);
        return NULL;
    }
    view->credit = view->done.capacity;
    view->receiver.take = take_message;
    connection->has_view = true;
    fl_connection_add(connection, &view->receiver);
    return view;
}

/* False, with the reason, if the view can deliver nothing any more. */
static bool check(const struct fl_view *view, struct fl_error *error)
{
    if (!fl_connection_check(view->connection, error))
        return false;
    if (view->asked_count > 0)
        return true;
    *error = view->failure;
    return false;
}

bool fl_view_change(struct fl_view *view, const struct message_render *wanted, struct fl_error *error)
{
    const uint64_t deadline_ns = monotonic_now_ns() + ANSWER_NS;
    if (!check(view, error))
        return false;
    while (view->asked_count == ASKED_MAX) {
        struct fl_received ignored;
        if (fl_connection_step(view->connection, &ignored, deadline_ns, error) == FL_STEP_FAILED)
            return false;
    }
    view->changes++;
    return ask(view, wanted, error) && grant_credit(view, error);
}

bool fl_view_set_camera(struct fl_view *view, const struct fl_view_camera *camera, uint64_t *command,
                        struct fl_error *error)
{
    struct message message = {.type = MESSAGE_VIEW_CAMERA};
    struct message_view_camera *sent = &message.view_camera;
    sent->channel = view->channel;
    sent->command = view->last_command + 1;
    sent->moving = camera->moving ? 1 : 0;
    sent->time_s = camera->time_s;
    memcpy(sent->eye_world, camera->eye_world, sizeof(sent->eye_world));
    memcpy(sent->look_at_world, camera->look_at_world, sizeof(sent->look_at_world));
    memcpy(sent->up_world, camera->up_world, sizeof(sent->up_world));
    sent->fov_y = camera->fov_y;
    sent->node = camera->node;
    const uint64_t now_ns = monotonic_now_ns();
    if (!check(view, error) || !fl_connection_send(view->connection, 0, 0, &message, error))
        return false;
    view->last_command = sent->command;
    view->command_sent_ns[sent->command % COMMANDS_REMEMBERED] = now_ns;
    if (command)
        *command = sent->command;
    return true;
}

static void fill_ack(struct message *message, const struct fl_view *view, uint32_t frame, bool whole)
{
    *message = (struct message){.type = MESSAGE_FRAME_ACK};
    message->frame_ack.channel = view->channel;
    message->frame_ack.frame = frame;
    message->frame_ack.whole = whole ? 1 : 0;
}

bool fl_view_want_key_frame(struct fl_view *view, struct fl_error *error)
{
    struct message message;
    fill_ack(&message, view, view->last_frame, true);
    message.frame_ack.want_key_frame = 1;
    return check(view, error) && (!view->has_frame || fl_connection_send(view->connection, 0, 0, &message, error));
}

/* ---- coming in ---- */

/* Acknowledges before the frame is decoded: the daemon measures the link with it, not our decoder. */
static bool acknowledge(struct fl_view *view, uint32_t frame, bool whole, struct fl_error *error)
{
    struct message message;
    fill_ack(&message, view, frame, whole);
    /* A full buffer holds an upload. An acknowledgement that is not of a whole frame would come too late to be
     * useful. */
    const bool has_room = fl_stream_has_room(&view->connection->stream);
    view->ack_pending = whole ? !has_room : view->ack_pending;
    if (!has_room)
        return true;
    return fl_stream_push(&view->connection->stream, 0, 0, &message, error) &&
           fl_stream_write(&view->connection->stream, error);
}

/* Sends acknowledgements that did not fit before: the daemon may wait for them. */
static bool send_pending(struct fl_view *view, struct fl_error *error)
{
    struct fl_error ignored;
    if (!fl_stream_has_room(&view->connection->stream))
        return true;
    if (view->ack_pending && !acknowledge(view, view->last_frame, true, error))
        return fl_connection_break(view->connection, error);
    view->credit_pending = view->credit_pending && !grant_credit(view, &ignored);
    return true;
}

void fl_view_deliver_parts(struct fl_view *view, bool deliver)
{
    view->delivers_parts = deliver;
}

void fl_view_keep_jpeg(struct fl_view *view, bool keep)
{
    view->keeps_jpeg = keep;
}

/* Drops a frame that ended with nothing to show. */
static bool abandon(struct fl_view *view, uint32_t number, struct fl_error *error)
{
    const struct fl_frame *frame = view->assembly.frame;
    if (!frame || frame->frame != number || (frame->moving && frame->hidden_layer == 0) ||
        frame->encoding == PROTOCOL_ENCODING_H264)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_end.abandoned",
                            "frame %u ended incomplete, which is allowed only at rest and for hidden layers",
                            number);
    fl_assembly_finish(&view->assembly);
    return true;
}

/* Queues a frame for the caller; NULL: decoding failed. */
static bool deliver(struct fl_view *view, uint64_t change, struct fl_frame *frame, struct fl_error *error)
{
    if (!frame)
        return false;
    frame->change = change;
    if (frame->command > 0 && frame->command <= view->last_command &&
        view->last_command - frame->command < COMMANDS_REMEMBERED)
        frame->command_sent_ns = view->command_sent_ns[frame->command % COMMANDS_REMEMBERED];
    return fl_frame_queue_push(&view->done, frame, error);
}

static bool take_data(struct fl_view *view, uint64_t change, const struct message *message, struct fl_error *error)
{
    if (!fl_assembly_data(&view->assembly, &message->frame_data, error))
        return false;
    if (!view->delivers_parts || view->delivered || !fl_assembly_has_first_parts(&view->assembly))
        return true;
    view->delivered = true;
    return deliver(view, change, fl_assembly_show(&view->assembly, monotonic_now_ns(), error), error);
}

static bool take_end(struct fl_view *view, uint64_t change, const struct message *message, struct fl_error *error)
{
    const uint64_t now_ns = monotonic_now_ns();
    const uint32_t number = message->frame_end.frame;
    if (view->assembly.frame)
        view->next_frame = number < UINT32_MAX ? number + 1 : number;
    if (message->frame_end.abandoned != 0 && (!view->assembly.frame || fl_assembly_is_void(&view->assembly)))
        return abandon(view, number, error);
    if (view->assembly.frame) {
        view->last_frame = number;
        view->has_frame = true;
        if (!acknowledge(view, number, true, error))
            return false;
    }
    return deliver(view, change, fl_assembly_end(&view->assembly, &message->frame_end, now_ns, error), error);
}

/* Handles the only answer to a request: ok if a newer request replaced it. */
static bool conclude(struct fl_view *view, size_t index, const struct message *message, struct fl_error *error)
{
    const bool is_newest = index + 1 == view->asked_count;
    if (view->assembly.frame && view->assembled_request == view->asked[index].request)
        fl_assembly_finish(&view->assembly);
    memmove(&view->asked[index], &view->asked[index + 1],
            (view->asked_count - index - 1) * sizeof(view->asked[0]));
    view->asked_count--;
    if (message->type == MESSAGE_ERROR && is_newest)
        fl_error_from_message(&view->failure, &message->error);
    else if (is_newest)
        return fl_error_set(error, FL_ERROR_PROTOCOL, "render", "a view ended without a successor");
    return true;
}

static bool take(struct fl_view *view, size_t index, const struct message *message, struct fl_error *error)
{
    const uint32_t request = view->asked[index].request;
    switch (message->type) {
    case MESSAGE_FRAME_BEGIN:
        if (!view->assembly.frame) {
            view->assembly.expected = view->asked[index].expected;
            view->assembly.expected.stays_jpeg = view->keeps_jpeg;
            view->assembled_request = request;
            view->delivered = false;
        }
        return fl_assembly_begin(&view->assembly, &message->frame_begin, view->next_frame, monotonic_now_ns(),
                                 error) &&
               acknowledge(view, message->frame_begin.frame, false, error);
    case MESSAGE_FRAME_PARTS:
    case MESSAGE_FRAME_DATA:
    case MESSAGE_FRAME_END:
        if (request != view->assembled_request)
            return fl_error_set(error, FL_ERROR_PROTOCOL, "frame_data", "data of two frames arrived mixed");
        if (message->type == MESSAGE_FRAME_PARTS)
            return fl_assembly_parts(&view->assembly, &message->frame_parts, error);
        if (message->type == MESSAGE_FRAME_DATA)
            return take_data(view, view->asked[index].change, message, error);
        return take_end(view, view->asked[index].change, message, error);
    case MESSAGE_OK:
    case MESSAGE_ERROR:
        return conclude(view, index, message, error);
    default:
        return fl_error_set(error, FL_ERROR_PROTOCOL, "render", "the answer to a view has the wrong type: %s",
                            message_type_text(message->type));
    }
}

/* Complete frames are kept until the caller fetches them. */
static int take_message(struct fl_receiver *receiver, const struct framing_header *header,
                        const struct message *message, struct fl_error *error)
{
    struct fl_view *view = (struct fl_view *)receiver;
    struct fl_error why = {0};
    size_t index = 0;
    while (index < view->asked_count && view->asked[index].request != header->request)
        index++;
    if (index == view->asked_count)
        return 0;
    if (take(view, index, message, &why))
        return 1;
    /* A frame dropped for lack of memory must not make its remaining messages look like a broken protocol. */
    fl_assembly_finish(&view->assembly);
    *error = why;
    return -1;
}

struct fl_frame *fl_view_next(struct fl_view *view, unsigned timeout_ms, struct fl_error *error)
{
    const uint64_t begin_ns = monotonic_now_ns(), deadline_ns = begin_ns + timeout_ms * 1000000ull;
    *error = (struct fl_error){0};
    while (view->done.count == 0) {
        struct fl_received ignored; /* a late answer to something given up */
        if (!check(view, error) || !send_pending(view, error))
            return NULL;
        if (view->failure.code != FL_ERROR_NONE) {
            *error = view->failure;
            view->failure = (struct fl_error){0};
            return NULL;
        }
        if (fl_connection_step(view->connection, &ignored, deadline_ns, error) == FL_STEP_FAILED) {
            if (error->code == FL_ERROR_TIMEOUT)
                *error = (struct fl_error){0};
            return NULL;
        }
    }
    struct fl_frame *frame = fl_frame_queue_pop(&view->done);
    frame->wait_ns = monotonic_now_ns() - begin_ns;
    /* The next call reports a lost connection. */
    struct fl_error ignored;
    if (frame->more_follows)
        return frame;
    view->credit++;
    view->credit_pending = !grant_credit(view, &ignored);
    return frame;
}

/* Does not wait for the answer: messages until then are dropped. */
void fl_view_destroy(struct fl_view *view)
{
    if (!view)
        return;
    struct fl_connection *connection = view->connection;
    for (size_t i = 0; i < view->asked_count; i++) {
        struct message cancel = {.type = MESSAGE_CANCEL};
        cancel.cancel.target_request = view->asked[i].request;
        fl_connection_send_late(connection, fl_connection_next_request(connection), &cancel);
    }
    fl_assembly_finish(&view->assembly);
    fl_frame_queue_finish(&view->done);
    connection->has_view = false;
    fl_connection_remove(connection, &view->receiver);
    free(view);
}
