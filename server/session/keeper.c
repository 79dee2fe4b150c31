/* SPDX-License-Identifier: MIT */
#include "session/keeper.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "session/scene_record.h"

#include <inttypes.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>

#define SCENE 1u /* its number while it is restored */

#define CHECK_MS 50 /* interval of checks whether the daemon must stop */

static void name_record(uint8_t record_name[STORE_NAME_BYTES], uint64_t principal, const char *name)
{
    struct {
        uint64_t owner;
        char name[SCENE_NAME_MAX];
    } key = {.owner = principal_for_next_process(principal)};
    uint8_t hash[BLOB_HASH_BYTES];
    memcpy(key.name, name, strnlen(name, SCENE_NAME_MAX));
    blob_hash(hash, (const uint8_t *)&key, sizeof(key));
    memcpy(record_name, hash, STORE_NAME_BYTES);
}

/* ---- keeping ----------------------------------------------------------------------------------------- */

static void *read_scene(void *context, const struct scene *scene, uint64_t principal, enum sharing sharing,
                        const atomic_bool *abandoned)
{
    struct store *const *store = context;
    struct store_record *record = *store ? calloc(1, sizeof(*record)) : NULL;
    if (!record)
        return NULL;
    name_record(record->name, principal, scene->name);
    record->owner = principal_for_next_process(principal);
    if (scene_record_write(record, scene, sharing, abandoned))
        return record;
    if (!atomic_load(abandoned) && log_is_due(record->owner, "not kept"))
        log_write(LOG_WARNING, "store", "scene \"%s\" is not kept on disk: no memory", scene->name);
    store_record_finish(record);
    free(record);
    return NULL;
}

static void write_scene(void *context, void *made, const atomic_bool *abandoned)
{
    struct store *const *store = context;
    struct store_record *record = made;
    struct error error = {0};
    if (!store_put(*store, record, abandoned, &error) && log_is_due(record->owner, "not kept"))
        log_write(LOG_WARNING, "store", "a scene is not kept on disk: %s%s%s", error.text,
                  error.remedy[0] ? "; " : "", error.remedy);
    store_record_finish(record);
    free(record);
}

static void forget_scene(void *context, uint64_t principal, const char *name)
{
    uint8_t record_name[STORE_NAME_BYTES];
    struct store *const *store = context;
    name_record(record_name, principal, name);
    if (*store)
        store_remove(*store, record_name);
}

struct engine_keeper keeper_port(struct store **store)
{
    return (struct engine_keeper){
        .context = store, .read = read_scene, .write = write_scene, .forget = forget_scene};
}

/* ---- restoring --------------------------------------------------------------------------------------- */

struct restoring {
    struct store *store;
    struct hub *hub;
    uint64_t principal;
    uint64_t bytes;
};

/* The daemon's signals are blocked, and wait for its loop. */
static bool is_asked_to_stop(void)
{
    sigset_t pending;
    return sigpending(&pending) == 0 &&
           (sigismember(&pending, SIGTERM) == 1 || sigismember(&pending, SIGINT) == 1);
}

/* Loads a blob from the store into memory, where its next client finds it too. */
static struct blob *load_blob(struct restoring *restoring, const struct record_blob_ref *reference,
                              struct error *error)
{
    struct blob_store *blobs = restoring->hub->blobs;
    if (!blob_store_reserve(blobs, reference->size_bytes, error))
        return NULL;
    struct blob *read = store_read_blob(restoring->store, reference->hash, reference->size_bytes, error);
    blob_store_release(blobs, reference->size_bytes);
    struct blob *held = read ? blob_store_add(blobs, restoring->principal, read) : NULL;
    blob_unref(read);
    if (read && !held)
        error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory");
    restoring->bytes += reference->size_bytes;
    return held;
}

static bool resolve(void *context, const struct record_blob_ref *reference, const char *field, struct blob **blob,
                    struct error *error)
{
    struct restoring *restoring = context;
    (void)field;
    *blob = NULL;
    if (!reference->size_bytes)
        return true;
    if (is_asked_to_stop())
        return error_set(error, ERROR_CANCELLED, "", "the daemon stops");
    *blob = blob_store_find(restoring->hub->blobs, restoring->principal, reference->hash, reference->size_bytes);
    if (!*blob)
        *blob = load_blob(restoring, reference, error);
    return *blob != NULL;
}

/* Waits for an answer of the engine. False and *error: the daemon must stop, or a command of that client has
 * failed. */
static bool wait_for_answer(struct restoring *restoring, uint64_t client, uint32_t request, struct error *error)
{
    const struct engine_port *engine = &restoring->hub->options.engine;
    for (;;) {
        struct engine_event *event = engine->next_event(engine->context);
        if (event) {
            bool is_own = event->client == client, is_last = is_own && event->request == request;
            if (is_own && event->kind == ENGINE_FAILED && error->kind == ERROR_NONE)
                *error = event->error;
            engine_event_destroy(event);
            if (is_last)
                return error->kind == ERROR_NONE;
            continue;
        }
        struct pollfd events = {.fd = engine->event_fd(engine->context), .events = POLLIN};
        poll(&events, 1, CHECK_MS);
        if (is_asked_to_stop())
            return error_set(error, ERROR_CANCELLED, "", "the daemon stops");
    }
}

/* Submits a command and waits for its answer; takes over the contents of the command. */
static bool carry_out(struct restoring *restoring, struct engine_command *command, struct error *error)
{
    const struct engine_port *engine = &restoring->hub->options.engine;
    uint64_t client = command->client;
    uint32_t request = command->request;
    command->scene = SCENE;
    command->principal = restoring->principal;
    if (engine->submit(engine->context, command, error))
        return wait_for_answer(restoring, client, request, error);
    engine_command_destroy(command);
    return false;
}

/* Makes the scene with the commands of a client that opens, edits and closes it. Takes over the edits. */
static bool make_scene(struct restoring *restoring, struct scene_record *scene, struct error *error)
{
    uint64_t client = ++restoring->hub->last_number;
    struct engine_command *open = hub_command(ENGINE_SCENE_OPEN, client, 1);
    struct engine_command *commit = hub_command(ENGINE_COMMIT, client, 2);
    struct engine_command *gone = hub_command(ENGINE_CLIENT_GONE, client, 3);
    if (!open || !commit || !gone) {
        engine_command_destroy(open);
        engine_command_destroy(commit);
        engine_command_destroy(gone);
        return error_set(error, ERROR_OUT_OF_MEMORY, "", "no memory");
    }
    open->sharing = scene->sharing;
    open->kept_revision = scene->revision;
    memcpy(open->name, scene->name, sizeof(scene->name));
    commit->edits = scene->edits;
    commit->edit_count = scene->edit_count;
    scene->edits = NULL;
    scene->edit_count = 0;
    bool made = carry_out(restoring, open, error);
    if (made)
        made = carry_out(restoring, commit, error);
    else
        engine_command_destroy(commit);
    struct error gone_error = {0};
    return carry_out(restoring, gone, &gone_error) && made;
}

static bool restore_one(struct restoring *restoring, const uint8_t name[STORE_NAME_BYTES], struct error *error)
{
    struct store_record stored;
    struct scene_record scene;
    uint64_t start_ns = clock_now_ns();
    if (!store_try(restoring->store, name, &stored, error))
        return false;
    restoring->principal = stored.owner;
    restoring->bytes = 0;
    const struct edit_source source = {resolve, restoring, restoring->hub->options.limits.texture_edge_texels};
    bool restored = scene_record_read(&scene, stored.content, stored.content_bytes, &source, error);
    store_record_finish(&stored);
    if (!restored)
        return false;
    size_t edits = scene.edit_count;
    restored = make_scene(restoring, &scene, error);
    if (restored)
        log_write(LOG_INFO, "store", "restored scene \"%s\": %zu objects, %" PRIu64 " MiB, %" PRIu64 " ms",
                  scene.name, edits, restoring->bytes >> 20, (clock_now_ns() - start_ns) / 1000000);
    scene_record_finish(&scene);
    return restored;
}

void keeper_restore(struct store *store, struct hub *hub)
{
    struct restoring restoring = {.store = store, .hub = hub};
    size_t count;
    uint8_t(*names)[STORE_NAME_BYTES] = store_names(store, &count);
    for (size_t i = 0; i < count && !is_asked_to_stop(); i++) {
        struct error error = {0};
        bool restored = restore_one(&restoring, names[i], &error);
        store_tried(store, names[i]);
        if (restored || error.kind == ERROR_CANCELLED)
            continue;
        /* A scene that does not fit now may fit after another start. */
        bool stays = error.kind == ERROR_LIMIT || error.kind == ERROR_OUT_OF_MEMORY;
        log_write(LOG_WARNING, "store", "a scene cannot be restored, and %s: %s%s%s",
                  stays ? "stays on the disk" : "is removed", error.field, error.field[0] ? ": " : "", error.text);
        if (!stays)
            store_remove(store, names[i]);
    }
    free(names);
    blob_store_forget(hub->blobs, PRINCIPAL_NOBODY); /* their clients will not offer these blobs again */
}
