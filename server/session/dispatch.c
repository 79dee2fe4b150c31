/* SPDX-License-Identifier: MIT */
#include "session/dispatch.h"

#include "base/clock.h"
#include "session/edits.h"
#include "session/jobs.h"
#include "session/scenes.h"
#include "session/session.h"
#include "session/upload.h"
#include "session/views.h"

/* ---- connection -------------------------------------------------------------------------------------- */

static void on_ping(struct session *session, struct request *request, const struct framing_header *header,
                    const struct message *message)
{
    (void)request;
    struct message answer;
    message_init(&answer, MESSAGE_PONG);
    answer.pong.sent_ns = message->ping.sent_ns;
    answer.pong.received_ns = clock_now_ns();
    session_send(session, header->request, 0, &answer);
}

static void on_ignored(struct session *session, struct request *request, const struct framing_header *header,
                       const struct message *message)
{
    (void)session, (void)request, (void)header, (void)message;
}

static void on_goodbye(struct session *session, struct request *request, const struct framing_header *header,
                       const struct message *message)
{
    (void)request, (void)header, (void)message;
    session_close(session);
}

static void on_cancel(struct session *session, struct request *request, const struct framing_header *header,
                      const struct message *message)
{
    (void)header;
    request_cancel(session, request, message->cancel.target_request);
}

static void on_credit(struct session *session, struct request *request, const struct framing_header *header,
                      const struct message *message)
{
    (void)request, (void)header;
    jobs_credit(session, &message->credit);
}

static void on_stats(struct session *session, struct request *request, const struct framing_header *header,
                     const struct message *message)
{
    (void)header, (void)message;
    struct engine_command *command = hub_command(ENGINE_STATS, session->number, request->id);
    if (command)
        command->principal = session->principal;
    session_submit(session, request, command);
}

/* ---- scenes ------------------------------------------------------------------------------------------ */

static void on_scene_open(struct session *session, struct request *request, const struct framing_header *header,
                          const struct message *message)
{
    (void)header;
    scenes_open(session, request, &message->scene_open);
}

static void on_scene_close(struct session *session, struct request *request, const struct framing_header *header,
                           const struct message *message)
{
    (void)header;
    scenes_close(session, request, &message->scene_close);
}

static void on_scene_attach(struct session *session, struct request *request, const struct framing_header *header,
                            const struct message *message)
{
    (void)header;
    scenes_attach(session, request, &message->scene_attach);
}

static void on_scene_list(struct session *session, struct request *request, const struct framing_header *header,
                          const struct message *message)
{
    (void)header, (void)message;
    scenes_list(session, request);
}

static void on_scene_describe(struct session *session, struct request *request,
                              const struct framing_header *header, const struct message *message)
{
    (void)header;
    scenes_describe(session, request, &message->scene_describe);
}

static void on_scene_objects(struct session *session, struct request *request, const struct framing_header *header,
                             const struct message *message)
{
    (void)header;
    scenes_list_objects(session, request, &message->scene_objects);
}

static void on_object_get(struct session *session, struct request *request, const struct framing_header *header,
                          const struct message *message)
{
    (void)header;
    scenes_get_object(session, request, &message->object_get);
}

/* ---- blobs and edits --------------------------------------------------------------------------------- */

static void on_blob_offer(struct session *session, struct request *request, const struct framing_header *header,
                          const struct message *message)
{
    (void)header;
    upload_offer(session, request, &message->blob_offer);
}

static void on_blob_data(struct session *session, struct request *request, const struct framing_header *header,
                         const struct message *message)
{
    (void)request;
    upload_data(session, header, &message->blob_data);
}

static void on_edit_begin(struct session *session, struct request *request, const struct framing_header *header,
                          const struct message *message)
{
    (void)header;
    edits_begin(session, request, &message->edit_begin);
}

static void on_edit(struct session *session, struct request *request, const struct framing_header *header,
                    const struct message *message)
{
    (void)header;
    edits_add(session, request, message);
}

static void on_edit_commit(struct session *session, struct request *request, const struct framing_header *header,
                           const struct message *message)
{
    (void)header, (void)message;
    edits_commit(session, request);
}

static void on_render(struct session *session, struct request *request, const struct framing_header *header,
                      const struct message *message)
{
    (void)header;
    jobs_start(session, request, &message->render);
}

static void on_view_camera(struct session *session, struct request *request, const struct framing_header *header,
                           const struct message *message)
{
    (void)request, (void)header;
    views_set_camera(session, &message->view_camera);
}

static void on_frame_ack(struct session *session, struct request *request, const struct framing_header *header,
                         const struct message *message)
{
    (void)request, (void)header;
    views_acknowledge(session, &message->frame_ack);
}

/* ---- the table --------------------------------------------------------------------------------------- */

static const struct dispatch_row rows[] = {
    {MESSAGE_PING, DISPATCH_ANY, 0, on_ping},
    {MESSAGE_PONG, DISPATCH_ANY, 0, on_ignored},
    {MESSAGE_GOODBYE, DISPATCH_ANY, 0, on_goodbye},
    {MESSAGE_CANCEL, DISPATCH_STARTS, REQUEST_CANCEL, on_cancel},
    {MESSAGE_CREDIT, DISPATCH_ANY, 0, on_credit},
    {MESSAGE_BLOCKED, DISPATCH_ANY, 0, on_ignored},
    {MESSAGE_STATS, DISPATCH_STARTS, REQUEST_STATS, on_stats},
    {MESSAGE_SCENE_OPEN, DISPATCH_STARTS, REQUEST_SCENE_OPEN, on_scene_open},
    {MESSAGE_SCENE_CLOSE, DISPATCH_STARTS, REQUEST_SCENE_CLOSE, on_scene_close},
    {MESSAGE_SCENE_ATTACH, DISPATCH_STARTS, REQUEST_SCENE_ATTACH, on_scene_attach},
    {MESSAGE_SCENE_LIST, DISPATCH_STARTS, REQUEST_SCENE_LIST, on_scene_list},
    {MESSAGE_SCENE_DESCRIBE, DISPATCH_STARTS, REQUEST_SCENE_DESCRIBE, on_scene_describe},
    {MESSAGE_SCENE_OBJECTS, DISPATCH_STARTS, REQUEST_SCENE_OBJECTS, on_scene_objects},
    {MESSAGE_OBJECT_GET, DISPATCH_STARTS, REQUEST_OBJECT_GET, on_object_get},
    {MESSAGE_BLOB_OFFER, DISPATCH_STARTS, REQUEST_OFFER, on_blob_offer},
    {MESSAGE_BLOB_DATA, DISPATCH_ANY, REQUEST_UPLOAD, on_blob_data},
    {MESSAGE_EDIT_BEGIN, DISPATCH_STARTS, REQUEST_TRANSACTION, on_edit_begin},
    {MESSAGE_EDIT_COMMIT, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit_commit},
    {MESSAGE_SET_NODE, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_MESH, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_SPHERES, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_DISC, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_MATERIAL, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_TEXTURE, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_LIGHT, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_CAMERA, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_ENVIRONMENT, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_SKIN, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_CLIP, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_SET_CHANNEL, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_REMOVE, DISPATCH_CONTINUES, REQUEST_TRANSACTION, on_edit},
    {MESSAGE_RENDER, DISPATCH_STARTS, REQUEST_JOB, on_render},
    {MESSAGE_VIEW_CAMERA, DISPATCH_ANY, 0, on_view_camera},
    {MESSAGE_FRAME_ACK, DISPATCH_ANY, 0, on_frame_ack},
};

const struct dispatch_row *dispatch_find(uint32_t type)
{
    for (size_t i = 0; i < sizeof(rows) / sizeof(rows[0]); i++) {
        if ((uint32_t)rows[i].type == type)
            return &rows[i];
    }
    return NULL;
}

/* Request in flight that a message continues; NULL: none, and the error was handled. */
static struct request *continued(struct session *session, const struct dispatch_row *row, uint32_t id)
{
    struct request *request = request_find(session, id);
    if (request && request->kind == row->kind)
        return request;
    if (requests_is_dead(session, id)) {
        if (row->type == MESSAGE_EDIT_COMMIT)
            requests_forget_dead(session, id);
        return NULL;
    }
    struct error error = {0};
    error_set(&error, ERROR_PROTOCOL, "request", "%s of request %u, which is no open transaction",
              message_type_text(row->type), id);
    session_fail(session, &error);
    return NULL;
}

static struct request *started(struct session *session, const struct dispatch_row *row, uint32_t id)
{
    requests_forget_dead(session, id); /* the number is used anew */
    struct request *request = request_begin(session, id, row->kind);
    if (!request && row->kind == REQUEST_TRANSACTION)
        requests_bury(session, id); /* its edits may be on their way */
    return request;
}

/* Answers a message that is refused; later messages of its request are skipped. */
static void refuse(struct session *session, const struct dispatch_row *row, uint32_t id, const struct error *error)
{
    struct request *request;
    if (row->rule == DISPATCH_STARTS) {
        request = started(session, row, id);
        if (request && row->kind == REQUEST_TRANSACTION)
            requests_bury(session, id);
        if (request)
            request_answer_error(session, request, error);
    } else if (row->kind == REQUEST_UPLOAD) {
        upload_invalid(session, id, error);
    } else {
        request = continued(session, row, id);
        if (request)
            edits_fail(session, request, error);
    }
}

/* Whether the message asks for a change; edits need no check, as their edit_begin is refused. */
static bool changes_something(enum message_type type)
{
    return type == MESSAGE_SCENE_OPEN || type == MESSAGE_BLOB_OFFER || type == MESSAGE_BLOB_DATA ||
           type == MESSAGE_EDIT_BEGIN;
}

static bool is_allowed(const struct session *session, enum message_type type, struct error *error)
{
    if (!session->identity.read_only || !changes_something(type))
        return true;
    error_set(error, ERROR_DENIED, message_type_text(type), "this client may only look");
    return error_remedy(error,
                        "attach to a shared scene, or ask the daemon's administrator for the right to edit");
}

void dispatch_message(void *context, const struct framing_header *header, const struct message *message)
{
    struct session *session = context;
    const struct dispatch_row *row = dispatch_find(message->type);
    if (!row) {
        struct error error = {0};
        error_set(&error, ERROR_PROTOCOL, NULL, "%s is no message for a daemon", message_type_text(message->type));
        session_fail(session, &error);
        return;
    }
    struct error error = {0};
    if (!is_allowed(session, message->type, &error)) {
        refuse(session, row, header->request, &error);
        return;
    }
    struct request *request = NULL;
    if (row->rule == DISPATCH_STARTS)
        request = started(session, row, header->request);
    else if (row->rule == DISPATCH_CONTINUES)
        request = continued(session, row, header->request);
    if (row->rule == DISPATCH_ANY || request)
        row->handle(session, request, header, message);
}

/* Refuses a message with an invalid field; its framing is sound, so only its request fails. */
void dispatch_invalid(void *context, const struct framing_header *header, const struct decode_error *decode_error)
{
    struct session *session = context;
    const struct dispatch_row *row = dispatch_find(header->type);
    struct error error = {0};
    error_set(&error, (enum error_code)decode_error->code, decode_error->field, "%s", decode_error->text);
    if (!row || (row->rule == DISPATCH_ANY && row->kind != REQUEST_UPLOAD)) {
        session_fail(session, &error);
        return;
    }
    refuse(session, row, header->request, &error);
}
