/* SPDX-License-Identifier: MIT */
#include "tests/bench/load_model.h"

#include "lib/importer.h"
#include "lib/relay.h"
#include "session/edits.h"
#include "session/session.h"
#include "session/upload.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MEMORY_MAX_BYTES ((uint64_t)1 << 36) /* a model of a benchmark is ours; this only stops a runaway */
#define TEXTURE_EDGE_MAX_TEXELS 65536u

struct loading {
    struct loaded_model *model;
    struct fl_importer importer;
    struct fl_relay relay; /* the same rules as towards a daemon */
    struct hub hub;
    struct session session; /* no more of it than the offers */
    struct scene_edit *edits;
    size_t edit_count, edit_capacity;
};

/* ---- blobs ---- */

static bool take_offer(struct loading *loading, const struct message_blob_offer *offer, struct message *reply,
                       struct record_blob_index *needed, struct error *error)
{
    reply->type = MESSAGE_BLOB_NEED;
    reply->blob_need = (struct message_blob_need){.needed = needed};
    for (uint32_t i = 0; i < offer->blobs_count; i++) {
        const struct record_blob_ref *blob = &offer->blobs[i];
        if (blob->size_bytes == 0 || upload_find(&loading->session, blob->hash))
            continue;
        if (!upload_add(&loading->session, blob, error))
            return false;
        needed[reply->blob_need.needed_count++].index = i;
        loading->model->blob_bytes += blob->size_bytes;
    }
    return true;
}

/* *complete: the blob is there. */
static bool take_data(struct loading *loading, const struct message_blob_data *data, bool *complete,
                      struct error *error)
{
    struct offer *offer = upload_find(&loading->session, data->hash);
    *complete = false;
    if (!offer || offer->held || data->offset_bytes != offer->arrived_bytes ||
        data->data_bytes > offer->size_bytes - offer->arrived_bytes)
        return error_set(error, ERROR_PROTOCOL, "blob_data", "a piece that is not due");
    if (!blob_store_reserve(loading->hub.blobs, data->data_bytes, error))
        return false;
    if (!offer->arriving && !(offer->arriving = blob_create((size_t)offer->size_bytes))) {
        blob_store_release(loading->hub.blobs, data->data_bytes);
        return error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory");
    }
    memcpy(offer->arriving->data + offer->arrived_bytes, data->data, data->data_bytes);
    offer->arrived_bytes += data->data_bytes;
    if (offer->arrived_bytes < offer->size_bytes)
        return true;
    blob_hash(offer->arriving->hash, offer->arriving->data, offer->arriving->size_bytes);
    if (memcmp(offer->arriving->hash, offer->hash, BLOB_HASH_BYTES) != 0)
        return error_set(error, ERROR_HASH_MISMATCH, "blob_data", "the bytes are not those that were offered");
    offer->held = blob_store_add(loading->hub.blobs, loading->session.principal, offer->arriving);
    upload_abandon(&loading->session, offer); /* the store has it now */
    *complete = true;
    return offer->held || error_set(error, ERROR_OUT_OF_MEMORY, "blob_data", "no memory");
}

/* ---- edits ---- */

static bool take_edit(struct loading *loading, const struct message *message, struct error *error)
{
    struct fl_error full = {0};
    if (!fl_grow((void **)&loading->edits, &loading->edit_capacity, loading->edit_count, sizeof(*loading->edits),
                 &full))
        return error_set(error, ERROR_OUT_OF_MEMORY, "edits", "%s", full.text);
    struct scene_edit *edit = &loading->edits[loading->edit_count++];
    const struct edit_source source = upload_source(&loading->session);
    if (!edit_from_message(&source, message, edit, error))
        return false;
    if (message->type == MESSAGE_SET_NODE && message->set_node.kind == PROTOCOL_NODE_CAMERA &&
        loading->model->camera == 0)
        loading->model->camera = message->set_node.node;
    return true;
}

static void finish_edits(struct loading *loading)
{
    for (size_t i = 0; i < loading->edit_count; i++)
        scene_edit_finish(&loading->edits[i]);
    loading->edit_count = 0;
}

static bool commit(struct loading *loading, struct message *reply, struct error *error)
{
    if (!scene_commit(loading->model->scene, loading->edits, loading->edit_count, error))
        return false;
    loading->model->edits += loading->edit_count;
    finish_edits(loading);
    reply->ok.revision = loading->model->scene->revision;
    return true;
}

/* ---- the conversation ---- */

static bool push(struct loading *loading, uint32_t request, const struct message *message, struct error *error)
{
    struct fl_error lost = {0};
    return fl_stream_push(&loading->importer.stream, request, 0, message, &lost) ||
           error_set(error, ERROR_INTERNAL, lost.field, "%s", lost.text);
}

/* What the daemon would do with it; edits of an open transaction are not answered one by one. */
static bool handle(struct loading *loading, const struct frame *frame, const struct message *message,
                   struct error *error)
{
    struct message reply = {.type = MESSAGE_OK};
    struct record_blob_index *needed = NULL;
    bool is_answered = true, done = true;
    switch (message->type) {
    case MESSAGE_BLOB_OFFER:
        needed = calloc(message->blob_offer.blobs_count + 1u, sizeof(*needed));
        done = needed ? take_offer(loading, &message->blob_offer, &reply, needed, error)
                      : error_set(error, ERROR_OUT_OF_MEMORY, "blob_offer", "no memory");
        break;
    case MESSAGE_BLOB_DATA:
        done = take_data(loading, &message->blob_data, &is_answered, error);
        break;
    case MESSAGE_EDIT_COMMIT:
        done = commit(loading, &reply, error);
        break;
    case MESSAGE_EDIT_BEGIN:
        is_answered = false;
        break;
    default:
        is_answered = false;
        done = take_edit(loading, message, error);
        break;
    }
    done = done && (!is_answered || push(loading, frame->header.request, &reply, error));
    free(needed);
    return done;
}

static bool from_client_error(struct error *error, const struct fl_error *from)
{
    return error_set(error, ERROR_INTERNAL, from->field, "%s", from->text);
}

static bool drain(struct loading *loading, struct error *error)
{
    struct fl_error failed = {0};
    while (fl_stream_has_room(&loading->importer.stream)) {
        struct frame frame;
        struct message message;
        uint32_t request = 0;
        const enum fl_stream_result result = fl_stream_next(&loading->importer.stream, &frame, &message, &failed);
        if (result == FL_STREAM_NOTHING)
            return true;
        if (result == FL_STREAM_ERROR)
            return from_client_error(error, &failed);
        const enum fl_relay_verdict verdict =
            fl_relay_from_importer(&loading->relay, &frame.header, &message, &request, &failed);
        if (verdict == FL_RELAY_REFUSE || !fl_importer_observe(&loading->importer, &message, &failed))
            return from_client_error(error, &failed);
        if (verdict == FL_RELAY_FORWARD && !handle(loading, &frame, &message, error))
            return false;
    }
    return true;
}

static bool converse(struct loading *loading, struct error *error)
{
    struct fl_importer *importer = &loading->importer;
    struct fl_error failed = {0};
    struct message credit = {.type = MESSAGE_CREDIT};
    credit.credit.channel = UPLOAD_CHANNEL;
    credit.credit.total = MEMORY_MAX_BYTES;
    if (!push(loading, 0, &credit, error))
        return false;
    for (;;) {
        if (!drain(loading, error))
            return false;
        if (importer->done)
            return true;
        if (importer->stream.ended) {
            fl_importer_explain(importer, &failed);
            return from_client_error(error, &failed);
        }
        struct pollfd polled = {.fd = importer->stream.fd, .events = fl_stream_events(&importer->stream)};
        if (!fl_wait(&polled, 1, 0, importer->deadline_ns, &failed))
            return from_client_error(error, &failed);
        if (!fl_stream_transfer(&importer->stream, &failed)) {
            fl_importer_explain(importer, &failed);
            return from_client_error(error, &failed);
        }
    }
}

/* Programs of the tests lie two folders below the helper programs. */
static void point_to_helpers(void)
{
    char path[4096];
    const ssize_t length = readlink("/proc/self/exe", path, sizeof(path) - 8);
    if (getenv("FARLIGHT_LIBEXEC") || length <= 0)
        return;
    path[length] = '\0';
    char *slash = strrchr(path, '/');
    if (slash) {
        memcpy(slash, "/../..", 7);
        setenv("FARLIGHT_LIBEXEC", path, 0);
    }
}

bool load_model(struct loaded_model *model, const char *path, struct error *error)
{
    static const struct scene_limits limits = {.host_bytes = MEMORY_MAX_BYTES};
    struct loading loading = {
        .model = model, .relay = {.scene = 1}, .importer = {.stream = {.fd = -1}, .process = {.talk_fd = -1}}};
    struct fl_error failed = {0};
    *model = (struct loaded_model){0};
    loading.hub.options.limits.blobs_per_client = UINT32_MAX;
    loading.hub.options.limits.texture_edge_texels = TEXTURE_EDGE_MAX_TEXELS;
    loading.hub.blobs = blob_store_create(MEMORY_MAX_BYTES, 0);
    loading.session.hub = &loading.hub;
    model->scene = scene_create(path, &limits);
    point_to_helpers();
    bool ok = model->scene && loading.hub.blobs;
    if (!ok)
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a scene");
    if (ok && !fl_importer_start(&loading.importer, &(struct fl_load_options){.model = path}, &failed))
        ok = from_client_error(error, &failed);
    else if (ok)
        ok = converse(&loading, error);
    fl_importer_finish(&loading.importer);
    finish_edits(&loading);
    free(loading.edits);
    if (loading.hub.blobs)
        upload_finish(&loading.session);
    blob_store_destroy(loading.hub.blobs);
    if (!ok)
        load_model_finish(model);
    return ok;
}

void load_model_finish(struct loaded_model *model)
{
    scene_destroy(model->scene);
    *model = (struct loaded_model){0};
}
