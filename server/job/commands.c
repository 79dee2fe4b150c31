/* SPDX-License-Identifier: MIT */
/* Commands of the clients, on the thread that owns GL. */
#include "job/engine_private.h"

#include "base/clock.h"

#include <stdlib.h>
#include <string.h>

/* Commands that may wait for one scene's frames; more are answered with busy. */
#define WAITING_MAX 256

void engine_command_destroy(struct engine_command *command)
{
    if (!command)
        return;
    for (size_t i = 0; i < command->edit_count; i++)
        scene_edit_finish(&command->edits[i]);
    free(command->edits);
    free(command->job.keys);
    free(command->job.clips);
    free(command);
}

static void fail(struct engine *engine, const struct engine_command *command, const struct error *error)
{
    engine_post_failed(engine, command->client, command->request, error);
}

static void done(struct engine *engine, const struct engine_command *command, uint64_t revision)
{
    engine_post_done(engine, command->client, command->request, revision);
}

static struct engine_event *cancelled_event(uint64_t client, uint32_t request, const char *why)
{
    struct engine_event *event = event_create(ENGINE_FAILED, client, request);
    if (event)
        error_set(&event->error, ERROR_CANCELLED, "", "%s", why);
    return event;
}

/* ---- clients and scenes ------------------------------------------------------------------------- */

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

static struct engine_scene *find_scene(struct engine *engine, uint64_t client_number, uint32_t id)
{
    struct engine_client *client = hashmap_get(&engine->clients, client_number);
    return client ? hashmap_get(&client->scenes, id) : NULL;
}

static void scene_open(struct engine *engine, struct engine_command *command)
{
    struct error error = {0};
    if (find_scene(engine, command->client, command->scene)) {
        error_set(&error, ERROR_INVALID, "scene_open.scene", "scene %u is open already", command->scene);
        fail(engine, command, &error);
        return;
    }
    struct engine_client *client = need_client(engine, command->client);
    struct engine_scene *scene = client ? calloc(1, sizeof *scene) : NULL;
    if (scene)
        scene->scene = scene_create(command->name, &engine->options.scene_limits);
    if (!scene || !scene->scene || !hashmap_put(&client->scenes, command->scene, scene)) {
        if (scene)
            scene_destroy(scene->scene);
        free(scene);
        error_set(&error, ERROR_OUT_OF_MEMORY, "scene_open", "no memory for a scene");
        fail(engine, command, &error);
        return;
    }
    scene->client = client;
    scene->id = command->scene;
    done(engine, command, 0);
}

static void abort_jobs(struct engine *engine, const struct engine_scene *scene, const char *why)
{
    for (size_t i = engine->job_count; i-- > 0;) {
        struct job *job = engine->jobs[i];
        if (job->scene == scene)
            job_abort(engine, job, why ? cancelled_event(job->client, job->request, why) : NULL);
    }
}

/* Jobs have ended, nothing waits. */
static void scene_free(struct engine *engine, struct engine_scene *scene)
{
    hashmap_remove(&scene->client->scenes, scene->id);
    scene_drop_shared(engine, scene);
    engine->table_bytes -= scene->scene->table_bytes;
    scene_destroy(scene->scene);
    free(scene->idle);
    free(scene->waiting);
    free(scene);
}

static void scene_close(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    abort_jobs(engine, scene, "its scene was closed");
    /* What came before is answered before. */
    engine_run_waiting(engine, scene);
    abort_jobs(engine, scene, "its scene was closed");
    scene_free(engine, scene);
    done(engine, command, 0);
}

void engine_forget_client(struct engine *engine, struct engine_client *client)
{
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&client->scenes, &cursor, NULL, &value)) {
        struct engine_scene *scene = value;
        abort_jobs(engine, scene, NULL);
        for (size_t i = 0; i < scene->waiting_count; i++)
            engine_command_destroy(scene->waiting[i]);
        scene->waiting_count = 0;
        scene_free(engine, scene);
        cursor = 0; /* the map has changed */
    }
    hashmap_remove(&engine->clients, client->client);
    hashmap_finish(&client->scenes);
    free(client);
}

static void client_gone(struct engine *engine, struct engine_command *command)
{
    struct engine_client *client = hashmap_get(&engine->clients, command->client);
    if (client)
        engine_forget_client(engine, client);
    engine_post(engine, event_create(ENGINE_CLIENT_FORGOTTEN, command->client, command->request));
}

/* ---- what frames in progress keep waiting ------------------------------------------------------- */

/* Blobs are limited where they are held, as scenes share them; tables here, all scenes together. */
static bool commit_within_limits(struct engine *engine, struct scene *scene, struct engine_command *command,
                                 struct error *error)
{
    uint64_t limit_bytes = engine->options.scene_limits.host_bytes;
    uint64_t others_bytes = engine->table_bytes - scene->table_bytes;
    if (limit_bytes)
        scene->limits.table_bytes = others_bytes < limit_bytes ? limit_bytes - others_bytes : 1;
    bool applied = scene_commit(scene, command->edits, command->edit_count, error);
    engine->table_bytes = others_bytes + scene->table_bytes;
    return applied;
}

static void commit(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    struct error error = {0};
    uint64_t start_ns = clock_now_ns();
    bool applied = commit_within_limits(engine, scene->scene, command, &error);
    if (!applied) {
        fail(engine, command, &error);
        return;
    }
    if (!scene->apply_ns)
        scene->apply_start_ns = start_ns;
    scene->apply_ns += clock_now_ns() - start_ns;
    done(engine, command, scene->scene->revision);
}

static void start(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    struct error error = {0};
    if (!job_start(engine, scene, command, &error))
        fail(engine, command, &error);
}

static void wait_for_frames(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    struct engine_command **waiting = NULL;
    if (scene->waiting_count < WAITING_MAX)
        waiting = realloc(scene->waiting, (scene->waiting_count + 1) * sizeof *waiting);
    if (waiting) {
        scene->waiting = waiting;
        waiting[scene->waiting_count++] = command;
        return;
    }
    struct error error = {0};
    error_set(&error, ERROR_BUSY, "", "%zu requests wait for frames in progress already", scene->waiting_count);
    fail(engine, command, &error);
    engine_command_destroy(command);
}

/* For commands that name a scene. */
static void handle_of_scene(struct engine *engine, struct engine_command *command)
{
    struct engine_scene *scene = find_scene(engine, command->client, command->scene);
    if (!scene) {
        struct error error = {0};
        const char *field = command->kind == ENGINE_JOB_START     ? "render.scene"
                            : command->kind == ENGINE_SCENE_CLOSE ? "scene_close.scene"
                                                                  : "edit_begin.scene";
        error_set(&error, ERROR_UNKNOWN_ID, field, "there is no scene %u", command->scene);
        fail(engine, command, &error);
    } else if (command->kind == ENGINE_SCENE_CLOSE) {
        scene_close(engine, scene, command);
    } else if ((command->kind == ENGINE_COMMIT && scene->frames) || scene->waiting_count) {
        wait_for_frames(engine, scene, command);
        return;
    } else if (command->kind == ENGINE_COMMIT) {
        commit(engine, scene, command);
    } else {
        start(engine, scene, command);
    }
    engine_command_destroy(command);
}

void engine_run_waiting(struct engine *engine, struct engine_scene *scene)
{
    if (scene->frames || !scene->waiting_count)
        return;
    /* Nothing here begins a frame, so all of them can be carried out. */
    struct engine_command **waiting = scene->waiting;
    size_t count = scene->waiting_count;
    scene->waiting = NULL;
    scene->waiting_count = 0;
    for (size_t i = 0; i < count; i++)
        handle_of_scene(engine, waiting[i]);
    free(waiting);
}

/* ---- jobs --------------------------------------------------------------------------------------- */

/* A command of that request that waits for frames; NULL: there is none. `taken`: takes it out. */
static struct engine_command *find_waiting(struct engine *engine, uint64_t client_number, uint32_t request,
                                           bool take)
{
    struct engine_client *client = hashmap_get(&engine->clients, client_number);
    size_t cursor = 0;
    void *value;
    while (client && hashmap_next(&client->scenes, &cursor, NULL, &value)) {
        struct engine_scene *scene = value;
        for (size_t i = 0; i < scene->waiting_count; i++) {
            struct engine_command *command = scene->waiting[i];
            if (command->request != request)
                continue;
            if (take)
                memmove(&scene->waiting[i], &scene->waiting[i + 1],
                        (--scene->waiting_count - i) * sizeof *scene->waiting);
            return command;
        }
    }
    return NULL;
}

static void job_cancel(struct engine *engine, struct engine_command *command)
{
    uint32_t target = command->target_request;
    struct job *job = job_find(engine, command->client, target);
    if (job) {
        struct engine_scene *scene = job->scene;
        job_abort(engine, job, cancelled_event(command->client, target, "the client cancelled it"));
        engine_run_waiting(engine, scene);
    } else {
        struct engine_command *waiting = find_waiting(engine, command->client, target, true);
        if (waiting)
            engine_post(engine, cancelled_event(command->client, target, "the client cancelled it"));
        engine_command_destroy(waiting);
    }
    done(engine, command, 0);
}

static void job_credit(struct engine *engine, const struct engine_command *command)
{
    struct job *job = job_find(engine, command->client, command->target_request);
    if (job) {
        job_output_credit(job->output, command->credit);
        return;
    }
    struct engine_command *waiting = find_waiting(engine, command->client, command->target_request, false);
    if (waiting && command->credit > waiting->job.credit)
        waiting->job.credit = command->credit;
}

static void report_stats(struct engine *engine, const struct engine_command *command)
{
    struct engine_event *event = event_create(ENGINE_STATS_READY, command->client, command->request);
    if (event)
        event->stats = engine_stats_collect(engine);
    if (event && !event->stats) {
        event->kind = ENGINE_FAILED;
        error_set(&event->error, ERROR_OUT_OF_MEMORY, "stats", "no memory for an answer");
    }
    engine_post(engine, event);
}

void engine_handle(struct engine *engine, struct engine_command *command)
{
    switch (command->kind) {
    case ENGINE_SCENE_CLOSE:
    case ENGINE_COMMIT:
    case ENGINE_JOB_START:
        handle_of_scene(engine, command);
        return;
    case ENGINE_SCENE_OPEN:
        scene_open(engine, command);
        break;
    case ENGINE_JOB_CREDIT:
        job_credit(engine, command);
        break;
    case ENGINE_JOB_CANCEL:
        job_cancel(engine, command);
        break;
    case ENGINE_STATS:
        report_stats(engine, command);
        break;
    case ENGINE_CLIENT_GONE:
        client_gone(engine, command);
        break;
    }
    engine_command_destroy(command);
}
