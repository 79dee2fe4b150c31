/* SPDX-License-Identifier: MIT */
/* Loads a model into the daemon: the importer's messages are checked, then passed on. */
#include "lib/scene.h"
#include "lib/importer.h"
#include "lib/relay.h"
#include "lib/text.h"
#include "protocol/common/clock.h"

#include <stdlib.h>
#include <string.h>
#include <xxhash.h>

#define ANSWER_NS 30000000000ull

struct load {
    struct fl_connection *connection;
    struct fl_importer *importer;
    struct fl_relay relay;
    uint64_t credit_passed;           /* the upload credit that the importer was given */
    uint64_t upload_begin_ns;         /* 0: nothing was sent */
    uint64_t commit_begin_ns;         /* 0: no commit is waiting for its answer */
    uint32_t commit_request;          /* number of the commit at the daemon */
    struct fl_error refusal;          /* the daemon's first error for an importer's request */
    struct fl_imported *imported;     /* this import's record; NULL: none is kept */
    const struct fl_imported *before; /* the previous import's record; NULL: everything is new */
    struct message commit;            /* the commit, queued until missing objects are removed; type 0: none */
    size_t gone_cursor;
    /* True if an object of `before` is missing; true if the load was given up unchanged. */
    bool removes, abandoned;
};

/* ---- from the importer to the daemon ---- */

static void count(struct load *load, const struct message *message, uint32_t request)
{
    struct fl_import_stats *stats = &load->importer->stats;
    if (message->type == MESSAGE_BLOB_OFFER) {
        for (uint32_t i = 0; i < message->blob_offer.blobs_count; i++)
            stats->offered_bytes += message->blob_offer.blobs[i].size_bytes;
    } else if (message->type == MESSAGE_BLOB_DATA) {
        if (load->upload_begin_ns == 0)
            load->upload_begin_ns = monotonic_now_ns();
        stats->uploaded_bytes += message->blob_data.data_bytes;
        load->connection->upload_sent += message->blob_data.data_bytes;
    } else if (message->type == MESSAGE_EDIT_COMMIT) {
        load->commit_begin_ns = monotonic_now_ns();
        load->commit_request = request;
    }
}

/* Ends the transaction in place of its commit: the daemon answers the commit's request as cancelled. */
static bool abandon(struct load *load, struct fl_error *error)
{
    struct message cancel = {.type = MESSAGE_CANCEL};
    cancel.cancel.target_request = load->commit_request;
    load->commit = (struct message){0};
    load->abandoned = true;
    return fl_stream_push(&load->connection->stream, load->relay.request_base + ++load->relay.max_request, 0,
                          &cancel, error);
}

/* Removes missing objects in the same transaction, then commits it. */
static bool remove_gone(struct load *load, struct fl_error *error)
{
    struct fl_stream *daemon = &load->connection->stream;
    const struct fl_imported_object *gone;
    while (fl_stream_has_room(daemon) &&
           (gone = fl_imported_gone(load->imported, load->before, &load->gone_cursor))) {
        struct message removal = {.type = MESSAGE_REMOVE, .remove = {.kind = gone->kind, .object = gone->id}};
        if (gone->kind == PROTOCOL_OBJECT_ENVIRONMENT) /* which cannot be removed, as each scene has one */
            return abandon(load, error);
        if (!fl_stream_push(daemon, load->commit_request, 0, &removal, error))
            return false;
        load->removes = true;
    }
    if (!fl_stream_has_room(daemon))
        return true;
    const struct message commit = load->commit;
    load->commit = (struct message){0};
    return fl_stream_push(daemon, load->commit_request, 0, &commit, error);
}

/* True if the daemon has this edit already. */
static bool is_known(struct load *load, const struct frame *frame, const struct message *message)
{
    return load->before && fl_imported_has(load->before, frame, message);
}

/* Handles one message of the importer's. */
static bool pass_on(struct load *load, const struct frame *frame, struct message *message, struct fl_error *error)
{
    uint32_t request = 0;
    const enum fl_relay_verdict verdict =
        fl_relay_from_importer(&load->relay, &frame->header, message, &request, error);
    if (verdict == FL_RELAY_REFUSE || !fl_importer_observe(load->importer, message, error))
        return false;
    if (verdict == FL_RELAY_LOCAL)
        return true;
    if (load->imported && !fl_imported_add(load->imported, frame, message, error))
        return false;
    if (is_known(load, frame, message))
        return true;
    count(load, message, request);
    if (message->type == MESSAGE_EDIT_COMMIT && load->before) {
        load->commit = *message;
        return remove_gone(load, error);
    }
    if (message->type == MESSAGE_EDIT_BEGIN)
        return fl_stream_push(&load->connection->stream, request, 0, message, error);
    struct framing_header header = frame->header;
    header.request = request;
    fl_stream_push_payload(&load->connection->stream, &header, frame->payload);
    return true;
}

/* Handles as many messages as the daemon's side can queue. */
static bool drain_importer(struct load *load, struct fl_error *error)
{
    if (!fl_connection_push_late(load->connection, error) || (load->commit.type != 0 && !remove_gone(load, error)))
        return false;
    while (load->commit.type == 0 && fl_stream_has_room(&load->connection->stream)) {
        struct frame frame;
        struct message message;
        const enum fl_stream_result result = fl_stream_next(&load->importer->stream, &frame, &message, error);
        if (result != FL_STREAM_MESSAGE)
            return result == FL_STREAM_NOTHING;
        if (!pass_on(load, &frame, &message, error))
            return false;
    }
    return true;
}

/* ---- from the daemon to the importer ---- */

static void take_answer(struct load *load, const struct frame *frame, const struct message *message)
{
    struct fl_import_stats *stats = &load->importer->stats;
    const uint64_t now_ns = monotonic_now_ns();
    if (message->type == MESSAGE_ERROR && load->refusal.code == FL_ERROR_NONE)
        fl_error_from_message(&load->refusal, &message->error);
    if (load->commit_begin_ns != 0 && frame->header.request == load->commit_request) {
        stats->commit_ns += now_ns - load->commit_begin_ns;
        load->commit_begin_ns = 0;
        if (message->type == MESSAGE_OK)
            stats->revision = message->ok.revision;
    } else if (load->upload_begin_ns != 0 && message->type == MESSAGE_OK) {
        stats->upload_ns = now_ns - load->upload_begin_ns;
    }
}

static bool pass_credit(struct load *load, struct fl_error *error)
{
    const uint64_t credit = fl_relay_credit(&load->relay, load->connection->upload_credit);
    if (credit <= load->credit_passed || !fl_stream_has_room(&load->importer->stream))
        return true;
    struct message message = {.type = MESSAGE_CREDIT};
    message.credit.channel = FL_UPLOAD_CHANNEL;
    message.credit.total = credit;
    load->credit_passed = credit;
    return fl_stream_push(&load->importer->stream, 0, 0, &message, error);
}

/* False: the connection is broken. */
static bool drain_daemon(struct load *load, struct fl_error *error)
{
    struct fl_connection *connection = load->connection;
    while (fl_stream_has_room(&load->importer->stream)) {
        struct frame frame;
        struct message message;
        const enum fl_stream_result result = fl_stream_next(&connection->stream, &frame, &message, error);
        if (result == FL_STREAM_NOTHING)
            break;
        if (result == FL_STREAM_ERROR)
            return fl_connection_break(connection, error);
        const int consumed = fl_connection_consume(connection, &frame.header, &message, error);
        if (consumed < 0)
            return false;
        struct framing_header header = frame.header;
        if (consumed == 0 && fl_relay_from_daemon(&load->relay, &frame.header, &header.request)) {
            take_answer(load, &frame, &message);
            fl_stream_push_payload(&load->importer->stream, &header, frame.payload);
        }
    }
    return pass_credit(load, error);
}

/* ---- both ---- */

static bool exchange(struct load *load, struct fl_error *error)
{
    struct fl_connection *connection = load->connection;
    struct fl_stream *daemon = &connection->stream, *importer = &load->importer->stream;
    struct pollfd polled[2] = {{.fd = daemon->fd, .events = fl_stream_events(daemon)},
                               {.fd = importer->fd, .events = fl_stream_events(importer)}};
    const uint64_t deadline_ns = load->importer->deadline_ns;
    const uint64_t until_ns = connection->check_ns < deadline_ns ? connection->check_ns : deadline_ns;
    if (!fl_wait(polled, 2, connection->interrupt_fd, until_ns, error)) {
        if (error->code == FL_ERROR_TIMEOUT && until_ns == deadline_ns)
            fl_error_set(error, FL_ERROR_TIMEOUT, fl_importer_name(load->importer), "the import timed out");
        if (error->code != FL_ERROR_TIMEOUT || until_ns == deadline_ns)
            return false;
        *error = (struct fl_error){0};
    }
    if (!fl_stream_transfer(daemon, error))
        return fl_connection_break(connection, error);
    if (!fl_stream_transfer(importer, error))
        return fl_importer_explain(load->importer, error);
    return fl_connection_check_silence(connection, error);
}

static bool relay_all(struct load *load, struct fl_error *error)
{
    struct fl_stream *daemon = &load->connection->stream, *importer = &load->importer->stream;
    for (;;) {
        if (!drain_importer(load, error) || !drain_daemon(load, error))
            return false;
        if (load->importer->done && load->refusal.code == FL_ERROR_NONE)
            return true;
        if (daemon->ended) {
            fl_error_set(error, FL_ERROR_CONNECTION, "", "the daemon closed the connection");
            return fl_connection_break(load->connection, error);
        }
        /* Its last messages may wait for space towards the daemon. */
        if (importer->ended && fl_stream_has_room(daemon)) {
            if (load->refusal.code == FL_ERROR_NONE)
                return fl_importer_explain(load->importer, error);
            *error = load->refusal;
            return false;
        }
        if (!exchange(load, error))
            return false;
    }
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

static bool open_scene(struct fl_connection *connection, uint32_t scene, const struct fl_importer *importer,
                       struct fl_error *error)
{
    struct message open = {.type = MESSAGE_SCENE_OPEN};
    const struct fl_load_options *options = &importer->options;
    char short_name[129];
    fl_text_utf8(options->scene_name ? options->scene_name : base_name(fl_importer_name(importer)), short_name,
                 sizeof(short_name));
    open.scene_open.scene = scene;
    open.scene_open.sharing = options->sharing;
    open.scene_open.name = short_name;
    const uint32_t request = fl_connection_next_request(connection);
    struct fl_received received;
    return fl_connection_send(connection, request, 0, &open, error) &&
           fl_connection_answer(connection, request, MESSAGE_OK, &received, monotonic_now_ns() + ANSWER_NS, error);
}

/* Passes an import on into a scene that the daemon has. */
static bool pass_all(struct load *load, struct fl_scene *scene, struct fl_error *error)
{
    struct fl_connection *connection = scene->connection;
    load->connection = connection;
    load->relay = (struct fl_relay){
        .scene = scene->scene, .request_base = connection->last_request, .upload_base = connection->upload_sent};
    const bool loaded = relay_all(load, error);
    connection->last_request = load->relay.request_base + load->relay.max_request;
    fl_importer_stop(load->importer);
    return loaded;
}

struct fl_import {
    struct fl_importer importer;
};

struct fl_import *fl_import_start(const struct fl_load_options *options, struct fl_error *error)
{
    struct fl_import *started = calloc(1, sizeof(*started));
    if (!started)
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    else if (fl_importer_start(&started->importer, options, error))
        return started;
    free(started);
    return NULL;
}

void fl_import_destroy(struct fl_import *started)
{
    if (!started)
        return;
    fl_importer_finish(&started->importer);
    free(started);
}

/* Options of the start stay; only the callbacks may be set now. */
static void adopt_callbacks(struct fl_importer *importer, const struct fl_load_options *options)
{
    importer->options.note = options->note;
    importer->options.progress = options->progress;
    importer->options.user = options->user;
    importer->options.sharing = options->sharing;
    importer->options.scene_name = options->scene_name;
    importer->options.will_reload = options->will_reload;
    importer->begin_ns = monotonic_now_ns(); /* `load_ns` is the caller's waiting time */
}

/* Moves the import's results into the scene, in place of an earlier import's. */
static void adopt_import(struct fl_scene *scene, struct fl_importer *importer, struct fl_imported *imported)
{
    fl_scene_forget_import(scene);
    scene->stats = importer->stats;
    if (scene->stats.revision > scene->revision)
        scene->revision = scene->stats.revision;
    scene->cameras = importer->cameras;
    scene->camera_count = importer->camera_count;
    importer->cameras = NULL;
    importer->camera_count = 0;
    scene->files = importer->files;
    scene->file_count = importer->file_count;
    importer->files = NULL;
    importer->file_count = 0;
    scene->catalogue = importer->catalogue;
    importer->catalogue = (struct fl_catalogue){0};
    scene->imported = *imported;
    *imported = (struct fl_imported){0};
}

/* The importer reads the file while the daemon creates the scene. */
static struct fl_scene *load_started(struct fl_connection *connection, struct fl_importer *importer,
                                     struct fl_error *error)
{
    struct fl_imported imported = {0};
    struct load load = {.importer = importer, .imported = importer->options.will_reload ? &imported : NULL};
    struct fl_scene *scene = fl_scene_create(connection, error);
    if (!scene)
        return NULL;
    if (open_scene(connection, scene->scene, importer, error) && pass_all(&load, scene, error)) {
        adopt_import(scene, importer, &imported);
        return scene;
    }
    fl_imported_finish(&imported);
    fl_scene_destroy(scene);
    return NULL;
}

struct fl_scene *fl_scene_load(struct fl_connection *connection, const struct fl_load_options *options,
                               struct fl_error *error)
{
    struct fl_scene *scene = NULL;
    struct fl_import *started = options->started;
    if (!started && fl_connection_check(connection, error))
        started = fl_import_start(options, error);
    if (!started)
        return NULL;
    adopt_callbacks(&started->importer, options);
    if (fl_connection_check(connection, error))
        scene = load_started(connection, &started->importer, error);
    fl_import_destroy(started);
    return scene;
}

uint64_t fl_scene_import_digest(const struct fl_scene *scene)
{
    uint64_t sum = scene->imported.count;
    for (size_t i = 0; i < scene->imported.capacity; i++) {
        const struct fl_imported_object *object = &scene->imported.places[i];
        const uint64_t words[] = {object->kind, object->id, object->digest};
        sum += object->is_there ? XXH3_64bits(words, sizeof(words)) : 0;
    }
    return sum;
}

/* Reloads by differences. *abandoned: a missing object cannot be removed; nothing has changed. */
static bool load_changes(struct fl_scene *scene, struct fl_importer *importer, bool *abandoned,
                         struct fl_error *error)
{
    struct fl_imported imported = {0};
    struct load load = {.importer = importer, .imported = &imported, .before = &scene->imported};
    const bool loaded = pass_all(&load, scene, error);
    if (loaded)
        adopt_import(scene, importer, &imported);
    fl_imported_finish(&imported);
    *abandoned = (load.abandoned || load.removes) && load.refusal.code != FL_ERROR_NONE;
    return loaded;
}

struct fl_scene *fl_scene_reload(struct fl_scene *scene, const struct fl_load_options *options,
                                 struct fl_error *error)
{
    bool abandoned = scene->imported.count == 0 && !scene->attached;
    if (!abandoned) {
        struct fl_import *started =
            fl_connection_check(scene->connection, error) ? fl_import_start(options, error) : NULL;
        if (!started)
            return NULL;
        adopt_callbacks(&started->importer, options);
        const bool loaded = load_changes(scene, &started->importer, &abandoned, error);
        fl_import_destroy(started);
        if (loaded || !abandoned)
            return loaded ? scene : NULL;
        *error = (struct fl_error){0};
    }
    struct fl_scene *other = fl_scene_load(scene->connection, options, error);
    if (other)
        fl_scene_destroy(scene);
    return other;
}
