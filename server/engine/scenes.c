/* SPDX-License-Identifier: MIT */
/* Scenes and their holders, on the thread that owns GL. */
#include "engine/engine_private.h"

#include "base/clock.h"

#include <stdlib.h>
#include <string.h>

/* ---- clients ------------------------------------------------------------------------------------ */

static struct engine_client *need_client(struct engine *engine, const struct engine_command *command)
{
    struct engine_client *client = hashmap_get(&engine->clients, command->client);
    if (client)
        return client;
    client = calloc(1, sizeof(*client));
    if (!client || !hashmap_put(&engine->clients, command->client, client)) {
        free(client);
        return NULL;
    }
    client->client = command->client;
    client->principal = command->principal;
    return client;
}

struct engine_reference *engine_find_reference(struct engine *engine, uint64_t client_number, uint32_t id)
{
    struct engine_client *client = hashmap_get(&engine->clients, client_number);
    return client ? hashmap_get(&client->references, id) : NULL;
}

/* ---- references --------------------------------------------------------------------------------- */

static bool reference_add(struct engine *engine, struct engine_scene *scene, const struct engine_command *command)
{
    struct engine_client *client = need_client(engine, command);
    struct engine_reference *reference = client ? calloc(1, sizeof(*reference)) : NULL;
    if (!reference || !hashmap_put(&client->references, command->scene, reference)) {
        free(reference);
        return false;
    }
    *reference = (struct engine_reference){.client = client, .scene = scene, .id = command->scene};
    struct engine_reference **place = &scene->references;
    while (*place)
        place = &(*place)->next;
    *place = reference;
    scene->is_restored = false;
    return true;
}

/* Removes a reference whose jobs have ended and by which no command waits. */
static void reference_remove(struct engine *engine, struct engine_reference *reference)
{
    struct engine_reference **place = &reference->scene->references;
    reference_drop_idle(engine, reference);
    while (*place != reference)
        place = &(*place)->next;
    *place = reference->next;
    if (!reference->scene->references)
        reference->scene->left_ns = clock_now_ns();
    hashmap_remove(&reference->client->references, reference->id);
    free(reference);
}

void engine_abort_jobs(struct engine *engine, const struct engine_reference *reference, const char *why)
{
    for (size_t i = engine->job_count; i-- > 0;) {
        struct job *job = engine->jobs[i];
        if (job->reference == reference)
            job_abort(engine, job, why ? engine_cancelled(job->client, job->request, why) : NULL);
    }
}

void engine_scene_close(struct engine *engine, struct engine_reference *reference,
                        const struct engine_command *command)
{
    struct engine_command *waiting;
    engine_abort_jobs(engine, reference, "its scene was closed");
    /* Commands still wait only where memory was short. */
    while ((waiting = engine_take_waiting(reference->scene, reference))) {
        engine_post(engine, engine_cancelled(waiting->client, waiting->request, "its scene was closed"));
        engine_command_destroy(waiting);
    }
    reference_remove(engine, reference);
    engine_post_done(engine, command->client, command->request, 0);
}

void engine_forget_client(struct engine *engine, struct engine_client *client)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&client->references, &cursor, NULL, &value)) {
        struct engine_reference *reference = value;
        struct engine_scene *scene = reference->scene;
        struct engine_command *waiting;
        const struct engine_command *running = scene->commit ? scene->commit->command : NULL;
        if (running && running->client == client->client && running->scene == reference->id)
            atomic_store(&scene->commit->abandoned, true);
        engine_abort_jobs(engine, reference, NULL);
        while ((waiting = engine_take_waiting(scene, reference)))
            engine_command_destroy(waiting);
        reference_remove(engine, reference);
        engine_run_waiting(engine, scene); /* its frame may have been in progress */
        cursor = 0;                        /* the map has changed */
    }
    hashmap_remove(&engine->clients, client->client);
    hashmap_finish(&client->references);
    free(client);
}

/* ---- scenes ------------------------------------------------------------------------------------- */

bool engine_scene_may_change(const struct engine *engine, const struct engine_scene *scene)
{
    return !scene->frames && !scene->commit && engine->read_scene != scene;
}

/* Frees a scene whose jobs have ended and for which nothing waits. */
void engine_scene_free(struct engine *engine, struct engine_scene *scene)
{
    scene_drop_shared(engine, scene);
    engine->table_bytes -= scene->known.table_bytes;
    scene_destroy(scene->scene);
    free(scene->description);
    free(scene->waiting);
    free(scene);
}

/* Ends a scene without a holder. */
static void scene_end(struct engine *engine, struct engine_scene *scene)
{
    bool lingered = scene->sharing != SHARING_PRIVATE;
    struct engine_scene **place = &engine->scenes;
    while (*place != scene)
        place = &(*place)->next;
    *place = scene->next;
    engine_forget_kept(engine, scene);
    if (engine->read_scene == scene)
        engine->read_scene_ended = true;
    else
        engine_scene_free(engine, scene);
    if (lingered)
        engine_post(engine, event_create(ENGINE_SCENE_ENDED, 0, 0));
}

/* The end of a scene without a holder; 0: now. Neither an empty scene lingers, nor one that could not be restored.
 */
static uint64_t lingers_until_ns(const struct engine *engine, const struct engine_scene *scene)
{
    bool is_empty = !scene->known.revision || scene->known.revision < scene->kept_revision;
    if (scene->sharing == SHARING_PRIVATE || is_empty || !engine->options.limits.scene_linger_ms)
        return 0;
    return scene->left_ns + engine->options.limits.scene_linger_ms * UINT64_C(1000000);
}

/* Whether nobody holds the scene and no other thread changes it. */
static bool is_left(const struct engine_scene *scene)
{
    return !scene->references && !scene->commit;
}

/* Scene that has lingered longest; NULL: there is none. */
static struct engine_scene *first_to_go(const struct engine *engine, bool restored_too)
{
    struct engine_scene *first = NULL;
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        if (is_left(scene) && (restored_too || !scene->is_restored) && (!first || scene->left_ns < first->left_ns))
            first = scene;
    }
    return first;
}

/* Ends the scenes whose time has passed. Returns how many of the rest count against the limit; *wait_ns: time
 * until the next one ends. */
static size_t end_overdue(struct engine *engine, uint64_t *wait_ns)
{
    uint64_t now_ns = clock_now_ns();
    size_t count = 0;
    *wait_ns = UINT64_MAX;
    for (struct engine_scene *scene = engine->scenes, *next; scene; scene = next) {
        next = scene->next;
        if (!is_left(scene))
            continue;
        uint64_t until_ns = lingers_until_ns(engine, scene);
        if (until_ns <= now_ns) {
            scene_end(engine, scene);
            continue;
        }
        count += !scene->is_restored;
        *wait_ns = until_ns - now_ns < *wait_ns ? until_ns - now_ns : *wait_ns;
    }
    return count;
}

uint64_t engine_reap_scenes(struct engine *engine)
{
    uint64_t wait_ns;
    while (end_overdue(engine, &wait_ns) > engine->options.limits.lingering_scenes)
        scene_end(engine, first_to_go(engine, false));
    return wait_ns;
}

void engine_end_left_scenes(struct engine *engine)
{
    for (struct engine_scene *scene; (scene = first_to_go(engine, true));)
        scene_end(engine, scene);
}

uint64_t engine_left_table_bytes(const struct engine *engine)
{
    uint64_t bytes = 0;
    for (const struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        bytes += is_left(scene) ? scene->known.table_bytes : 0;
    return bytes;
}

void engine_trim_tables(struct engine *engine)
{
    uint64_t limit_bytes = engine->options.limits.scene.host_bytes;
    struct engine_scene *scene;
    if (!limit_bytes || engine->table_bytes - engine_left_table_bytes(engine) > limit_bytes)
        return;
    while (engine->table_bytes > limit_bytes && (scene = first_to_go(engine, true)))
        scene_end(engine, scene);
}

/* Upper bound of the blobs' bytes: other scenes may use them too. */
static uint64_t blob_bytes_of(const struct engine_scene *scene)
{
    return scene->known.host_bytes - scene->known.table_bytes;
}

void engine_trim_blobs(struct engine *engine, uint64_t bytes)
{
    uint64_t left_bytes = 0;
    for (const struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        left_bytes += is_left(scene) ? blob_bytes_of(scene) : 0;
    struct engine_scene *scene;
    if (left_bytes < bytes)
        return;
    for (uint64_t freed_bytes = 0; freed_bytes < bytes && (scene = first_to_go(engine, true));) {
        freed_bytes += blob_bytes_of(scene);
        scene_end(engine, scene);
    }
}

/* ---- attaching to a scene ----------------------------------------------------------------------- */

/* The scene of that name, the client's own kept one before a shared one; NULL: none. */
static struct engine_scene *find_by_name(const struct engine *engine, const struct engine_command *command)
{
    struct engine_scene *found = NULL;
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        if (engine_scene_is_open_to(scene, command->principal) && strcmp(scene->scene->name, command->name) == 0 &&
            (!found || scene->sharing == SHARING_KEPT))
            found = scene;
    }
    return found;
}

/* A scene whose name collides: two scenes of one principal, or two shared ones. Kept scenes of others do not
 * count. */
static struct engine_scene *find_namesake(const struct engine *engine, const struct engine_command *command)
{
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        bool is_own = scene->principal == command->principal && scene->sharing != SHARING_PRIVATE;
        bool are_shared = scene->sharing == SHARING_SHARED && command->sharing == SHARING_SHARED;
        if ((is_own || are_shared) && strcmp(scene->scene->name, command->name) == 0)
            return scene;
    }
    return NULL;
}

/* A client's own scene without a holder cedes its name to a new one. */
static bool name_is_free(struct engine *engine, const struct engine_command *command, struct error *error)
{
    if (command->sharing == SHARING_PRIVATE)
        return true;
    if (!command->name[0])
        return error_set(error, ERROR_INVALID, "scene_open.name", "a kept or shared scene needs a name");
    struct engine_scene *other;
    while ((other = find_namesake(engine, command)) && is_left(other) && other->principal == command->principal)
        scene_end(engine, other);
    if (!other)
        return true;
    error_set(error, ERROR_INVALID, "scene_open.name", "a scene \"%s\" exists already", command->name);
    return error_remedy(error, "attach to it, or choose another name");
}

void engine_scene_note(struct engine *engine, struct engine_scene *scene)
{
    const struct scene *from = scene->scene;
    engine->table_bytes += from->table_bytes - scene->known.table_bytes;
    scene->known = (struct scene_known){
        .revision = from->revision,
        .host_bytes = from->host_bytes,
        .table_bytes = from->table_bytes,
        .nodes = (uint32_t)from->objects[OBJECT_NODE].count,
    };
}

static bool scene_add(struct engine *engine, const struct engine_command *command)
{
    struct engine_scene *scene = calloc(1, sizeof(*scene));
    if (scene)
        scene->scene = scene_create(command->name, &engine->options.limits.scene);
    if (!scene || !scene->scene || !reference_add(engine, scene, command)) {
        if (scene)
            scene_destroy(scene->scene);
        free(scene);
        return false;
    }
    scene->frames_ended = 1;
    scene->sharing = command->sharing;
    scene->principal = command->principal;
    if (command->kept_revision) {
        scene->scene->revision = command->kept_revision - 1;
        scene->kept_revision = command->kept_revision;
        scene->is_restored = true;
    }
    engine_scene_note(engine, scene);
    struct engine_scene **place = &engine->scenes;
    while (*place)
        place = &(*place)->next;
    *place = scene;
    return true;
}

static void answer(struct engine *engine, const struct engine_command *command, const struct error *error,
                   uint64_t revision)
{
    if (error->kind)
        engine_post_failed(engine, command->client, command->request, error);
    else
        engine_post_done(engine, command->client, command->request, revision);
}

void engine_scene_open(struct engine *engine, const struct engine_command *command)
{
    struct error error = {0};
    if (engine_find_reference(engine, command->client, command->scene))
        error_set(&error, ERROR_INVALID, "scene_open.scene", "scene %u is open already", command->scene);
    else if (name_is_free(engine, command, &error) && !scene_add(engine, command))
        error_set(&error, ERROR_OUT_OF_MEMORY, "scene_open", "no memory for a scene");
    answer(engine, command, &error, 0);
}

void engine_scene_attach(struct engine *engine, const struct engine_command *command)
{
    struct error error = {0};
    struct engine_scene *scene = find_by_name(engine, command);
    if (engine_find_reference(engine, command->client, command->scene)) {
        error_set(&error, ERROR_INVALID, "scene_attach.scene", "scene %u is open already", command->scene);
    } else if (!scene) {
        error_set(&error, ERROR_UNKNOWN_ID, "scene_attach.name", "no scene \"%s\" is shared, or kept for you",
                  command->name);
        error_remedy(&error, "'farlight scenes' lists those that are");
    } else if (!reference_add(engine, scene, command)) {
        error_set(&error, ERROR_OUT_OF_MEMORY, "scene_attach", "no memory");
    }
    answer(engine, command, &error, error.kind ? 0 : scene->known.revision);
}

void engine_scene_changed(struct engine *engine, const struct engine_scene *scene,
                          const struct engine_reference *by)
{
    for (const struct engine_reference *one = scene->references; one; one = one->next) {
        struct engine_event *event = one == by ? NULL : event_create(ENGINE_SCENE_CHANGED, one->client->client, 0);
        if (!event)
            continue; /* lacking memory, the notice of the next change will do for this one too */
        event->scene = one->id;
        event->revision = scene->known.revision;
        engine_post(engine, event);
    }
}
