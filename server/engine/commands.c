/* SPDX-License-Identifier: MIT */
/* Commands of the clients, on the thread that owns GL. */
#include "engine/engine_private.h"

#include "base/clock.h"

#include <stdlib.h>
#include <string.h>

/* Maximum of commands that wait for one scene's frames; further ones are answered with busy. */
#define WAITING_MAX 256
/* Instances times primitives of a scene whose bounds are found at once: some milliseconds. */
#define SEARCHED_HERE_MAX (UINT64_C(1) << 22)

void engine_command_release_edits(struct engine_command *command)
{
    for (size_t i = 0; i < command->edit_count; i++)
        scene_edit_finish(&command->edits[i]);
    free(command->edits);
    command->edits = NULL;
    command->edit_count = 0;
}

void engine_command_destroy(struct engine_command *command)
{
    if (!command)
        return;
    engine_command_release_edits(command);
    free(command->job.keys);
    free(command->job.clips);
    view_mailbox_unref(command->job.mailbox);
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

/* ---- commands that wait for frames in progress ------------------------------------------------------- */

/* Blobs are limited by their store, as scenes share them; the tables of all scenes are limited here. Scenes
 * without a holder are evicted only if that releases enough, which is known beforehand. */
static void limit_tables(const struct engine *engine, struct engine_scene *scene)
{
    uint64_t limit_bytes = engine->options.limits.scene.host_bytes;
    uint64_t held_bytes = engine->table_bytes - scene->known.table_bytes - engine_left_table_bytes(engine);
    held_bytes += engine->promised_bytes;
    if (limit_bytes)
        scene->scene->limits.table_bytes = held_bytes < limit_bytes ? limit_bytes - held_bytes : 1;
}

/* Answers a transaction and notifies the scene's other holders. `by` NULL: its client is gone and gets no answer.
 */
static void committed(struct engine *engine, struct engine_scene *scene, const struct engine_reference *by,
                      const struct aside_commit *commit)
{
    uint64_t before_bytes = scene->known.table_bytes;
    engine_scene_note(engine, scene);
    if (!commit->applied) {
        if (by)
            fail(engine, commit->command, &commit->error);
        return;
    }
    if (scene->known.table_bytes > before_bytes)
        engine_trim_tables(engine);
    if (!scene->apply_ns)
        scene->apply_start_ns = commit->start_ns;
    scene->apply_ns += commit->duration_ns;
    if (by)
        done(engine, commit->command, scene->known.revision);
    engine_scene_changed(engine, scene, by);
}

static void commit_here(struct engine *engine, const struct engine_reference *reference,
                        struct engine_command *command)
{
    struct engine_scene *scene = reference->scene;
    struct aside_commit commit = {.command = command};
    commit.start_ns = clock_now_ns();
    commit.applied = scene_commit(scene->scene, command->edits, command->edit_count, &commit.error);
    commit.duration_ns = clock_now_ns() - commit.start_ns;
    committed(engine, scene, reference, &commit);
}

/* False: the caller keeps the command. */
static bool commit(struct engine *engine, const struct engine_reference *reference, struct engine_command *command)
{
    struct engine_scene *scene = reference->scene;
    struct error conflict = {0};
    if (command->base_revision && !scene_edits_are_current(scene->scene, command->edits, command->edit_count,
                                                           command->base_revision, &conflict)) {
        fail(engine, command, &conflict);
        return false;
    }
    limit_tables(engine, scene);
    bool here = scene_commit_is_short(scene->scene, command->edits, command->edit_count);
    struct aside_commit *commit = here ? NULL : calloc(1, sizeof(*commit));
    if (!commit) {
        commit_here(engine, reference, command);
        return false;
    }
    commit->scene = scene->scene;
    commit->command = command;
    commit->promised_bytes = scene_edits_table_bytes(command->edits, command->edit_count);
    engine->promised_bytes += commit->promised_bytes;
    scene->commit = commit;
    aside_submit(engine->aside, commit);
    return true;
}

/* ---- jobs that begin ---------------------------------------------------------------------------- */

static void start(struct engine *engine, struct engine_reference *reference, struct engine_command *command,
                  const struct animation_bounds *bounds)
{
    struct error error = {0};
    if (!job_start(engine, reference, command, bounds, &error))
        fail(engine, command, &error);
}

/* Whether the job's first frame needs the bounds of a scene so large that other jobs would have to wait for them.
 */
static bool searches_long(struct engine_scene *scene, const struct engine_job *job)
{
    const bool is_framed =
        job->camera.camera_path == CAMERA_AUTO || (job->camera.camera_path == CAMERA_ORBIT && job->key_count == 0);
    if (!is_framed && !(job->camera.aperture > 0.0f) && !job->frame.picture.ground)
        return false;
    engine_count_contents(scene);
    return (uint64_t)scene->instances * (scene->triangles + scene->spheres) > SEARCHED_HERE_MAX;
}

/* False: the caller keeps the command. */
static bool start_aside(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    struct aside_commit *search = searches_long(scene, &command->job) ? calloc(1, sizeof(*search)) : NULL;
    if (!search)
        return false;
    search->scene = scene->scene;
    search->command = command;
    scene->commit = search;
    aside_submit(engine->aside, search);
    return true;
}

/* ---- what is finished aside --------------------------------------------------------------------- */

static void finish_commit(struct engine *engine, struct engine_scene *scene, struct engine_reference *by,
                          const struct aside_commit *commit)
{
    if (commit->command->kind == ENGINE_JOB_START) {
        if (by && !atomic_load(&commit->abandoned))
            start(engine, by, commit->command, &commit->bounds);
    } else if (scene->references) {
        committed(engine, scene, by, commit);
    } else {
        engine_scene_note(engine, scene); /* no holder is left to notify, so the scene may end now */
    }
}

void engine_finish_commits(struct engine *engine)
{
    struct aside_commit *commit;
    while ((commit = aside_take_done(engine->aside))) {
        struct engine_scene *scene = engine->scenes;
        while (scene->commit != commit)
            scene = scene->next;
        scene->commit = NULL;
        engine->promised_bytes -= commit->promised_bytes;
        const struct engine_command *command = commit->command;
        struct engine_reference *by = engine_find_reference(engine, command->client, command->scene);
        finish_commit(engine, scene, by && by->scene == scene ? by : NULL, commit);
        aside_commit_destroy(commit);
        engine_run_waiting(engine, scene);
        engine_reap_scenes(engine);
    }
}

/* False: the caller keeps the command. */
static bool keep_waiting(struct engine_scene *scene, struct engine_command *command)
{
    struct engine_command **waiting = realloc(scene->waiting, (scene->waiting_count + 1) * sizeof(*waiting));
    if (!waiting)
        return false;
    scene->waiting = waiting;
    waiting[scene->waiting_count++] = command;
    return true;
}

static void wait_for_scene(struct engine *engine, struct engine_scene *scene, struct engine_command *command)
{
    if (scene->waiting_count < WAITING_MAX && keep_waiting(scene, command))
        return;
    struct error error = {0};
    error_set(&error, ERROR_BUSY, "", "%zu requests wait for this scene already", scene->waiting_count);
    fail(engine, command, &error);
    engine_command_destroy(command);
}

static bool is_by(const struct engine_command *command, const struct engine_reference *reference)
{
    return command->client == reference->client->client && command->scene == reference->id;
}

static bool waits_by(const struct engine_scene *scene, const struct engine_reference *reference)
{
    for (size_t i = 0; i < scene->waiting_count; i++) {
        if (is_by(scene->waiting[i], reference))
            return true;
    }
    return false;
}

static struct engine_command *take_waiting(struct engine_scene *scene, size_t i)
{
    struct engine_command *command = scene->waiting[i];
    memmove(&scene->waiting[i], &scene->waiting[i + 1], (--scene->waiting_count - i) * sizeof(*scene->waiting));
    return command;
}

struct engine_command *engine_take_waiting(struct engine_scene *scene, const struct engine_reference *reference)
{
    for (size_t i = 0; i < scene->waiting_count; i++) {
        if (is_by(scene->waiting[i], reference))
            return take_waiting(scene, i);
    }
    return NULL;
}

/* False: the command must wait for an earlier one of this client, which waits for another client's frame or is in
 * progress. */
static bool scene_close(struct engine *engine, struct engine_reference *reference, struct engine_command *command)
{
    struct engine_scene *scene = reference->scene;
    engine_abort_jobs(engine, reference, "its scene was closed");
    /* Earlier commands are answered first. */
    engine_run_waiting(engine, scene);
    bool changes = scene->commit && is_by(scene->commit->command, reference);
    if ((changes || waits_by(scene, reference)) && keep_waiting(scene, command))
        return false;
    engine_scene_close(engine, reference, command);
    return true;
}

static const char *scene_field(enum engine_command_kind kind)
{
    return kind == ENGINE_JOB_START        ? "render.scene"
           : kind == ENGINE_SCENE_CLOSE    ? "scene_close.scene"
           : kind == ENGINE_SCENE_DESCRIBE ? "scene_describe.scene"
           : kind == ENGINE_OBJECTS_LIST   ? "scene_objects.scene"
           : kind == ENGINE_OBJECT_READ    ? "object_get.scene"
                                           : "edit_begin.scene";
}

/* Carries out a command that names a scene. */
static void handle_of_scene(struct engine *engine, struct engine_command *command)
{
    struct engine_reference *reference = engine_find_reference(engine, command->client, command->scene);
    if (!reference) {
        struct error error = {0};
        error_set(&error, ERROR_UNKNOWN_ID, scene_field(command->kind), "scene %u does not exist", command->scene);
        fail(engine, command, &error);
        engine_command_destroy(command);
        return;
    }
    struct engine_scene *scene = reference->scene;
    if (command->kind == ENGINE_SCENE_CLOSE) {
        if (!scene_close(engine, reference, command))
            return;
    } else if ((command->kind == ENGINE_COMMIT && !engine_scene_may_change(engine, scene)) || scene->commit ||
               scene->waiting_count) {
        wait_for_scene(engine, scene, command);
        return;
    } else if (command->kind == ENGINE_COMMIT) {
        if (commit(engine, reference, command))
            return;
    } else if (command->kind == ENGINE_SCENE_DESCRIBE) {
        engine_scene_describe(engine, scene, command);
    } else if (command->kind == ENGINE_OBJECTS_LIST) {
        engine_objects_list(engine, scene, command);
    } else if (command->kind == ENGINE_OBJECT_READ) {
        engine_object_read(engine, scene, command);
    } else if (start_aside(engine, scene, command)) {
        return;
    } else {
        start(engine, reference, command, NULL);
    }
    engine_command_destroy(command);
}

void engine_run_waiting(struct engine *engine, struct engine_scene *scene)
{
    if (!scene->waiting_count || !engine_scene_may_change(engine, scene))
        return;
    /* No command here begins a frame, so all can run up to a long transaction, for which the rest waits again. */
    struct engine_command **waiting = scene->waiting;
    size_t count = scene->waiting_count;
    scene->waiting = NULL;
    scene->waiting_count = 0;
    for (size_t i = 0; i < count; i++)
        handle_of_scene(engine, waiting[i]);
    free(waiting);
}

/* ---- jobs --------------------------------------------------------------------------------------- */

/* Finds the command of that request among those that wait for frames; false: none does. */
static bool find_waiting(struct engine *engine, const struct engine_command *by, struct engine_scene **found,
                         size_t *place)
{
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        for (size_t i = 0; i < scene->waiting_count; i++) {
            const struct engine_command *command = scene->waiting[i];
            if (command->client != by->client || command->request != by->target_request)
                continue;
            *found = scene;
            *place = i;
            return true;
        }
    }
    return false;
}

/* The job of that request that is not started yet, because a thread searches its scene; NULL: there is none. */
static struct aside_commit *find_starting(struct engine *engine, const struct engine_command *by)
{
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next) {
        const struct engine_command *command = scene->commit ? scene->commit->command : NULL;
        if (command && command->kind == ENGINE_JOB_START && command->client == by->client &&
            command->request == by->target_request && !atomic_load(&scene->commit->abandoned))
            return scene->commit;
    }
    return NULL;
}

static void job_cancel(struct engine *engine, struct engine_command *command)
{
    struct aside_commit *starting = find_starting(engine, command);
    uint32_t target = command->target_request;
    struct engine_scene *waits_for;
    size_t place;
    struct job *job = job_find(engine, command->client, target);
    if (job) {
        struct engine_scene *scene = job->scene;
        job_abort(engine, job, engine_cancelled(command->client, target, "the client cancelled it"));
        engine_run_waiting(engine, scene);
    } else if (starting) {
        atomic_store(&starting->abandoned, true);
        engine_post(engine, engine_cancelled(command->client, target, "the client cancelled it"));
    } else if (find_waiting(engine, command, &waits_for, &place)) {
        engine_command_destroy(take_waiting(waits_for, place));
        engine_post(engine, engine_cancelled(command->client, target, "the client cancelled it"));
    }
    done(engine, command, 0);
}

static void give_credit(struct engine *engine, const struct engine_command *command)
{
    struct job *job = job_find(engine, command->client, command->target_request);
    if (job) {
        job_credit(job, command->credit);
        return;
    }
    struct engine_scene *waits_for;
    size_t place;
    struct aside_commit *starting = find_starting(engine, command);
    if (!starting && !find_waiting(engine, command, &waits_for, &place))
        return;
    struct engine_command *waiting = starting ? starting->command : waits_for->waiting[place];
    if (command->credit > waiting->job.credit)
        waiting->job.credit = command->credit;
}

static void client_gone(struct engine *engine, const struct engine_command *command)
{
    struct engine_client *client = hashmap_get(&engine->clients, command->client);
    if (client)
        engine_forget_client(engine, client);
    engine_reap_scenes(engine);
    engine_post(engine, event_create(ENGINE_CLIENT_FORGOTTEN, command->client, command->request));
}

static void report_stats(struct engine *engine, const struct engine_command *command)
{
    struct engine_event *event = event_create(ENGINE_STATS_READY, command->client, command->request);
    if (event)
        event->stats = engine_stats_collect(engine, command->principal);
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
    case ENGINE_SCENE_DESCRIBE:
    case ENGINE_OBJECTS_LIST:
    case ENGINE_OBJECT_READ:
    case ENGINE_COMMIT:
    case ENGINE_JOB_START:
        handle_of_scene(engine, command);
        engine_reap_scenes(engine);
        return;
    case ENGINE_SCENE_OPEN:
        engine_scene_open(engine, command);
        break;
    case ENGINE_SCENE_ATTACH:
        engine_scene_attach(engine, command);
        break;
    case ENGINE_SCENE_LIST:
        engine_scene_list(engine, command);
        break;
    case ENGINE_SCENES_TRIM:
        engine_trim_blobs(engine, command->trim_bytes);
        break;
    case ENGINE_JOB_CREDIT:
        give_credit(engine, command);
        break;
    case ENGINE_JOB_CANCEL:
        job_cancel(engine, command);
        break;
    case ENGINE_VIEW_CHANGED:
        break; /* the command only wakes the thread, which then reads the latest requests of each view */
    case ENGINE_STATS:
        report_stats(engine, command);
        break;
    case ENGINE_LIMITS:
        engine_set_limits(engine, &command->limits);
        break;
    case ENGINE_CLIENT_GONE:
        client_gone(engine, command);
        break;
    }
    engine_command_destroy(command);
}
