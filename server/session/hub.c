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
/* An owner with so many commands that wait for the engine is not read from until half of them are gone. */
#define OWNER_COMMANDS_MAX 64
#define STATS_AT_ONCE 4
#define OWNER_ITSELF UINT64_MAX

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

/* ---- turns ------------------------------------------------------------------------------------------- */

static void hold(struct hub *hub, struct owner *owner, bool held)
{
    size_t cursor = 0;
    void *value;
    owner->held = held;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &value)) {
        struct session *session = value;
        if (session->owner == owner)
            session_hold(session, held);
    }
}

static void append_turn(struct hub *hub, struct owner *owner)
{
    owner->next = NULL;
    *hub->turn_end = owner;
    hub->turn_end = &owner->next;
}

static struct owner *take_turn(struct hub *hub)
{
    struct owner *owner = hub->turn_first;
    hub->turn_first = owner->next;
    if (!hub->turn_first)
        hub->turn_end = &hub->turn_first;
    return owner;
}

/* Figures are much work for who asks nothing of the engine but them. */
static bool waits_for_stats(const struct owner *owner)
{
    return owner->waiting->kind == ENGINE_STATS && owner->stats_asked >= STATS_AT_ONCE;
}

/* The first command of the owner whose turn it is. False: the engine's queue is full. */
static bool feed_one(struct hub *hub)
{
    struct owner *owner = hub->turn_first;
    if (waits_for_stats(owner)) {
        take_turn(hub)->waits_for_stats = true;
        return true;
    }
    bool is_stats = owner->waiting->kind == ENGINE_STATS;
    struct engine_command *next = owner->waiting->next; /* the engine may destroy the command */
    if (!try_submit(hub, owner->waiting))
        return false;
    owner->waiting = next;
    owner->waiting_count--;
    owner->stats_asked += is_stats;
    take_turn(hub);
    if (owner->held && owner->waiting_count <= OWNER_COMMANDS_MAX / 2)
        hold(hub, owner, false);
    if (next) {
        append_turn(hub, owner);
    } else {
        owner->waiting_end = &owner->waiting;
        owner_unref(&hub->owners, owner);
    }
    return true;
}

static void feed(struct hub *hub)
{
    while (hub->turn_first && feed_one(hub))
        continue;
    if (hub->turn_first && !hub->retry_timer.running)
        loop_timer_start(hub->loop, &hub->retry_timer, RETRY_NS);
}

void hub_submit(struct hub *hub, struct owner *owner, struct engine_command *command)
{
    command->next = NULL;
    command->owner = owner->number;
    *owner->waiting_end = command;
    owner->waiting_end = &command->next;
    if (owner->waiting_count++ == 0)
        append_turn(hub, owner_ref(owner));
    feed(hub);
    if (owner->waiting_count >= OWNER_COMMANDS_MAX && !owner->held) {
        log_write(LOG_DEBUG, "session", "the engine's queue is full; clients of one owner wait");
        hold(hub, owner, true);
    }
}

static void stats_answered(struct hub *hub, uint64_t number)
{
    struct owner *owner = hashmap_get(&hub->owners.by_number, number);
    if (!owner || !owner->stats_asked)
        return; /* that owner was gone in between */
    owner->stats_asked--;
    if (!owner->waits_for_stats)
        return;
    owner->waits_for_stats = false;
    append_turn(hub, owner);
    feed(hub);
}

/* ---- memory ------------------------------------------------------------------------------------------ */

void hub_count_frames(struct hub *hub, struct owner *owner, int64_t bytes)
{
    hub->frame_bytes += (uint64_t)bytes;
    owner->frame_bytes += (uint64_t)bytes;
}

void hub_count_edits(struct hub *hub, struct owner *owner, int64_t bytes)
{
    hub->transaction_bytes += (uint64_t)bytes;
    owner->transaction_bytes += (uint64_t)bytes;
}

struct departed {
    struct owner *owner;
    uint64_t transaction_bytes;
};

void hub_departed(struct hub *hub, uint64_t client, struct owner *owner, uint64_t transaction_bytes)
{
    struct departed *departed = transaction_bytes ? calloc(1, sizeof(*departed)) : NULL;
    if (!departed || !hashmap_put(&hub->departed, client, departed)) {
        free(departed);
        hub_count_edits(hub, owner, -(int64_t)transaction_bytes);
        return;
    }
    *departed = (struct departed){owner_ref(owner), transaction_bytes};
}

static void forgotten(struct hub *hub, uint64_t client)
{
    struct departed *departed = hashmap_remove(&hub->departed, client);
    if (!departed)
        return;
    hub_count_edits(hub, departed->owner, -(int64_t)departed->transaction_bytes);
    owner_unref(&hub->owners, departed->owner);
    free(departed);
}

void hub_trim(struct hub *hub, blob_principal principal, uint64_t bytes)
{
    struct engine_command *command = hub_command(ENGINE_SCENES_TRIM, 0, 0);
    if (!command)
        return;
    command->principal = principal;
    command->trim_bytes = bytes;
    hub_submit(hub, hub->itself, command);
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
        if (event->answers_stats)
            stats_answered(hub, event->owner);
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
    struct owner *owner = owner_find(&hub->owners, auth_owner_number(&handover->identity, &handover->peer));
    if (!owner)
        return error_set(error, ERROR_OUT_OF_MEMORY, "session", "no memory");
    if (handover->is_owner)
        hub->owner = hub->last_number + 1;
    struct session *session = session_create(hub, hub->last_number + 1, fd, handover, owner, error);
    owner_unref(&hub->owners, owner);
    if (!session)
        return false;
    if (!hashmap_put(&hub->sessions, ++hub->last_number, session)) {
        /* The descriptor is the connection's by now. */
        session_close(session);
        return true;
    }
    if (session->owner->held)
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

/* A key is replaced because somebody has it that should not: its holders go at once. */
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
    hub_submit(hub, hub->itself, command);
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
    hub->turn_end = &hub->turn_first;
    hub->itself = owner_find(&hub->owners, OWNER_ITSELF);
    hub->blobs = blob_store_create(options->limits.blob_bytes, options->limits.blob_cache_bytes);
    hub->others = others_create(hub);
    if (!hub->blobs || !hub->itself || !hub->others) {
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
    owner_unref(&hub->owners, hub->itself);
    owners_finish(&hub->owners);
    return false;
}

void hub_finish(struct hub *hub)
{
    loop_watch_remove(hub->engine_watch);
    loop_timer_stop(hub->loop, &hub->retry_timer);
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&hub->owners.by_number, &cursor, NULL, &value)) {
        struct owner *owner = value;
        for (struct engine_command *command; (command = owner->waiting);) {
            owner->waiting = command->next;
            engine_command_destroy(command);
        }
        free(owner);
    }
    cursor = 0;
    while (hashmap_next(&hub->departed, &cursor, NULL, &value))
        free(value);
    hashmap_finish(&hub->departed);
    owners_finish(&hub->owners);
    others_destroy(hub->others);
    hasher_destroy(hub->hasher);
    blob_store_destroy(hub->blobs);
    hashmap_finish(&hub->sessions);
}
