/* SPDX-License-Identifier: MIT */
/* An engine for the tests of sessions, which answers what it is told to, and what such a test does more than once.
 */
#ifndef FARLIGHT_TESTS_ANSWERING_ENGINE_H
#define FARLIGHT_TESTS_ANSWERING_ENGINE_H

#include "tests/fixtures/engine_port.h"
#include "tests/unit/session/session_fixture.h"

#include "base/clock.h"

#define FRAME_BYTES ((size_t)700001) /* three pieces, the last of odd size */

/* ---- an engine --------------------------------------------------------------------------------------- */

static struct {
    atomic_bool full;      /* takes no commands */
    atomic_bool keep_jobs; /* jobs render nothing until they are cancelled */
    atomic_bool keep_commits;
    struct engine_command *_Atomic kept_commit; /* has no answer until release_commit() */
    uint32_t job_request, next_frame, last_frame;
    struct engine_job job; /* the last one, but for what it owns */
    struct record_clip_use job_clips[16];
    struct structure_rows structure; /* reported with each frame */
    uint64_t credit_seen, commits;
    atomic_uint edits, gone;
} engine;

static inline void event(enum engine_event_kind kind, const struct engine_command *command, uint32_t request)
{
    struct engine_event *made = port_event(kind, command->client, request);
    made->revision = engine.commits;
    if (kind == ENGINE_FAILED)
        error_set(&made->error, ERROR_CANCELLED, NULL, "cancelled");
    if (kind == ENGINE_STATS_READY) {
        made->stats = port_allocate(sizeof(*made->stats));
        strcpy(made->stats->device.name, "none");
    }
    port_say(made);
}

static inline void render(const struct engine_command *command)
{
    for (; engine.next_frame <= engine.last_frame && engine.next_frame < engine.credit_seen; engine.next_frame++) {
        struct engine_event *made =
            port_frame(command->client, engine.job_request, engine.next_frame, FRAME_BYTES);
        struct engine_frame *frame = made->frame;
        frame->request.tracing.tracer = engine.job.frame.tracing.tracer;
        frame->request.aperture = engine.job.camera.aperture;
        frame->request.focus = engine.job.camera.focus;
        frame->shutter_s = engine.job.camera.shutter / 8;
        frame->result.layers = engine.job.frame.picture.layers ? engine.job.frame.picture.layers : 1;
        frame->result.samples = 5; /* with those of frames before */
        frame->result.structure = engine.structure;
        for (size_t i = 0; i < FRAME_BYTES; i++)
            frame->bytes[i] = (uint8_t)(i * 31 + engine.next_frame);
        frame->encoded_ns = clock_now_ns();
        port_say(made);
    }
    if (engine.next_frame > engine.last_frame)
        event(ENGINE_DONE, command, engine.job_request);
}

static inline bool submit(void *context, struct engine_command *command, struct error *error)
{
    (void)context;
    if (atomic_load(&engine.full))
        return error_set(error, ERROR_BUSY, NULL, "full");
    switch (command->kind) {
    case ENGINE_COMMIT:
        if (atomic_load(&engine.keep_commits)) {
            atomic_store(&engine.kept_commit, command);
            return true;
        }
        engine.commits++;
        atomic_fetch_add(&engine.edits, (unsigned)command->edit_count);
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_SCENE_OPEN:
    case ENGINE_SCENE_ATTACH:
    case ENGINE_SCENE_CLOSE:
    case ENGINE_SCENE_LIST:
    case ENGINE_SCENE_DESCRIBE:
    case ENGINE_OBJECTS_LIST:
    case ENGINE_OBJECT_READ:
    case ENGINE_SCENES_TRIM:
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_JOB_START:
        engine.job_request = command->request;
        engine.next_frame = command->job.first_frame;
        engine.last_frame = command->job.last_frame;
        engine.credit_seen = command->job.credit;
        engine.job = command->job;
        for (uint32_t i = 0; i < command->job.clip_count; i++)
            engine.job_clips[i] = command->job.clips[i];
        if (!atomic_load(&engine.keep_jobs))
            render(command);
        break;
    case ENGINE_JOB_CREDIT:
        engine.credit_seen = command->credit;
        if (!atomic_load(&engine.keep_jobs))
            render(command);
        break;
    case ENGINE_JOB_CANCEL:
        event(ENGINE_FAILED, command, command->target_request);
        event(ENGINE_DONE, command, command->request);
        break;
    case ENGINE_VIEW_CHANGED:
    case ENGINE_LIMITS:
        break;
    case ENGINE_STATS:
        event(ENGINE_STATS_READY, command, command->request);
        break;
    case ENGINE_CLIENT_GONE:
        atomic_fetch_add(&engine.gone, 1);
        event(ENGINE_CLIENT_FORGOTTEN, command, 0);
        break;
    }
    engine_command_destroy(command);
    return true;
}

static inline void release_commit(void)
{
    struct engine_command *command;
    while (!(command = atomic_exchange(&engine.kept_commit, NULL)))
        usleep(1000);
    event(ENGINE_DONE, command, command->request);
    engine_command_destroy(command);
}

static inline struct engine_port engine_begin(void)
{
    memset(&engine, 0, sizeof(engine));
    return port_begin(submit);
}

static inline void engine_end(void)
{
    port_end();
}

/* ---- steps ------------------------------------------------------------------------------------------- */

static inline struct message render_message(uint32_t last_frame, uint32_t credit)
{
    struct message message = made(MESSAGE_RENDER);
    message.render.scene = 1;
    message.render.channel = 2;
    message.render.picture.width = message.render.picture.height = 1;
    message.render.credit = credit;
    message.render.last_frame = last_frame;
    return message;
}

#endif
