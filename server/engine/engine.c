/* SPDX-License-Identifier: MIT */
/* The thread that owns GL: commands in, slices of jobs, events out. */
#include "engine/engine.h"

#include "engine/engine_private.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/progress.h"

#include <signal.h>
#include <stdlib.h>

#define QUEUE_CAPACITY_DEFAULT 1024
/* Time for commands between two slices, so that a flood of commands does not stop the frames. */
#define COMMANDS_NS UINT64_C(1500000)
/* Maximum of commands that wait here; more of them wait with the network thread, which then reads no further. */
#define COMMANDS_WAITING_MAX 64

/* Wakes the thread without being a command. */
static struct engine_command nudge;

/* ---- events ------------------------------------------------------------------------------------- */

void engine_post(struct engine *engine, struct engine_event *event)
{
    if (!event)
        log_write(LOG_ERROR, "engine", "no memory for an event; a request stays without an answer");
    else if (!queue_push(engine->events, event))
        engine_event_destroy(event);
}

void engine_post_done(struct engine *engine, uint64_t client, uint32_t request, uint64_t revision)
{
    struct engine_event *event = event_create(ENGINE_DONE, client, request);
    if (event)
        event->revision = revision;
    engine_post(engine, event);
}

void engine_post_failed(struct engine *engine, uint64_t client, uint32_t request, const struct error *error)
{
    struct engine_event *event = event_create(ENGINE_FAILED, client, request);
    if (event)
        event->error = *error;
    engine_post(engine, event);
}

void engine_post_device_gone(struct engine *engine)
{
    engine_post(engine, event_create(ENGINE_DEVICE_GONE, 0, 0));
}

struct engine_event *engine_cancelled(uint64_t client, uint32_t request, const char *why)
{
    struct engine_event *event = event_create(ENGINE_FAILED, client, request);
    if (event)
        error_set(&event->error, ERROR_CANCELLED, "", "%s", why);
    return event;
}

/* Wakes the thread that owns GL, because there may be something to do. Any thread. */
static void engine_nudge(struct engine *engine)
{
    /* A single nudge in the queue is enough, and a full queue keeps the thread awake by itself. */
    if (!atomic_exchange(&engine->nudged, true))
        queue_try_push(engine->commands, &nudge);
}

/* ---- the thread --------------------------------------------------------------------------------- */

/* Runs the commands that waited for a frame that has ended; with the device, all frames end. */
static void run_all_waiting(struct engine *engine)
{
    for (struct engine_scene *scene = engine->scenes; scene;) {
        bool waits = scene->waiting_count && engine_scene_may_change(engine, scene);
        if (waits)
            engine_run_waiting(engine, scene);
        scene = waits ? engine->scenes : scene->next; /* scenes may have ended */
    }
}

static bool waits_for_device(const struct engine *engine, const struct job *job)
{
    return job->rendering && engine->backend->step_waits(job->renderer);
}

static struct schedule_entry entry_of(struct job *job)
{
    return (struct schedule_entry){.client = &job->reference->client->schedule, .job = &job->schedule};
}

/* The job whose turn it is; NULL: none is ready. A job that would only wait for the device yields to others, which
 * give the device more work in that time. */
static struct job *next_job(struct engine *engine)
{
    struct job *before = engine->turn_of, *waiting = NULL;
    if (before && before->rendering && before->spec.kind == JOB_VIEW && job_is_ready(engine, before) &&
        schedule_turn_lasts(&engine->scheduler) && !waits_for_device(engine, before))
        return before;
    for (size_t i = 0; i < engine->job_count; i++) {
        struct job *job = engine->jobs[i];
        bool ready = job_is_ready(engine, job), waits = ready && waits_for_device(engine, job);
        waiting = waits && !waiting ? job : waiting;
        engine->entries[i] = entry_of(job);
        engine->entries[i].ready = ready && !waits;
    }
    size_t picked = schedule_pick(&engine->scheduler, engine->entries, engine->job_count);
    engine->turn_of = picked == SCHEDULE_NONE ? waiting : engine->jobs[picked];
    return engine->turn_of;
}

/* Runs one slice of the job whose turn it is. False: no job is ready. */
static bool serve(struct engine *engine)
{
    struct job *job = next_job(engine);
    if (!job)
        return false;
    uint64_t start_ns = clock_now_ns();
    job_step(engine, job);
    const struct schedule_entry entry = entry_of(job);
    schedule_charge(&engine->scheduler, &entry, clock_now_ns() - start_ns,
                    job->spec.weight ? job->spec.weight : 1);
    run_all_waiting(engine);
    return true;
}

static void take_commands(struct engine *engine, struct engine_command *first)
{
    uint64_t end_ns = clock_now_ns() + COMMANDS_NS;
    for (struct engine_command *command = first; command;) {
        if (command == &nudge)
            /* This turn may miss changes from here on, so they need a nudge of their own. */
            atomic_store(&engine->nudged, false);
        else
            engine_handle(engine, command);
        command = clock_now_ns() < end_ns ? queue_try_pop(engine->commands) : NULL;
    }
}

static uint64_t shorter(uint64_t a_ns, uint64_t b_ns)
{
    return a_ns < b_ns ? a_ns : b_ns;
}

static void run(struct engine *engine)
{
    while (!atomic_load(&engine->stop)) {
        atomic_store(&engine->nudged, false); /* the queue may have been full, and the nudge not in it */
        take_commands(engine, queue_try_pop(engine->commands));
        engine_finish_commits(engine);
        jobs_reap(engine);
        uint64_t scenes_ns = shorter(engine_reap_scenes(engine), engine_keep_scenes(engine));
        atomic_fetch_add(&engine->turns, 1);
        if (serve(engine))
            continue;
        uint64_t idle_ns = shorter(jobs_idle_ns(engine), scenes_ns);
        atomic_store(&engine->waits, true);
        struct engine_command *first = queue_pop(engine->commands, idle_ns);
        atomic_store(&engine->waits, false);
        take_commands(engine, first);
    }
}

static void report_start(struct engine *engine, bool opened)
{
    pthread_mutex_lock(&engine->start_lock);
    engine->start = opened ? START_DONE : START_FAILED;
    pthread_cond_signal(&engine->start_changed);
    pthread_mutex_unlock(&engine->start_lock);
}

static void *run_thread(void *context)
{
    struct engine *engine = context;
    pthread_setname_np(pthread_self(), "gl");
    bool opened = engine_open_device(engine, &engine->start_error);
    if (opened)
        engine->device_info = engine->device->info;
    report_start(engine, opened);
    if (!opened)
        return NULL;
    run(engine);
    for (struct engine_scene *scene = engine->scenes; scene; scene = scene->next)
        scene->commit = NULL; /* aside_destroy() frees it, and nothing waits for it any more */
    aside_destroy(engine->aside);
    engine->aside = NULL;
    engine_stop_keeping(engine);
    size_t cursor = 0;
    void *client;
    while (hashmap_next(&engine->clients, &cursor, NULL, &client)) {
        engine_forget_client(engine, client);
        cursor = 0; /* the map has changed */
    }
    engine_end_left_scenes(engine);
    engine_drop_device(engine);
    return NULL;
}

void engine_set_limits(struct engine *engine, const struct engine_limits *limits)
{
    engine->options.limits = *limits;
    if (!engine->options.limits.lingering_scenes)
        engine->options.limits.lingering_scenes = ENGINE_LINGERING_SCENES;
}

/* ---- start and stop ----------------------------------------------------------------------------- */

/* Called when another thread has finished a task. */
static void on_done(void *context)
{
    engine_nudge(context);
}

static bool start_threads(struct engine *engine, struct error *error)
{
    struct encode_pool_options pool = {
        .threads = engine->options.encode_threads,
        .totals = &engine->totals,
        .on_done = on_done,
        .context = engine,
    };
    /* Signals are for the main thread. */
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    engine->pool = encode_pool_create(&pool, error);
    engine->aside = engine->pool ? aside_create(on_done, engine, error) : NULL;
    bool may_start = engine->aside != NULL;
    if (may_start && engine->options.keeper)
        may_start = (engine->keep = keep_create(engine->options.keeper, on_done, engine, error));
    if (may_start)
        engine->has_thread = !pthread_create(&engine->thread, NULL, run_thread, engine);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    if (!may_start)
        return false;
    if (!engine->has_thread)
        return error_set(error, ERROR_OUT_OF_MEMORY, "engine", "could not start a thread");
    pthread_mutex_lock(&engine->start_lock);
    while (engine->start == START_PENDING)
        pthread_cond_wait(&engine->start_changed, &engine->start_lock);
    pthread_mutex_unlock(&engine->start_lock);
    if (engine->start == START_FAILED) {
        if (error && error->kind == ERROR_NONE)
            *error = engine->start_error;
        return false;
    }
    return true;
}

struct engine *engine_create(const struct engine_options *options, struct error *error)
{
    struct engine *engine = calloc(1, sizeof(*engine));
    if (!engine) {
        error_set(error, ERROR_OUT_OF_MEMORY, "engine", "no memory for the engine");
        return NULL;
    }
    engine->options = *options;
    engine->backend = options->backend ? options->backend : &engine_backend_gpu;
    if (!engine->options.queue_capacity)
        engine->options.queue_capacity = QUEUE_CAPACITY_DEFAULT;
    if (!engine->options.frames_in_flight)
        engine->options.frames_in_flight = ENGINE_FRAMES_IN_FLIGHT;
    engine_set_limits(engine, &options->limits);
    if (!engine->options.frame_window_bytes)
        engine->options.frame_window_bytes = ENGINE_FRAME_WINDOW_BYTES;
    pthread_mutex_init(&engine->start_lock, NULL);
    pthread_cond_init(&engine->start_changed, NULL);
    size_t capacity = engine->options.queue_capacity;
    capacity = capacity < COMMANDS_WAITING_MAX ? capacity : COMMANDS_WAITING_MAX;
    engine->commands = queue_create(capacity + 1, false); /* the nudge needs a place of its own */
    engine->events = queue_create(engine->options.queue_capacity, true);
    if (!engine->commands || !engine->events)
        error_set(error, ERROR_OUT_OF_MEMORY, "queue_capacity", "no memory or descriptor for a queue of %zu",
                  engine->options.queue_capacity);
    else if (start_threads(engine, error))
        return engine;
    engine_destroy(engine);
    return NULL;
}

static void drop_command(void *item)
{
    if (item != &nudge)
        engine_command_destroy(item);
}

static void drop_event(void *item)
{
    engine_event_destroy(item);
}

void engine_destroy(struct engine *engine)
{
    if (!engine)
        return;
    atomic_store(&engine->stop, true);
    /* Threads that wait on a queue continue, and their later entries are dropped. */
    if (engine->commands)
        queue_close(engine->commands);
    if (engine->events)
        queue_close(engine->events);
    if (engine->has_thread)
        pthread_join(engine->thread, NULL);
    aside_destroy(engine->aside);
    keep_destroy(engine->keep, 0);
    encode_pool_destroy(engine->pool);
    queue_destroy(engine->commands, drop_command);
    queue_destroy(engine->events, drop_event);
    hashmap_finish(&engine->clients);
    free(engine->jobs);
    free(engine->entries);
    pthread_cond_destroy(&engine->start_changed);
    pthread_mutex_destroy(&engine->start_lock);
    free(engine);
}

/* ---- seen by the network thread ----------------------------------------------------------------- */

const struct gpu_device_info *engine_device(const struct engine *engine)
{
    return &engine->device_info;
}

uint64_t engine_device_limit_bytes(const struct engine *engine)
{
    return engine->device_bytes_limit;
}

bool engine_submit(struct engine *engine, struct engine_command *command, struct error *error)
{
    if (queue_try_push(engine->commands, command))
        return true;
    error_set(error, ERROR_BUSY, "", "%zu requests wait already", queue_length(engine->commands));
    return error_remedy(error, "try again in a moment");
}

int engine_event_fd(const struct engine *engine)
{
    return queue_event_fd(engine->events);
}

struct engine_event *engine_next_event(struct engine *engine)
{
    struct engine_event *event = queue_try_pop(engine->events);
    if (event && event->output) {
        job_output_taken(event->output);
        /* The job may have one more frame. */
        engine_nudge(engine);
    }
    return event;
}

void engine_report_sent(struct engine *engine, uint64_t queue_ns, uint64_t send_ns)
{
    stage_totals_add(&engine->totals, STAGE_QUEUE, CLOCK_CPU, queue_ns);
    stage_totals_add(&engine->totals, STAGE_SEND, CLOCK_CPU, send_ns);
}

bool engine_is_alive(const struct engine *engine, uint64_t *turns)
{
    uint64_t before = *turns;
    *turns = atomic_load(&engine->turns) + progress_reports();
    return atomic_load(&engine->waits) || *turns != before;
}
