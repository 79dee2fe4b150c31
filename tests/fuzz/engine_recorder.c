/* SPDX-License-Identifier: MIT */
#include "tests/fuzz/engine_recorder.h"

#include "base/clock.h"
#include "engine/view_mailbox.h"
#include "tests/fixtures/engine_port.h"
#include "tests/fuzz/fuzz.h"

#include <stdlib.h>
#include <string.h>

#define SCENES_MAX 64
#define REFERENCES_MAX 64
#define JOBS_MAX 64
/* Maximum of frames of one job; then it stands still, as if the GPU were busy with others: a request may name
 * a million. */
#define FRAMES_MAX 100

struct recorded_scene {
    struct scene *scene; /* NULL: this place is free */
    enum sharing sharing;
    uint64_t principal;
};

struct recorded_reference {
    uint64_t client; /* 0: this place is free */
    uint32_t id;
    struct recorded_scene *scene;
};

struct recorded_job {
    uint64_t client; /* 0: this place is free */
    uint32_t request;
    struct recorded_reference *reference;
    enum job_kind kind;
    uint32_t width, height, samples, pass_samples;
    enum encoding encoding, still_encoding;
    uint64_t next, last, step, credit, made;
    struct view_mailbox *mailbox;
    uint32_t shown_samples;
    uint64_t shown_command, shown_revision;
};

bool recorder_at_work;

static struct {
    unsigned mood;
    struct recorded_scene scenes[SCENES_MAX];
    struct recorded_reference references[REFERENCES_MAX];
    struct recorded_job jobs[JOBS_MAX];
} recorder;

/* ---- saying ----------------------------------------------------------------------------------------- */

static struct engine_event *say(enum engine_event_kind kind, uint64_t client, uint32_t request)
{
    struct engine_event *event = port_event(kind, client, request);
    port_say(event);
    return event; /* this thread fills it in when it takes it out later */
}

static void say_failed(uint64_t client, uint32_t request, enum error_code kind, const char *field)
{
    error_set(&say(ENGINE_FAILED, client, request)->error, kind, field, "so says the recorder");
}

static void say_cancelled(uint64_t client, uint32_t request)
{
    say_failed(client, request, ERROR_CANCELLED, NULL);
}

/* ---- what there is ---------------------------------------------------------------------------------- */

static struct recorded_reference *find_reference(uint64_t client, uint32_t id)
{
    for (size_t i = 0; i < REFERENCES_MAX; i++) {
        struct recorded_reference *reference = &recorder.references[i];
        if (reference->client == client && reference->id == id)
            return reference;
    }
    return NULL;
}

static struct recorded_job *find_job(uint64_t client, uint32_t request)
{
    for (size_t i = 0; i < JOBS_MAX; i++) {
        if (recorder.jobs[i].client == client && recorder.jobs[i].request == request)
            return &recorder.jobs[i];
    }
    return NULL;
}

static void add_reference(const struct engine_command *command, struct recorded_scene *scene)
{
    struct recorded_reference *reference = find_reference(0, 0);
    FUZZ_REQUIRE(reference && !find_reference(command->client, command->scene));
    *reference = (struct recorded_reference){command->client, command->scene, scene};
    say(ENGINE_DONE, command->client, command->request)->revision = scene->scene->revision;
}

static void end_job(struct recorded_job *job)
{
    view_mailbox_unref(job->mailbox);
    *job = (struct recorded_job){0};
}

static bool is_held(const struct recorded_scene *scene)
{
    for (size_t i = 0; i < REFERENCES_MAX; i++) {
        if (recorder.references[i].client && recorder.references[i].scene == scene)
            return true;
    }
    return false;
}

static void end_scene(struct recorded_scene *scene)
{
    scene_destroy(scene->scene);
    *scene = (struct recorded_scene){0};
    say(ENGINE_SCENE_ENDED, 0, 0);
}

static void end_reference(struct recorded_reference *reference, bool tell)
{
    struct recorded_scene *scene = reference->scene;
    for (size_t i = 0; i < JOBS_MAX; i++) {
        struct recorded_job *job = &recorder.jobs[i];
        if (!job->client || job->reference != reference)
            continue;
        if (tell)
            say_cancelled(job->client, job->request);
        end_job(job);
    }
    *reference = (struct recorded_reference){0};
    if (!is_held(scene))
        end_scene(scene);
}

/* ---- scenes ----------------------------------------------------------------------------------------- */

static struct recorded_scene *find_named(const char *name, uint64_t principal)
{
    for (size_t i = 0; i < SCENES_MAX; i++) {
        struct recorded_scene *scene = &recorder.scenes[i];
        if (scene->scene && scene->sharing != SHARING_PRIVATE && strcmp(scene->scene->name, name) == 0 &&
            (scene->sharing == SHARING_SHARED || scene->principal == principal))
            return scene;
    }
    return NULL;
}

static void open_scene(const struct engine_command *command)
{
    struct recorded_scene *scene = NULL;
    if (command->sharing != SHARING_PRIVATE &&
        (!command->name[0] || find_named(command->name, command->principal))) {
        say_failed(command->client, command->request, ERROR_INVALID, "scene_open.name");
        return;
    }
    for (size_t i = 0; i < SCENES_MAX && !scene; i++)
        scene = recorder.scenes[i].scene ? NULL : &recorder.scenes[i];
    if (!scene) {
        say_failed(command->client, command->request, ERROR_LIMIT, "scene_open");
        return;
    }
    *scene = (struct recorded_scene){scene_create(command->name, NULL), command->sharing, command->principal};
    FUZZ_REQUIRE(scene->scene);
    add_reference(command, scene);
}

static void attach(const struct engine_command *command)
{
    struct recorded_scene *scene = find_named(command->name, command->principal);
    if (scene)
        add_reference(command, scene);
    else
        say_failed(command->client, command->request, ERROR_UNKNOWN_ID, "scene_attach.name");
}

static void list(const struct engine_command *command)
{
    struct engine_scene_list *made = calloc(1, sizeof(*made) + SCENES_MAX * sizeof(made->scenes[0]));
    FUZZ_REQUIRE(made);
    for (size_t i = 0; i < SCENES_MAX; i++) {
        const struct recorded_scene *scene = &recorder.scenes[i];
        if (!scene->scene || find_named(scene->scene->name, command->principal) != scene)
            continue;
        struct engine_scene_entry *entry = &made->scenes[made->count++];
        *entry = (struct engine_scene_entry){.revision = scene->scene->revision, .sharing = scene->sharing};
        snprintf(entry->name, sizeof(entry->name), "%s", scene->scene->name);
    }
    say(ENGINE_SCENES_LISTED, command->client, command->request)->list = made;
}

static void describe(const struct engine_command *command, const struct scene *scene)
{
    struct engine_scene_description *made = calloc(1, sizeof(*made));
    FUZZ_REQUIRE(made);
    made->revision = scene->revision;
    made->nodes = (uint32_t)scene->objects[OBJECT_NODE].count;
    made->upper_world[0] = 1;
    made->camera_count = made->clip_count = 3;
    for (uint32_t i = 0; i < 3; i++) {
        made->cameras[i] = (struct engine_camera_entry){.node = i + 1, .fov_y = 1, .name = "a camera"};
        made->clips[i] = (struct engine_clip_entry){.clip = i + 1, .channels = 1, .name = "a clip"};
    }
    say(ENGINE_SCENE_DESCRIBED, command->client, command->request)->description = made;
}

static void list_objects(const struct engine_command *command, const struct scene *scene)
{
    struct engine_object_list *made = calloc(1, sizeof(*made));
    FUZZ_REQUIRE(made);
    made->revision = scene->revision;
    made->count = made->total = 2;
    made->next = command->list_from < 2 ? command->list_from + 1 : 0;
    for (uint32_t i = 0; i < 2; i++)
        made->objects[i] = (struct engine_object_entry){.object = i + 1, .name = "an object"};
    say(ENGINE_OBJECTS_LISTED, command->client, command->request)->objects = made;
}

static void read_object(const struct engine_command *command, const struct scene *scene)
{
    struct engine_event *event = say(ENGINE_OBJECT_IS, command->client, command->request);
    event->revision = scene->revision;
    event->object = calloc(1, sizeof(*event->object));
    FUZZ_REQUIRE(event->object);
    if (!scene_read_object(scene, command->object_kind, command->object, event->object, &event->error))
        event->kind = ENGINE_FAILED;
}

/* ---- frames ----------------------------------------------------------------------------------------- */

static void say_frame(struct recorded_job *job, uint32_t samples, const struct view_camera *camera)
{
    const bool large = recorder.mood & RECORDER_LARGE;
    struct engine_event *event = port_frame(job->client, job->request, (uint32_t)job->next,
                                            large ? RECORDER_LARGE_FRAME_BYTES : RECORDER_FRAME_BYTES);
    struct engine_frame *frame = event->frame;
    frame->request.picture.width = job->width;
    frame->request.picture.height = job->height;
    frame->result.samples = samples;
    frame->result.revision = job->reference->scene->scene->revision;
    frame->encoding = camera && !camera->moving ? job->still_encoding : job->encoding;
    frame->key_frame = true;
    if (camera) {
        frame->command = camera->command;
        frame->received_ns = camera->received_ns;
        frame->moving = camera->moving;
    }
    frame->applied_ns = clock_now_ns();
    frame->rendered_ns = clock_now_ns();
    frame->encoded_ns = clock_now_ns();
    port_say(event);
    job->next += job->step;
    job->made++;
}

static bool has_credit(const struct recorded_job *job)
{
    return job->made < job->credit && job->made < FRAMES_MAX;
}

static void go_on_with_view(struct recorded_job *job)
{
    uint64_t revision = job->reference->scene->scene->revision;
    struct view_request request = view_mailbox_latest(job->mailbox);
    if (request.camera.command != job->shown_command || revision != job->shown_revision)
        job->shown_samples = 0;
    while (has_credit(job) && job->shown_samples < job->samples) {
        request = view_mailbox_begin_frame(job->mailbox);
        job->shown_samples += job->pass_samples;
        if (job->shown_samples > job->samples || request.camera.moving)
            job->shown_samples = job->samples;
        job->shown_command = request.camera.command;
        job->shown_revision = revision;
        say_frame(job, job->shown_samples, &request.camera);
    }
}

static void go_on(struct recorded_job *job)
{
    if (job->kind == JOB_VIEW) {
        go_on_with_view(job);
        return;
    }
    while (has_credit(job) && job->next <= job->last)
        say_frame(job, job->samples, NULL);
    if (job->next <= job->last)
        return;
    say(ENGINE_DONE, job->client, job->request);
    end_job(job);
}

static void start_job(struct engine_command *command, struct recorded_reference *reference)
{
    const struct engine_job *asked = &command->job;
    struct recorded_job *job = find_job(0, 0);
    FUZZ_REQUIRE(job && asked->frame_step > 0 && asked->view.pass_samples > 0);
    FUZZ_REQUIRE((asked->kind == JOB_VIEW) == (asked->mailbox != NULL));
    uint64_t first = asked->first_frame;
    for (size_t i = 0; asked->mailbox && i < JOBS_MAX; i++) {
        struct recorded_job *before = &recorder.jobs[i];
        if (!before->client || before->mailbox != asked->mailbox)
            continue;
        first = before->next;
        say(ENGINE_DONE, before->client, before->request);
        end_job(before);
    }
    *job = (struct recorded_job){
        .client = command->client,
        .request = command->request,
        .reference = reference,
        .kind = asked->kind,
        .width = asked->frame.picture.width,
        .height = asked->frame.picture.height,
        .samples = asked->frame.sampling.samples,
        .pass_samples = asked->view.pass_samples,
        .encoding = asked->encoding,
        .still_encoding = asked->view.still_encoding,
        .next = first,
        .last = asked->last_frame,
        .step = asked->frame_step,
        .credit = asked->credit,
        .mailbox = asked->mailbox ? view_mailbox_ref(asked->mailbox) : NULL,
    };
    go_on(job);
}

static void start_job_or_refuse(struct engine_command *command, struct recorded_reference *reference)
{
    if (command->job.kind == JOB_BATCH && command->job.last_frame < command->job.first_frame)
        say_failed(command->client, command->request, ERROR_INVALID, "render.last_frame");
    else
        start_job(command, reference);
}

/* ---- commands --------------------------------------------------------------------------------------- */

static void commit(struct engine_command *command, const struct recorded_reference *by)
{
    struct error error = {0};
    struct scene *scene = by->scene->scene;
    if (!scene_commit(scene, command->edits, command->edit_count, &error)) {
        say(ENGINE_FAILED, command->client, command->request)->error = error;
        return;
    }
    say(ENGINE_DONE, command->client, command->request)->revision = scene->revision;
    for (size_t i = 0; i < REFERENCES_MAX; i++) {
        const struct recorded_reference *other = &recorder.references[i];
        if (!other->client || other->scene != by->scene || other == by)
            continue;
        struct engine_event *event = say(ENGINE_SCENE_CHANGED, other->client, 0);
        event->scene = other->id;
        event->revision = scene->revision;
    }
    for (size_t i = 0; i < JOBS_MAX; i++) {
        struct recorded_job *job = &recorder.jobs[i];
        if (job->client && job->reference->scene == by->scene)
            go_on(job);
    }
}

static void cancel(const struct engine_command *command)
{
    struct recorded_job *job = find_job(command->client, command->target_request);
    if (job) {
        say_cancelled(job->client, job->request);
        end_job(job);
    }
    say(ENGINE_DONE, command->client, command->request);
}

static void forget(uint64_t client)
{
    for (size_t i = 0; i < REFERENCES_MAX; i++) {
        if (recorder.references[i].client == client)
            end_reference(&recorder.references[i], false);
    }
    say(ENGINE_CLIENT_FORGOTTEN, client, 0);
}

static void say_stats(const struct engine_command *command)
{
    struct engine_stats *stats = calloc(1, sizeof(*stats));
    FUZZ_REQUIRE(stats);
    strcpy(stats->device.name, "recorder");
    struct engine_event *event = say(ENGINE_STATS_READY, command->client, command->request);
    event->stats = stats;
}

static void carry_out_on(struct engine_command *command, struct recorded_reference *reference)
{
    struct recorded_job *job;
    switch (command->kind) {
    case ENGINE_SCENE_CLOSE:
        end_reference(reference, true);
        say(ENGINE_DONE, command->client, command->request);
        return;
    case ENGINE_SCENE_DESCRIBE:
        describe(command, reference->scene->scene);
        return;
    case ENGINE_OBJECTS_LIST:
        list_objects(command, reference->scene->scene);
        return;
    case ENGINE_OBJECT_READ:
        read_object(command, reference->scene->scene);
        return;
    case ENGINE_COMMIT:
        commit(command, reference);
        return;
    case ENGINE_JOB_START:
        start_job_or_refuse(command, reference);
        return;
    case ENGINE_JOB_CREDIT:
        job = find_job(command->client, command->target_request);
        FUZZ_REQUIRE(!job || command->credit >= job->credit);
        if (job) {
            job->credit = command->credit;
            go_on(job);
        }
        return;
    case ENGINE_VIEW_CHANGED:
        job = find_job(command->client, command->request);
        if (job)
            go_on(job);
        return;
    default:
        return;
    }
}

static bool has_answer(enum engine_command_kind kind)
{
    return kind != ENGINE_JOB_CREDIT && kind != ENGINE_VIEW_CHANGED && kind != ENGINE_CLIENT_GONE &&
           kind != ENGINE_SCENES_TRIM && kind != ENGINE_JOB_CANCEL;
}

static void carry_out(struct engine_command *command)
{
    struct recorded_reference *reference;
    if (recorder.mood & RECORDER_FAILS && has_answer(command->kind)) {
        say_failed(command->client, command->request, ERROR_OUT_OF_MEMORY, "engine");
        if (command->kind == ENGINE_SCENE_CLOSE && (reference = find_reference(command->client, command->scene)))
            end_reference(reference, true);
        return;
    }
    switch (command->kind) {
    case ENGINE_SCENE_OPEN:
        open_scene(command);
        return;
    case ENGINE_SCENE_ATTACH:
        attach(command);
        return;
    case ENGINE_SCENE_LIST:
        list(command);
        return;
    case ENGINE_SCENES_TRIM: /* scenes without a holder have ended already */
    case ENGINE_LIMITS:
        return;
    case ENGINE_JOB_CANCEL:
        cancel(command);
        return;
    case ENGINE_STATS:
        say_stats(command);
        return;
    case ENGINE_CLIENT_GONE:
        forget(command->client);
        return;
    default:
        break;
    }
    reference = find_reference(command->client, command->scene);
    if (reference)
        carry_out_on(command, reference);
    else if (has_answer(command->kind))
        say_failed(command->client, command->request, ERROR_UNKNOWN_ID, "scene");
}

/* ---- the port --------------------------------------------------------------------------------------- */

static bool submit(void *context, struct engine_command *command, struct error *error)
{
    (void)context;
    if (recorder.mood & RECORDER_FULL)
        return error_set(error, ERROR_BUSY, NULL, "the queue is full");
    recorder_at_work = true;
    carry_out(command);
    engine_command_destroy(command);
    recorder_at_work = false;
    return true;
}

static struct engine_event *next_event(void *context)
{
    return recorder.mood & RECORDER_HOLDS ? NULL : port_next_event(context);
}

struct engine_port recorder_begin(void)
{
    memset(&recorder, 0, sizeof(recorder));
    struct engine_port made = port_begin(submit);
    made.next_event = next_event;
    return made;
}

void recorder_set_mood(unsigned mood)
{
    recorder.mood = mood;
}

size_t recorder_jobs(void)
{
    size_t count = 0;
    for (size_t i = 0; i < JOBS_MAX; i++)
        count += recorder.jobs[i].client != 0;
    return count;
}

size_t recorder_references(void)
{
    size_t count = 0;
    for (size_t i = 0; i < REFERENCES_MAX; i++)
        count += recorder.references[i].client != 0;
    return count;
}

void recorder_end(void)
{
    FUZZ_REQUIRE(recorder_references() == 0); /* and no scene without one */
    port_end();
}
