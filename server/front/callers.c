/* SPDX-License-Identifier: MIT */
#include "front/callers.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "front/workers.h"
#include "net/greeting.h"
#include "net/handover.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Places beyond limits.clients for the daemon's own user and for root, so that these can always see its
 * state. */
#define PLACES_AT_HOME 4u

struct source {
    uint64_t owner;
    uint32_t callers; /* callers that no worker has yet */
};

struct caller {
    struct front *front;
    struct caller *next;
    struct connection *connection;
    struct auth_identity identity;
    bool is_owner; /* whether the daemon ends with it */
    /* Keys at its arrival: the daemon may read new ones while the caller proves that it has a key. */
    struct auth_keys *keys;
    struct address peer;
    struct source *source; /* NULL: it was disconnected */
    struct worker *worker; /* worker that will serve it; NULL: its hello has not arrived, or it is refused */
};

/* ---- count of callers without a hello ---- */

static struct source *source_of(struct front *front, uint64_t owner)
{
    struct source *source = hashmap_get(&front->sources, owner);
    if (source)
        return source;
    source = calloc(1, sizeof(*source));
    if (!source || !hashmap_put(&front->sources, owner, source)) {
        free(source);
        return NULL;
    }
    source->owner = owner;
    return source;
}

static void uncount(struct caller *caller)
{
    struct source *source = caller->source;
    if (!source)
        return;
    caller->source = NULL;
    caller->front->unauthenticated--;
    if (--source->callers == 0) {
        hashmap_remove(&caller->front->sources, source->owner);
        free(source);
    }
}

static void turn_away(struct caller *caller)
{
    uncount(caller);
    greeting_turn_away(caller->connection->fd,
                       "too many connections have not introduced themselves; try again later",
                       HANDSHAKE_TRY_AGAIN);
    connection_close(caller->connection);
}

static bool may_be_turned_away(const struct caller *caller, const struct source *source, bool has_wrong_key)
{
    return caller->source == source && (caller->connection->state == CONNECTION_WRONG_KEY || !has_wrong_key);
}

/* Closes a random caller of the source: a client that takes every place loses one of its own, and does not
 * know which. Callers that are known to have a wrong key go first. */
static void turn_one_away(struct front *front, const struct source *source)
{
    uint32_t wrong = 0;
    for (const struct caller *caller = front->callers; caller; caller = caller->next)
        wrong += may_be_turned_away(caller, source, true);
    uint32_t chosen = arc4random_uniform(wrong ? wrong : source->callers);
    for (struct caller *caller = front->callers; caller; caller = caller->next) {
        if (may_be_turned_away(caller, source, wrong) && chosen-- == 0) {
            turn_away(caller);
            return;
        }
    }
}

static const struct source *largest_source(const struct front *front)
{
    const struct source *most = NULL;
    size_t cursor = 0;
    void *value;
    while (hashmap_next(&front->sources, &cursor, NULL, &value)) {
        const struct source *source = value;
        if (source->callers > (most ? most->callers : 0))
            most = source;
    }
    return most;
}

static void make_place(struct front *front, const struct source *source, bool is_tcp)
{
    const struct front_limits *limits = &front->options.limits;
    if (is_tcp && source && source->callers >= limits->unauthenticated_per_address)
        turn_one_away(front, source);
    else if (front->unauthenticated && front->unauthenticated >= limits->unauthenticated / 2)
        turn_one_away(front, largest_source(front));
}

/* ---- the connection's calls ---- */

static uint64_t on_seal_wait_ns(void *context)
{
    const struct caller *caller = context;
    struct front *front = caller->front;
    /* Unix peers have no address that distinguishes them. */
    return address_is_unix(&caller->peer)
               ? 0
               : attempts_wait_ns(&front->attempts, address_network(&caller->peer),
                                  front->options.limits.handshakes_a_second, clock_now_ns());
}

static void on_key_failed(void *context)
{
    const struct caller *caller = context;
    if (log_is_due(auth_owner_number(&caller->identity, &caller->peer), "wrong key"))
        log_write(LOG_WARNING, "front", "a wrong key came from %s", caller->identity.name);
}

static void on_key_proved(void *context, size_t index)
{
    struct caller *caller = context;
    auth_identify_by_key(&caller->identity, caller->keys, index);
}

static bool is_at_home(const struct auth_identity *identity)
{
    return identity->has_user && (identity->user == 0 || identity->user == geteuid());
}

/* False: `text` says why. */
static bool has_place(const struct caller *caller, uint64_t owner, char text[HANDSHAKE_TEXT_MAX_BYTES + 1])
{
    const struct front_limits *limits = &caller->front->options.limits;
    const size_t text_bytes = HANDSHAKE_TEXT_MAX_BYTES + 1;
    const bool at_home = is_at_home(&caller->identity);
    const uint32_t own = workers_clients_of(caller->front, owner);
    if (caller->front->stopping)
        snprintf(text, text_bytes, "the daemon is about to stop");
    else if (workers_clients(caller->front) >= limits->clients + (at_home ? PLACES_AT_HOME : 0))
        snprintf(text, text_bytes, "%u clients are connected, the limit; try again later", limits->clients);
    else if (!at_home && own >= limits->clients_of_one)
        snprintf(text, text_bytes,
                 "%u of %u places are taken by the user or key of this client, its share; close one, try again "
                 "later, or raise limits.share in the daemon's configuration",
                 own, limits->clients);
    else
        return true;
    return false;
}

static void refuse(struct caller *caller, const char *why)
{
    caller->worker = NULL;
    connection_refuse(caller->connection, why, HANDSHAKE_TRY_AGAIN);
}

static void hand_over(struct caller *caller)
{
    struct worker *worker = caller->worker;
    struct error error = {0};
    const struct handover handover = {
        .identity = caller->identity, .peer = caller->peer, .is_owner = caller->is_owner};
    if (!handover_send(&worker->channel, caller->connection, &handover, NULL, 0, &error)) {
        refuse(caller, error.text);
        return;
    }
    worker->handed++;
    worker->has_daemon_owner = worker->has_daemon_owner || caller->is_owner;
    caller->is_owner = false;             /* the worker sees its end */
    connection_close(caller->connection); /* the socket is the worker's */
}

static void on_route(void *context, const struct handshake_hello *hello)
{
    struct caller *caller = context;
    struct front *front = caller->front;
    const uint64_t owner = auth_owner_number(&caller->identity, &caller->peer);
    char text[HANDSHAKE_TEXT_MAX_BYTES + 1];
    struct error error = {0};
    struct decode_error unlike = {0};
    if (!handshake_choose_version(hello, &unlike)) {
        connection_refuse(caller->connection, unlike.text, 0);
        return;
    }
    const struct auth_key_numbers keys = auth_keys_numbers(front->options.keys);
    if (caller->identity.has_key && !auth_numbers_have(&keys, &caller->identity)) {
        connection_refuse(caller->connection, "the daemon's key was replaced; connect with the new one", 0);
        return;
    }
    if (!has_place(caller, owner, text)) {
        refuse(caller, text);
        return;
    }
    caller->worker = workers_of(front, owner, caller->identity.name, &error);
    if (!caller->worker)
        refuse(caller, error.text);
    else if (caller->worker->is_ready)
        hand_over(caller);
}

static void on_closed(void *context)
{
    struct caller *caller = context;
    struct caller **place = &caller->front->callers;
    while (*place != caller)
        place = &(*place)->next;
    *place = caller->next;
    uncount(caller);
    auth_keys_unref(caller->keys);
    if (caller->is_owner)
        front_stop(caller->front);
    free(caller);
}

static const struct connection_handler handler = {
    .seal_wait_ns = on_seal_wait_ns,
    .key_failed = on_key_failed,
    .key_proved = on_key_proved,
    .route = on_route,
    .closed = on_closed,
};

/* ---- for the front ---- */

static struct caller *create(struct front *front, int fd, const struct auth_identity *identity,
                             const struct address *peer, bool sealed_only, struct error *error)
{
    const uint64_t owner = auth_owner_number(identity, peer);
    struct caller *caller = calloc(1, sizeof(*caller));
    struct source *source = caller ? source_of(front, owner) : NULL;
    struct auth_keys *keys = front->options.keys;
    const struct connection_entry entry = {
        .keys = keys ? keys->keys : NULL,
        .key_count = keys ? keys->count : 0,
        .sealed_only = sealed_only,
        .log_source = owner,
    };
    if (!source) {
        error_set(error, ERROR_OUT_OF_MEMORY, "front", "no memory");
        free(caller);
        return NULL;
    }
    *caller = (struct caller){
        .front = front, .identity = *identity, .peer = *peer, .keys = auth_keys_ref(keys), .source = source};
    source->callers++;
    front->unauthenticated++;
    caller->connection = connection_create(front->loop, fd, &front->options.connection_limits, &entry, &handler,
                                           caller, NULL, error);
    if (caller->connection)
        return caller;
    uncount(caller);
    auth_keys_unref(caller->keys);
    free(caller);
    return NULL;
}

static void insert(struct front *front, struct caller *caller)
{
    caller->next = front->callers;
    front->callers = caller;
}

bool callers_add_owner(struct front *front, int fd, struct error *error)
{
    struct address peer;
    struct auth_identity identity;
    struct caller *caller =
        listen_take_connected(fd, &peer, error) && auth_identify(&identity, fd, &peer, true, error)
            ? create(front, fd, &identity, &peer, false, error)
            : NULL;
    if (!caller)
        return false;
    caller->is_owner = true;
    insert(front, caller);
    return true;
}

bool callers_add(struct front *front, int fd, const struct address *own, const struct address *peer,
                 struct error *error)
{
    const struct front_options *options = &front->options;
    const bool sealed_only = !options->insecure && auth_needs_key(own, peer, options->keys);
    struct auth_identity identity;
    if (!auth_identify(&identity, fd, peer, options->insecure || options->keys, error))
        return false;
    if (identity.has_user && readers_have(&options->readers, identity.user))
        identity.read_only = true;
    make_place(front, hashmap_get(&front->sources, auth_owner_number(&identity, peer)), !address_is_unix(peer));
    struct caller *caller = create(front, fd, &identity, peer, sealed_only, error);
    if (!caller)
        return false;
    insert(front, caller);
    return true;
}

void callers_hand_over(struct front *front, struct worker *worker)
{
    for (struct caller *caller = front->callers; caller; caller = caller->next) {
        if (caller->worker == worker && caller->connection->state == CONNECTION_ROUTED)
            hand_over(caller);
    }
}

void callers_refuse(struct front *front, const struct worker *worker, const char *why)
{
    for (struct caller *caller = front->callers; caller; caller = caller->next) {
        if (caller->worker == worker && caller->connection->state == CONNECTION_ROUTED)
            refuse(caller, why);
        else if (caller->worker == worker)
            caller->worker = NULL;
    }
}

void callers_close(struct front *front)
{
    for (struct caller *caller = front->callers; caller; caller = caller->next)
        connection_close(caller->connection);
    loop_run_deferred(front->loop);
}
