/* SPDX-License-Identifier: MIT */
/* Scenes and who holds them, on the thread that owns GL. */
#include "job/engine_private.h"

#include <stdlib.h>

/* ---- clients ------------------------------------------------------------------------------------ */

static struct engine_client *need_client(struct engine *engine, uint64_t number)
{
    struct engine_client *client = hashmap_get(&engine->clients, number);
    if (client)
        return client;
    client = calloc(1, sizeof *client);
    if (!client || !hashmap_put(&engine->clients, number, client)) {
        free(client);
        return NULL;
    }
    client->client = number;
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
    struct engine_client *client = need_client(engine, command->client);
    struct engine_reference *reference = client ? calloc(1, sizeof *reference) : NULL;
    if (!reference || !hashmap_put(&client->references, command->scene, reference)) {
        free(reference);
        return false;
    }
    *reference = (struct engine_reference){.client = client, .scene = scene, .id = command->scene};
    struct engine_reference **place = &scene->references;
    while (*place)
        place = &(*place)->next;
    *place = reference;
    return true;
}

/* Its jobs have ended, nothing that came by it waits. */
static void reference_remove(struct engine_reference *reference)
{
    struct engine_reference **place = &reference->scene->references;
    while (*place != reference)
        place = &(*place)->next;
    *place = reference->next;
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
    /* Only where memory was short does anything wait still. */
    while ((waiting = engine_take_waiting(reference->scene, reference))) {
        engine_post(engine, engine_cancelled(waiting->client, waiting->request, "its scene was closed"));
        engine_command_destroy(waiting);
    }
    reference_remove(reference);
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
        engine_abort_jobs(engine, reference, NULL);
        while ((waiting = engine_take_waiting(scene, reference)))
            engine_command_destroy(waiting);
        reference_remove(reference);
        engine_run_waiting(engine, scene); /* its frame may have been in progress */
        cursor = 0;                        /* the map has changed */
    }
    hashmap_remove(&engine->clients, client->client);
    hashmap_finish(&client->references);
    free(client);
}

/* ---- scenes ------------------------------------------------------------------------------------- */

/* Jobs have ended, nothing waits, it is out of the list. */
static void scene_free(struct engine *engine, struct engine_scene *scene)
{
    engine->backend->renderer_destroy(scene->renderer);
    engine->table_bytes -= scene->scene->table_bytes;
    scene_destroy(scene->scene);
    free(scene->waiting);
    free(scene);
}

void engine_reap_scenes(struct engine *engine)
{
    struct engine_scene **place = &engine->scenes;
    while (*place) {
        struct engine_scene *scene = *place;
        if (scene->references) {
            place = &scene->next;
            continue;
        }
        *place = scene->next;
        scene_free(engine, scene);
    }
}

static struct engine_scene *scene_add(struct engine *engine, const struct engine_command *command)
{
    struct engine_scene *scene = calloc(1, sizeof *scene);
    if (scene)
        scene->scene = scene_create(command->name, &engine->options.scene_limits);
    if (!scene || !scene->scene || !reference_add(engine, scene, command)) {
        if (scene)
            scene_destroy(scene->scene);
        free(scene);
        return NULL;
    }
    struct engine_scene **place = &engine->scenes;
    while (*place)
        place = &(*place)->next;
    *place = scene;
    return scene;
}

void engine_scene_open(struct engine *engine, const struct engine_command *command)
{
    struct error error = {0};
    if (engine_find_reference(engine, command->client, command->scene))
        error_set(&error, ERROR_INVALID, "scene_open.scene", "scene %u is open already", command->scene);
    else if (!scene_add(engine, command))
        error_set(&error, ERROR_OUT_OF_MEMORY, "scene_open", "no memory for a scene");
    if (error.kind)
        engine_post_failed(engine, command->client, command->request, &error);
    else
        engine_post_done(engine, command->client, command->request, 0);
}
