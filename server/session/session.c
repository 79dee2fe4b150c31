/* SPDX-License-Identifier: MIT */
#include "session/session.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "encode/stream.h"
#include "session/dispatch.h"
#include "session/edits.h"
#include "session/frames.h"
#include "session/jobs.h"
#include "session/others.h"
#include "session/stats.h"
#include "session/upload.h"
#include "protocol/version.h"

#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/random.h>
#include <unistd.h>

/* ---- sending ----------------------------------------------------------------------------------------- */

bool session_send(struct session *session, uint32_t request, uint32_t channel, const struct message *message)
{
    return connection_send(session->connection, request, channel, message);
}

/* Removes an incomplete character from the end of a text that was cut at its buffer's end. */
static const char *whole_characters(char *text)
{
    size_t bytes = strlen(text), start = bytes;
    while (start && bytes - start < 3 && ((unsigned char)text[start - 1] & 0xc0) == 0x80)
        start--;
    if (start && (unsigned char)text[start - 1] >= 0xc0) {
        unsigned char first = (unsigned char)text[start - 1];
        size_t wanted = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
        if (bytes - (start - 1) < wanted)
            text[start - 1] = '\0';
    }
    return text;
}

void session_send_error(struct session *session, uint32_t request, const struct error *error)
{
    struct error copy = *error;
    struct message message;
    message_init(&message, MESSAGE_ERROR);
    message.error.code = (enum protocol_error_code)error->kind;
    message.error.retryable = error->retryable;
    message.error.retry_after_ms = error->retry_after_ms < 3600000 ? error->retry_after_ms : 3600000;
    message.error.field = whole_characters(copy.field);
    message.error.text = whole_characters(copy.text);
    message.error.remedy = whole_characters(copy.remedy);
    log_write(LOG_DEBUG, "session", "client %" PRIu64 " request %u: %s: %s: %s", session->number, request,
              protocol_error_code_text(message.error.code), copy.field, copy.text);
    if (session_send(session, request, 0, &message))
        return;
    /* The answer must be sent, whatever the texts contain. */
    message.error.field = message.error.remedy = "";
    message.error.text = "the text of this error cannot be sent";
    session_send(session, request, 0, &message);
}

void session_fail(struct session *session, const struct error *error)
{
    struct error copy = *error;
    if (log_is_due(session->owner, "disconnected"))
        log_write(LOG_INFO, "session", "client %" PRIu64 " (%s, %s) is disconnected: %s: %s", session->number,
                  session->name, session->identity.name, copy.field, copy.text);
    connection_finish(session->connection, (enum protocol_error_code)error->kind, whole_characters(copy.field),
                      whole_characters(copy.text));
}

void session_fail_for_memory(struct session *session)
{
    struct error error = {0};
    error_set(&error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    session_fail(session, &error);
}

void session_submit(struct session *session, struct request *request, struct engine_command *command)
{
    if (command) {
        hub_submit(session->hub, command);
        return;
    }
    struct error error = {0};
    error_set(&error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    /* The engine never got the request, so nothing has changed. */
    scenes_failed(session, request, false);
    if (request->kind == REQUEST_JOB && request->object)
        job_failed(session, request, &error);
    else
        request_answer_error(session, request, &error);
}

/* ---- the engine's answers ---------------------------------------------------------------------------- */

static void on_done(struct session *session, struct request *request, const struct engine_event *event)
{
    switch (request->kind) {
    case REQUEST_SCENE_OPEN:
    case REQUEST_SCENE_ATTACH:
        scenes_opened(session, request, event->revision);
        return;
    case REQUEST_SCENE_CLOSE:
        scenes_closed(session, request);
        return;
    case REQUEST_JOB:
        job_done(session, request);
        return;
    case REQUEST_COMMIT:
    case REQUEST_CANCEL:
        request_answer_ok(session, request, event->revision);
        return;
    case REQUEST_OFFER:
    case REQUEST_UPLOAD:
    case REQUEST_TRANSACTION:
    case REQUEST_STATS:
    case REQUEST_SCENE_LIST:
    case REQUEST_SCENE_DESCRIBE:
    case REQUEST_SCENE_OBJECTS:
    case REQUEST_OBJECT_GET:
        return; /* the engine has not seen these */
    }
}

static void on_failed(struct session *session, struct request *request, const struct engine_event *event)
{
    struct error error = event->error;
    error_set(&error, ERROR_INTERNAL, NULL, "the engine gave no reason");
    if (request->kind == REQUEST_SCENE_ATTACH && error.kind == ERROR_UNKNOWN_ID) {
        scenes_find_elsewhere(session, request, &error);
        return;
    }
    switch (request->kind) {
    case REQUEST_JOB:
        job_failed(session, request, &error);
        return;
    case REQUEST_CANCEL:
        request_answer_ok(session, request, 0); /* the job had just ended */
        return;
    default:
        break;
    }
    scenes_failed(session, request, true);
    request_answer_error(session, request, &error);
}

void session_engine_event(struct session *session, struct engine_event *event)
{
    if (session->connection->state != CONNECTION_OPEN)
        return;
    if (event->kind == ENGINE_SCENE_CHANGED) {
        scenes_changed(session, event->scene, event->revision);
        return;
    }
    struct request *request = request_find(session, event->request);
    if (!request)
        return;
    switch (event->kind) {
    case ENGINE_DONE:
        on_done(session, request, event);
        return;
    case ENGINE_FAILED:
        on_failed(session, request, event);
        return;
    case ENGINE_FRAME:
        if (request->kind == REQUEST_JOB && event->frame) {
            frames_add(request->object, event->frame);
            event->frame = NULL;
        }
        return;
    case ENGINE_STATS_READY:
        if (request->kind == REQUEST_STATS && event->stats) {
            stats_answer(session, request, event->stats);
            event->stats = NULL;
        }
        return;
    case ENGINE_SCENES_LISTED:
        if (request->kind == REQUEST_SCENE_LIST && event->list) {
            scenes_listed(session, request, event->list);
            event->list = NULL;
        }
        return;
    case ENGINE_SCENE_DESCRIBED:
        if (request->kind == REQUEST_SCENE_DESCRIBE && event->description)
            scenes_described(session, request, event->description);
        return;
    case ENGINE_OBJECTS_LISTED:
        if (request->kind == REQUEST_SCENE_OBJECTS && event->objects)
            scenes_objects_listed(session, request, event->objects);
        return;
    case ENGINE_OBJECT_IS:
        if (request->kind == REQUEST_OBJECT_GET && event->object)
            scenes_object_is(session, request, event);
        return;
    case ENGINE_SCENE_CHANGED:
    case ENGINE_SCENE_ENDED:
    case ENGINE_CLIENT_FORGOTTEN:
    case ENGINE_DEVICE_GONE:
        return;
    }
}

/* ---- the connection's calls -------------------------------------------------------------------------- */

static const struct connection_limits *connection_limits_of(const struct session *session)
{
    const struct hub *hub = session->hub;
    bool is_owner = session->number == hub->owner;
    return is_owner ? &hub->owner_limits : &hub->options.connection_limits;
}

/* A limit below a second becomes one second, as 0 means no limit. */
static uint32_t seconds_of(uint64_t time_ms)
{
    return (uint32_t)(time_ms && time_ms < 1000 ? 1 : time_ms / 1000);
}

static void fill_limits(struct handshake_limits *told, const struct session *session)
{
    const struct hub_options *options = &session->hub->options;
    const struct connection_limits *connection_limits = connection_limits_of(session);
    const struct session_limits *limits = &options->limits;
    *told = (struct handshake_limits){
        .queued_output_bytes = connection_limits->queued_hard_bytes,
        .scene_memory_bytes = options->engine_limits.scene.host_bytes,
        .handshake_ms = connection_limits->handshake_ms,
        .control_payload_max_bytes = CODEC_CONTROL_PAYLOAD_MAX_BYTES,
        .bulk_chunk_max_bytes = (uint32_t)FRAME_PIECE_BYTES,
        .requests_in_flight = limits->requests_in_flight,
        .scenes_per_client = limits->scenes_per_client,
        .views_per_client = limits->jobs_per_client,
        .nodes_max = limits->nodes,
        .texture_edge_max = limits->texture_edge_texels,
        .width_max = limits->width_pixels,
        .height_max = limits->height_pixels,
        .samples_max = limits->samples,
        .idle_seconds = seconds_of(connection_limits->idle_ms),
        .queued_soft_bytes = connection_limits->queued_soft_bytes,
        .device_memory_bytes = options->device_bytes,
        .blob_memory_bytes = limits->blob_bytes,
        .transaction_memory_bytes = limits->transaction_bytes,
        .frame_memory_bytes = limits->frame_bytes,
        .upload_window_bytes = limits->upload_window_bytes,
        .frame_window_bytes = limits->frame_window_bytes,
        .queued_soft_ms = connection_limits->queued_soft_ms,
        .progress_grace_ms = connection_limits->progress_grace_ms,
        .progress_bytes_per_s = connection_limits->progress_bytes_per_s,
        .clients_max = limits->clients,
        .unauthenticated_max = limits->unauthenticated,
        .unauthenticated_per_address = limits->unauthenticated_per_address,
        .wrong_key_ms = connection_limits->wrong_key_ms,
        .depth_max = limits->depth,
        .blobs_per_client = limits->blobs_per_client,
        .transaction_edits = limits->transaction_edits,
        .scene_linger_seconds = seconds_of(options->engine_limits.scene_linger_ms),
        .scenes_lingering = (uint32_t)options->engine_limits.lingering_scenes,
        .lost_after_ms = connection_limits->lost_ms,
        .handshakes_per_second = limits->handshakes_a_second,
#define MEMORY_LIMIT(tracer, doc) .tracer##_memory_bytes = (uint64_t)limits->tracers.tracer##_mebibytes << 20,
#define TRACER_LIMIT(tracer, field, min, max, doc) .tracer##_##field##_max = limits->tracers.tracer##_##field,
#include "protocol/tracers.def"
    };
}

static const char replaced_key[] = "the daemon's key was replaced; connect with the new one";

/* Whether its key, if it came by one, is still one of the daemon's. */
static bool is_key_valid(const struct session *session)
{
    return !session->identity.has_key || auth_numbers_have(&session->hub->options.keys, &session->identity);
}

static bool on_hello(void *context, const struct handshake_hello *hello, struct handshake_reply *reply)
{
    struct session *session = context;
    struct hub *hub = session->hub;
    struct decode_error error = {0};
    *reply = (struct handshake_reply){.name = "farlightd " FARLIGHT_VERSION};
    reply->version = handshake_choose_version(hello, &error);
    if (!reply->version)
        snprintf(reply->text, sizeof(reply->text), "%s", error.text);
    else if (hub->stopping)
        snprintf(reply->text, sizeof(reply->text), "the daemon is about to stop");
    if (reply->version && reply->text[0])
        reply->capabilities = HANDSHAKE_TRY_AGAIN;
    if (!is_key_valid(session))
        snprintf(reply->text, sizeof(reply->text), "%s", replaced_key);
    if (getrandom(reply->nonce, sizeof(reply->nonce), 0) < 0 ||
        getrandom(reply->session_token, sizeof(reply->session_token), 0) < 0)
        snprintf(reply->text, sizeof(reply->text), "no random numbers");
    if (session->identity.read_only)
        reply->capabilities |= HANDSHAKE_CAN_READ_ONLY;
    session->can_h264 = (hello->capabilities & HANDSHAKE_CAN_H264) && reply->text[0] == '\0' &&
                        encoder_stream_supports(ENCODING_H264, 4);
    if (session->can_h264)
        reply->capabilities |= HANDSHAKE_CAN_H264;
    session->can_abandon = hello->capabilities & HANDSHAKE_CAN_ABANDON;
    if (session->can_abandon)
        reply->capabilities |= HANDSHAKE_CAN_ABANDON;
    fill_limits(&reply->limits, session);
    snprintf(session->name, sizeof(session->name), "%s", hello->name);
    return reply->text[0] == '\0';
}

static void count_introduced(struct hub *hub, int more)
{
    hub->introduced += (uint32_t)more;
    if (hub->counted)
        hub->counted(hub->call_context);
}

static void introduce(struct session *session)
{
    session->introduced = true;
    count_introduced(session->hub, 1);
    log_write(LOG_DEBUG, "session", "client %" PRIu64 " is %s, %s", session->number, session->name,
              session->identity.name);
}

static void on_opened(void *context)
{
    introduce(context);
    upload_begin(context);
}

static void on_room(void *context)
{
    scenes_send_changes(context);
    frames_pump(context);
}

static bool on_awaited(const void *context)
{
    const struct session *session = context;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&session->requests.in_flight, &cursor, NULL, &value)) {
        const struct request *request = value;
        if (request->kind == REQUEST_UPLOAD || request->kind == REQUEST_TRANSACTION)
            continue; /* the client must continue it */
        if (request->kind != REQUEST_JOB || job_is_awaited(request->object))
            return true;
    }
    return false;
}

static void destroy_transactions(struct session *session)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&session->requests.in_flight, &cursor, NULL, &value)) {
        struct request *request = value;
        if (request->kind == REQUEST_TRANSACTION)
            transaction_destroy(session, request->object);
    }
}

static void on_closed(void *context)
{
    struct session *session = context;
    struct hub *hub = session->hub;
    log_write(LOG_DEBUG, "session", "client %" PRIu64 " is gone", session->number);
    hashmap_remove(&hub->sessions, session->number);
    jobs_finish(session);
    destroy_transactions(session);
    requests_finish(&session->requests);
    upload_finish(session);
    scenes_finish(session);
    if (session->introduced) {
        count_introduced(hub, -1);
        hub_departed(hub, session->number, session->transaction_bytes);
        hub_submit(hub, session->farewell);
    } else {
        engine_command_destroy(session->farewell);
    }
    bool was_owner = session->number == hub->owner;
    free(session);
    if (was_owner && hub->owner_gone)
        hub->owner_gone(hub->call_context);
    if (!hub->sessions.count && hub->emptied)
        hub->emptied(hub->call_context);
}

static const struct connection_handler connection_handler = {
    .hello = on_hello,
    .opened = on_opened,
    .message = dispatch_message,
    .invalid = dispatch_invalid,
    .room = on_room,
    .awaited = on_awaited,
    .closed = on_closed,
};

/* ---- life -------------------------------------------------------------------------------------------- */

struct session *session_create(struct hub *hub, uint64_t number, int fd, const struct handover *handover,
                               struct error *error)
{
    struct session *session = calloc(1, sizeof(*session));
    if (!session) {
        error_set(error, ERROR_OUT_OF_MEMORY, "session", "no memory");
        return NULL;
    }
    session->hub = hub;
    session->number = number;
    session->identity = handover->identity;
    session->peer = handover->peer;
    session->can_h264 = handover->can_h264;
    session->can_abandon = handover->can_abandon;
    memcpy(session->name, handover->name, sizeof(session->name));
    session->owner = auth_owner_number(&session->identity, &session->peer);
    session->principal = principal_number(&session->identity, session->number);
    session->farewell = hub_command(ENGINE_CLIENT_GONE, number, 0);
    const struct connection_entry entry = {.log_source = session->owner, .sharers = &hub->introduced};
    const struct connection_saved *saved = handover->saved.bytes ? &handover->saved : NULL;
    session->connection = session->farewell ? connection_create(hub->loop, fd, connection_limits_of(session),
                                                                &entry, &connection_handler, session, saved, error)
                                            : NULL;
    if (!session->connection) {
        error_set(error, ERROR_OUT_OF_MEMORY, "session", "no memory");
        engine_command_destroy(session->farewell);
        free(session);
        return NULL;
    }
    if (handover->is_open) {
        introduce(session);
        upload_begin(session); /* repeats the credit that its client knows */
    }
    return session;
}

/* ---- to another worker ------------------------------------------------------------------------------- */

static bool may_move(const struct session *session)
{
    return session->connection->state == CONNECTION_OPEN && !session->connection->out.queued_bytes &&
           session->owner == session->hub->worker_of && session->number != session->hub->owner &&
           session->requests.in_flight.count == 1 && !session->scenes.count && !session->jobs &&
           !session->blobs.offer_count && !session->transaction_edits;
}

bool session_move(struct session *session, uint32_t worker, uint32_t request, const struct message *message)
{
    uint8_t bytes[SCENE_NAME_MAX + 256];
    struct handover handover = {.identity = session->identity,
                                .peer = session->peer,
                                .to_worker = worker,
                                .is_open = true,
                                .can_h264 = session->can_h264,
                                .can_abandon = session->can_abandon};
    struct writer writer;
    struct error error = {0};
    memcpy(handover.name, session->name, sizeof(handover.name));
    writer_init(&writer, bytes, sizeof(bytes));
    if (!may_move(session) || !message_write(&writer, request, 0, message) ||
        !others_hand_over(session->hub->others, session->connection, &handover, bytes, writer.used_bytes, &error))
        return false;
    connection_close(session->connection); /* the socket is the other worker's */
    return true;
}

void session_check_key(struct session *session)
{
    if (!session->introduced || is_key_valid(session))
        return; /* a client without a hello is refused when it sends one */
    log_write(LOG_INFO, "session", "client %" PRIu64 " (%s, %s) is disconnected: its key was replaced",
              session->number, session->name, session->identity.name);
    connection_finish(session->connection, PROTOCOL_ERROR_DENIED, "key", replaced_key);
}

void session_stop(struct session *session)
{
    connection_finish(session->connection, PROTOCOL_ERROR_SHUTTING_DOWN, "", "the daemon stops");
}

void session_close(struct session *session)
{
    connection_close(session->connection);
}

void session_hold(struct session *session, bool held)
{
    connection_hold(session->connection, held);
}
