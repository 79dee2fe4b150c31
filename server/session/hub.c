/* SPDX-License-Identifier: MIT */
#include "session/hub.h"

#include "base/clock.h"
#include "base/log.h"
#include "session/others.h"
#include "session/session.h"

#include <stdlib.h>
#include <sys/epoll.h>

#define RETRY_NS UINT64_C(2000000)
/* Maximum of engine events that are handled before clients get their turn again. */
#define EVENTS_A_TURN 64
/* Number of commands waiting for the engine at which clients are no longer read from; reading resumes at half of
 * it. */
#define COMMANDS_MAX 64

/* ---- commands ---------------------------------------------------------------------------------------- */

struct engine_command *hub_command(enum engine_command_kind kind, uint64_t client, uint32_t request)
{
    struct engine_command *command = calloc(1, sizeof(*command));
    if (command) {
        command->kind = kind;
        command->client = client;
        command->request = request;
    }
    return command;
}

static bool try_submit(struct hub *hub, struct engine_command *command)
{
    struct error error = {0};
    return hub->options.engine.submit(hub->options.engine.context, command, &error);
}

/* ---- waiting for the engine -------------------------------------------------------------------------- */

static void hold(struct hub *hub, bool held)
{
    size_t cursor = 0;
    void *session;
    hub->held = held;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &session))
        session_hold(session, held);
}

static void feed(struct hub *hub)
{
    while (hub->waiting) {
        struct engine_command *next = hub->waiting->next; /* the engine may destroy the command */
        if (!try_submit(hub, hub->waiting))
            break;
        hub->waiting = next;
        hub->waiting_count--;
    }
    if (!hub->waiting)
        hub->waiting_end = &hub->waiting;
    else if (!hub->retry_timer.running)
        loop_timer_start(hub->loop, &hub->retry_timer, RETRY_NS);
    if (hub->held && hub->waiting_count <= COMMANDS_MAX / 2)
        hold(hub, false);
}

void hub_submit(struct hub *hub, struct engine_command *command)
{
    command->next = NULL;
    *hub->waiting_end = command;
    hub->waiting_end = &command->next;
    hub->waiting_count++;
    feed(hub);
    if (hub->waiting_count >= COMMANDS_MAX && !hub->held) {
        log_write(LOG_DEBUG, "session", "the engine's queue is full; clients wait");
        hold(hub, true);
    }
}

/* ---- memory ------------------------------------------------------------------------------------------ */

void hub_departed(struct hub *hub, uint64_t client, uint64_t transaction_bytes)
{
    if (transaction_bytes && !hashmap_put(&hub->departed, client, (void *)(uintptr_t)transaction_bytes))
        hub->transaction_bytes -= transaction_bytes;
}

static void forgotten(struct hub *hub, uint64_t client)
{
    hub->transaction_bytes -= (uintptr_t)hashmap_remove(&hub->departed, client);
}

void hub_trim(struct hub *hub, uint64_t bytes)
{
    struct engine_command *command = hub_command(ENGINE_SCENES_TRIM, 0, 0);
    if (!command)
        return;
    command->trim_bytes = bytes;
    hub_submit(hub, command);
}

static void retry(void *context)
{
    feed(context);
}

/* ---- events ------------------------------------------------------------------------------------------ */

static void on_engine(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct hub *hub = context;
    struct engine_event *event;
    for (int i = 0; i < EVENTS_A_TURN; i++) {
        event = hub->options.engine.next_event(hub->options.engine.context);
        if (!event)
            return;
        struct session *session = hashmap_get(&hub->sessions, event->client);
        if (event->kind == ENGINE_CLIENT_FORGOTTEN)
            forgotten(hub, event->client);
        if (event->kind == ENGINE_CLIENT_FORGOTTEN || event->kind == ENGINE_SCENE_ENDED)
            blob_store_trim(hub->blobs);
        else if (event->kind == ENGINE_DEVICE_GONE && hub->device_gone)
            hub->device_gone(hub->call_context);
        else if (session)
            session_engine_event(session, event);
        else if (!event->client && event->request)
            others_answer(hub->others, event);
        engine_event_destroy(event);
    }
}

/* ---- clients ----------------------------------------------------------------------------------------- */

bool hub_add_client(struct hub *hub, int fd, const struct handover *handover, struct error *error)
{
    if (hub->stopping)
        return error_set(error, ERROR_SHUTTING_DOWN, NULL, "the daemon stops");
    if (handover->is_owner)
        hub->owner = hub->last_number + 1;
    struct session *session = session_create(hub, hub->last_number + 1, fd, handover, error);
    if (!session)
        return false;
    if (!hashmap_put(&hub->sessions, ++hub->last_number, session)) {
        /* The connection already owns the descriptor. */
        session_close(session);
        return true;
    }
    if (hub->held)
        session_hold(session, true);
    return true;
}

void hub_stop(struct hub *hub)
{
    hub->stopping = true;
    size_t cursor = 0;
    void *session;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &session))
        session_stop(session);
    if (!hub->sessions.count && hub->emptied)
        hub->emptied(hub->call_context);
}

static void set_connection_limits(struct hub *hub, const struct connection_limits *limits)
{
    hub->options.connection_limits = *limits;
    hub->owner_limits = *limits;
    if (hub->options.owner_may_be_idle)
        hub->owner_limits.idle_ms = hub->owner_limits.lost_ms = 0;
}

/* Disconnects clients whose key was replaced: a key is replaced because the wrong person has it. */
static void end_those_without_key(struct hub *hub)
{
    size_t cursor = 0;
    void *session;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &session))
        session_check_key(session);
}

bool hub_reload(struct hub *hub, const struct hub_options *options, struct error *error)
{
    struct engine_command *command = hub_command(ENGINE_LIMITS, 0, 0);
    if (!command)
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    command->limits = options->engine_limits;
    hub_submit(hub, command);
    hub->options.limits = options->limits;
    set_connection_limits(hub, &options->connection_limits);
    hub->options.engine_limits = options->engine_limits;
    hub->options.keys = options->keys;
    end_those_without_key(hub);
    blob_store_limit(hub->blobs, options->limits.blob_bytes, options->limits.blob_cache_bytes);
    return true;
}

/* ---- life -------------------------------------------------------------------------------------------- */

bool hub_init(struct hub *hub, struct loop *loop, const struct hub_options *options, struct error *error)
{
    *hub = (struct hub){
        .loop = loop,
        .options = *options,
        .last_number = options->first_client,
        .retry_timer = {.call = retry, .context = hub},
    };
    set_connection_limits(hub, &options->connection_limits);
    hub->waiting_end = &hub->waiting;
    hub->blobs = blob_store_create(options->limits.blob_bytes, options->limits.blob_cache_bytes);
    hub->others = others_create(hub);
    if (!hub->blobs || !hub->others) {
        error_set(error, ERROR_OUT_OF_MEMORY, "session", "no memory");
        goto fail;
    }
    hub->engine_watch =
        loop_watch_add(loop, options->engine.event_fd(options->engine.context), EPOLLIN, on_engine, hub, error);
    if (hub->engine_watch) {
        hub->hasher = hasher_create();
        return true;
    }
fail:
    others_destroy(hub->others);
    blob_store_destroy(hub->blobs);
    return false;
}

void hub_finish(struct hub *hub)
{
    loop_watch_remove(hub->engine_watch);
    loop_timer_stop(hub->loop, &hub->retry_timer);
    for (struct engine_command *command; (command = hub->waiting);) {
        hub->waiting = command->next;
        engine_command_destroy(command);
    }
    hashmap_finish(&hub->departed);
    others_destroy(hub->others);
    hasher_destroy(hub->hasher);
    blob_store_destroy(hub->blobs);
    hashmap_finish(&hub->sessions);
}
