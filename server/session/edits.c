/* SPDX-License-Identifier: MIT */
#include "session/edits.h"

#include "session/session.h"
#include "session/upload.h"

#include <inttypes.h>
#include <stdlib.h>

void edits_fail(struct session *session, struct request *request, const struct error *error)
{
    transaction_destroy(session, request->object);
    request->object = NULL;
    requests_bury(session, request->id);
    request_answer_error(session, request, error);
}

void edits_begin(struct session *session, struct request *request, const struct message_edit_begin *begin)
{
    struct error error = {0};
    /* A scene that is being opened will do: the engine carries things out in order. */
    enum session_scene_state state = session_scene(session, begin->scene);
    struct transaction *transaction = calloc(1, sizeof(*transaction));
    if (state != SCENE_OPENING && state != SCENE_OPEN)
        error_set(&error, ERROR_UNKNOWN_ID, "edit_begin.scene", "there is no scene %u", begin->scene);
    else if (!transaction)
        error_set(&error, ERROR_OUT_OF_MEMORY, "edit_begin", "no memory");
    else
        *transaction = (struct transaction){.scene = begin->scene, .base_revision = begin->base_revision};
    request->object = transaction;
    if (error.kind != ERROR_NONE)
        edits_fail(session, request, &error);
}

void edits_count(struct session *session, int64_t edits, int64_t bytes)
{
    session->transaction_edits += (size_t)edits;
    session->transaction_bytes += (uint64_t)bytes;
    session->hub->transaction_bytes += (uint64_t)bytes;
}

void transaction_destroy(struct session *session, struct transaction *transaction)
{
    if (!transaction)
        return;
    edits_count(session, -(int64_t)transaction->count, -(int64_t)transaction->bytes);
    for (size_t i = 0; i < transaction->count; i++)
        scene_edit_finish(&transaction->edits[i]);
    free(transaction->edits);
    free(transaction);
}

/* Counts memory before it is taken. */
static bool account(struct session *session, struct transaction *transaction, uint64_t bytes, struct error *error)
{
    const struct hub *hub = session->hub;
    const struct session_limits *limits = &hub->options.limits;
    const uint64_t used_bytes = hub->transaction_bytes, limit_bytes = limits->transaction_bytes;
    if (bytes > limit_bytes || used_bytes > limit_bytes - bytes) {
        error_set(error, ERROR_LIMIT, "transaction",
                  "edits that wait to be committed take %" PRIu64 " bytes, and %" PRIu64
                  " more would be needed; the limit is %" PRIu64,
                  used_bytes, bytes, limit_bytes);
        return error_remedy(error, "commit fewer edits at a time and wait for the answer, or raise "
                                   "memory.transactions in the daemon's configuration");
    }
    transaction->bytes += bytes;
    edits_count(session, 0, (int64_t)bytes);
    return true;
}

static bool make_room(struct session *session, struct transaction *transaction, struct error *error)
{
    const struct session_limits *limits = &session->hub->options.limits;
    if (session->transaction_edits >= limits->transaction_edits) {
        error_set(error, ERROR_LIMIT, "transaction", "%u edits wait to be committed, the limit",
                  limits->transaction_edits);
        return error_remedy(error, "commit fewer edits at a time and wait for the answer, or raise "
                                   "limits.transaction_edits in the daemon's configuration");
    }
    if (transaction->count < transaction->capacity)
        return true;
    size_t capacity = transaction->capacity ? transaction->capacity * 2 : 32;
    if (!account(session, transaction, (capacity - transaction->capacity) * sizeof(*transaction->edits), error))
        return false;
    struct scene_edit *edits = realloc(transaction->edits, capacity * sizeof(*edits));
    if (!edits)
        return error_set(error, ERROR_OUT_OF_MEMORY, "transaction", "no memory for %zu edits", capacity);
    transaction->edits = edits;
    transaction->capacity = capacity;
    return true;
}

/* Bytes of an edit's arrays. Blobs are counted where they are held. */
static uint64_t bytes_beside(const struct scene_edit *edit)
{
    if (edit->kind != EDIT_SET)
        return 0;
    if (edit->object == OBJECT_NODE)
        return edit->set.node.weight_count * sizeof(*edit->set.node.weights);
    if (edit->object == OBJECT_MESH)
        return edit->set.mesh.range_count * sizeof(*edit->set.mesh.ranges) +
               edit->set.mesh.weight_count * sizeof(*edit->set.mesh.weights);
    if (edit->object == OBJECT_SPHERES)
        return edit->set.spheres.range_count * sizeof(*edit->set.spheres.ranges);
    return 0;
}

void edits_add(struct session *session, struct request *request, const struct message *message)
{
    struct transaction *transaction = request->object;
    struct error error = {0};
    if (!make_room(session, transaction, &error)) {
        edits_fail(session, request, &error);
        return;
    }
    const struct edit_source source = upload_source(session);
    struct scene_edit *edit = &transaction->edits[transaction->count];
    if (edit_from_message(&source, message, edit, &error) &&
        account(session, transaction, bytes_beside(edit), &error)) {
        transaction->count++;
        edits_count(session, 1, 0);
        return;
    }
    scene_edit_finish(edit);
    edits_fail(session, request, &error);
}

void edits_commit(struct session *session, struct request *request)
{
    struct transaction *transaction = request->object;
    struct engine_command *command = NULL;
    if (session_scene(session, transaction->scene) != SCENE_OPEN &&
        session_scene(session, transaction->scene) != SCENE_OPENING) {
        struct error error = {0};
        error_set(&error, ERROR_UNKNOWN_ID, "edit_begin.scene", "scene %u was closed", transaction->scene);
        transaction_destroy(session, transaction);
        request_answer_error(session, request, &error);
        return;
    }
    command = hub_command(ENGINE_COMMIT, session->number, request->id);
    if (command) {
        command->scene = transaction->scene;
        command->base_revision = transaction->base_revision;
        command->edits = transaction->edits;
        command->edit_count = transaction->count;
        /* Edits are counted until the engine has answered: it may keep them for as long as a frame takes. */
        request->edits = transaction->count;
        request->edit_bytes = transaction->bytes;
        transaction->edits = NULL;
        transaction->count = 0;
        transaction->bytes = 0;
    }
    transaction_destroy(session, transaction);
    request->object = NULL;
    request->kind = REQUEST_COMMIT;
    session_submit(session, request, command);
}
