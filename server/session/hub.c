/* SPDX-License-Identifier: MIT */
#include "session/hub.h"

#include "base/clock.h"
#include "base/log.h"
#include "session/session.h"

#include <stdlib.h>
#include <sys/epoll.h>

#define RETRY_NS UINT64_C(2000000)
/* Maximum of engine events that are handled before clients get their turn again. */
#define EVENTS_A_TURN 64

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

static void hold_sessions(struct hub *hub, bool held)
{
    size_t cursor = 0;
    void *session;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &session))
        session_hold(session, held);
}

void hub_submit(struct hub *hub, struct engine_command *command)
{
    if (!hub->waiting && try_submit(hub, command))
        return;
    if (!hub->waiting) {
        log_write(LOG_DEBUG, "session", "the engine's queue is full; clients wait");
        hold_sessions(hub, true);
        loop_timer_start(hub->loop, &hub->retry_timer, RETRY_NS);
    }
    command->next = NULL;
    *hub->waiting_end = command;
    hub->waiting_end = &command->next;
}

void hub_trim(struct hub *hub, blob_principal principal, uint64_t bytes)
{
    struct engine_command *command = hub_command(ENGINE_SCENES_TRIM, 0, 0);
    if (!command)
        return;
    command->principal = principal;
    command->trim_bytes = bytes;
    hub_submit(hub, command);
}

static void retry(void *context)
{
    struct hub *hub = context;
    while (hub->waiting) {
        struct engine_command *next = hub->waiting->next; /* the engine may destroy the command */
        if (!try_submit(hub, hub->waiting))
            break;
        hub->waiting = next;
    }
    if (hub->waiting) {
        loop_timer_start(hub->loop, &hub->retry_timer, RETRY_NS);
        return;
    }
    hub->waiting_end = &hub->waiting;
    hold_sessions(hub, false);
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
        if (event->kind == ENGINE_CLIENT_FORGOTTEN || event->kind == ENGINE_SCENE_ENDED)
            blob_store_trim(hub->blobs);
        else if (event->kind == ENGINE_DEVICE_GONE && hub->device_gone)
            hub->device_gone(hub->call_context);
        else if (session)
            session_engine_event(session, event);
        engine_event_destroy(event);
    }
}

/* ---- clients ----------------------------------------------------------------------------------------- */

static size_t unauthenticated_from(const struct hub *hub, const struct address *peer)
{
    size_t count = 0, cursor = 0;
    void *value;
    while (hashmap_next(&hub->sessions, &cursor, NULL, &value)) {
        const struct session *session = value;
        count += !session->introduced && address_same_host(&session->peer, peer);
    }
    return count;
}

bool hub_add_client(struct hub *hub, int fd, const struct address *own, const struct address *peer,
                    struct error *error)
{
    bool sealed_only = !hub->options.insecure && auth_is_beyond_loopback(own, peer);
    const struct session_limits *limits = &hub->options.limits;
    struct auth_identity identity;
    if (hub->stopping)
        return error_set(error, ERROR_SHUTTING_DOWN, NULL, "the daemon stops");
    if (!auth_identify(&identity, fd, peer, hub->options.insecure || hub->options.keys.count, error))
        return false;
    bool is_owner = hub->last_number + 1 == hub->owner; /* local clients with full rights */
    if (!is_owner && identity.has_user && readers_have(&hub->options.readers, identity.user))
        identity.read_only = true;
    if (hub->unauthenticated >= limits->unauthenticated)
        return error_set(error, ERROR_LIMIT, NULL, "%zu connections have not introduced themselves",
                         hub->unauthenticated);
    if (!address_is_unix(peer) && unauthenticated_from(hub, peer) >= limits->unauthenticated_per_address)
        return error_set(error, ERROR_LIMIT, NULL, "%u connections of this host have not introduced themselves",
                         limits->unauthenticated_per_address);
    struct session *session = session_create(hub, hub->last_number + 1, fd, sealed_only, peer, &identity, error);
    if (!session)
        return false;
    if (!hashmap_put(&hub->sessions, ++hub->last_number, session)) {
        /* The descriptor is the connection's by now. */
        session_close(session);
        return true;
    }
    if (hub->waiting)
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
        hub->owner_limits.idle_ms = 0;
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
    hub->options.readers = options->readers;
    hub->options.keys = options->keys;
    blob_store_limit(hub->blobs, options->limits.blob_bytes, options->limits.blob_cache_bytes);
    return true;
}

/* ---- life -------------------------------------------------------------------------------------------- */

bool hub_init(struct hub *hub, struct loop *loop, const struct hub_options *options, struct error *error)
{
    *hub = (struct hub){
        .loop = loop,
        .options = *options,
        .started_ns = clock_now_ns(),
        .retry_timer = {.call = retry, .context = hub},
    };
    set_connection_limits(hub, &options->connection_limits);
    hub->waiting_end = &hub->waiting;
    hub->blobs = blob_store_create(options->limits.blob_bytes, options->limits.blob_cache_bytes);
    if (!hub->blobs)
        return error_set(error, ERROR_OUT_OF_MEMORY, "session", "no memory");
    hub->engine_watch =
        loop_watch_add(loop, options->engine.event_fd(options->engine.context), EPOLLIN, on_engine, hub, error);
    if (hub->engine_watch)
        return true;
    blob_store_destroy(hub->blobs);
    return false;
}

void hub_finish(struct hub *hub)
{
    loop_watch_remove(hub->engine_watch);
    loop_timer_stop(hub->loop, &hub->retry_timer);
    while (hub->waiting) {
        struct engine_command *command = hub->waiting;
        hub->waiting = command->next;
        engine_command_destroy(command);
    }
    blob_store_destroy(hub->blobs);
    hashmap_finish(&hub->sessions);
}
