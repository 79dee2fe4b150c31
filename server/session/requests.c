/* SPDX-License-Identifier: MIT */
#include "session/requests.h"

#include "session/edits.h"
#include "session/jobs.h"
#include "session/session.h"
#include "session/upload.h"

#include <stdlib.h>

void requests_finish(struct requests *requests)
{
    size_t cursor = 0;
    void *request;
    while (hashmap_next(&requests->in_flight, &cursor, NULL, &request))
        free(request);
    hashmap_finish(&requests->in_flight);
}

struct request *request_find(const struct session *session, uint32_t id)
{
    return hashmap_get(&session->requests.in_flight, id);
}

struct request *request_begin(struct session *session, uint32_t id, enum request_kind kind)
{
    struct error error = {0};
    if (id == 0 || request_find(session, id)) {
        error_set(&error, ERROR_PROTOCOL, "request", "%u is %s", id,
                  id ? "in flight already" : "no number for a request that is to be answered");
        session_fail(session, &error);
        return NULL;
    }
    if (session->requests.in_flight.count >= session->hub->options.limits.requests_in_flight) {
        error_set(&error, ERROR_LIMIT, "request", "%zu requests are in flight, the limit",
                  session->requests.in_flight.count);
        error_remedy(&error,
                     "wait for the answer to one of them, or raise limits.requests in the daemon's configuration");
        error.retryable = true;
        session_send_error(session, id, &error);
        return NULL;
    }
    struct request *request = calloc(1, sizeof(*request));
    if (!request || !hashmap_put(&session->requests.in_flight, id, request)) {
        free(request);
        error_set(&error, ERROR_OUT_OF_MEMORY, "request", "no memory");
        session_send_error(session, id, &error);
        return NULL;
    }
    request->id = id;
    request->kind = kind;
    return request;
}

static void send_ok(struct session *session, const struct request *request, uint64_t revision)
{
    struct message message;
    message_init(&message, MESSAGE_OK);
    message.ok.revision = revision;
    session_send(session, request->id, 0, &message);
}

/* Ends a request and returns the cancel that must be answered now; NULL: none. */
static struct request *end(struct session *session, struct request *request)
{
    uint32_t cancelled_by = request->cancelled_by;
    edits_count(session, -(int64_t)request->edits, -(int64_t)request->edit_bytes);
    hashmap_remove(&session->requests.in_flight, request->id);
    free(request);
    struct request *cancel = cancelled_by ? request_find(session, cancelled_by) : NULL;
    return cancel && cancel->kind == REQUEST_CANCEL ? cancel : NULL;
}

void request_answered(struct session *session, struct request *request)
{
    /* A cancel may itself be cancelled, in a chain as long as there are requests. */
    for (struct request *cancel; (cancel = end(session, request)); request = cancel)
        send_ok(session, cancel, 0);
}

void request_answer_ok(struct session *session, struct request *request, uint64_t revision)
{
    send_ok(session, request, revision);
    request_answered(session, request);
}

void request_answer_error(struct session *session, struct request *request, const struct error *error)
{
    session_send_error(session, request->id, error);
    request_answered(session, request);
}

/* ---- dead ones --------------------------------------------------------------------------------------- */

void requests_bury(struct session *session, uint32_t id)
{
    struct requests *requests = &session->requests;
    requests->dead[requests->dead_next++ % REQUESTS_DEAD_MAX] = id;
}

bool requests_is_dead(const struct session *session, uint32_t id)
{
    for (int i = 0; id && i < REQUESTS_DEAD_MAX; i++) {
        if (session->requests.dead[i] == id)
            return true;
    }
    return false;
}

void requests_forget_dead(struct session *session, uint32_t id)
{
    for (int i = 0; i < REQUESTS_DEAD_MAX; i++) {
        if (session->requests.dead[i] == id)
            session->requests.dead[i] = 0;
    }
}

/* ---- cancel ------------------------------------------------------------------------------------------ */

void request_cancel(struct session *session, struct request *cancel, uint32_t target_id)
{
    struct request *target = request_find(session, target_id);
    if (!target || target == cancel || target->cancelled_by ||
        (target->kind == REQUEST_JOB && job_is_cancelled(target))) {
        /* Already answered, or about to be, which serves the cancelling client. */
        request_answer_ok(session, cancel, 0);
        return;
    }
    struct error error = {0};
    error_set(&error, ERROR_CANCELLED, NULL, "cancelled by the client");
    switch (target->kind) {
    case REQUEST_UPLOAD:
        if (target->object)
            upload_abandon(session, target->object);
        requests_bury(session, target_id);
        request_answer_error(session, target, &error);
        request_answer_ok(session, cancel, 0);
        return;
    case REQUEST_TRANSACTION:
        transaction_destroy(session, target->object);
        requests_bury(session, target_id);
        request_answer_error(session, target, &error);
        request_answer_ok(session, cancel, 0);
        return;
    case REQUEST_JOB:
        job_cancel(session, target, cancel);
        return;
    case REQUEST_SCENE_OPEN:
    case REQUEST_SCENE_CLOSE:
    case REQUEST_SCENE_ATTACH:
    case REQUEST_SCENE_LIST:
    case REQUEST_SCENE_DESCRIBE:
    case REQUEST_SCENE_OBJECTS:
    case REQUEST_OBJECT_GET:
    case REQUEST_OFFER:
    case REQUEST_COMMIT:
    case REQUEST_CANCEL:
    case REQUEST_STATS:
        /* Short requests end by their own answer, which the cancel's follows. */
        target->cancelled_by = cancel->id;
        return;
    }
}
