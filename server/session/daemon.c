/* SPDX-License-Identifier: MIT */
#include "session/daemon.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "net/activation.h"
#include "net/greeting.h"
#include "net/notify.h"
#include "session/session.h"

#include <errno.h>
#include <fcntl.h>
#include <inttypes.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

/* Few at once, so that the first clients can finish their handshake before the next are counted. */
#define ACCEPTS_A_TURN 4
/* Out of descriptors: a listener stays readable all the time, so it is not watched for this long. */
#define ACCEPT_PAUSE_NS UINT64_C(100000000)

/* In which clients may take their goodbye when the daemon stops. */
#define STOP_NS UINT64_C(400000000)

#define BLANKS " \t"

/* In the time in which the service manager wants to hear something. */
#define WATCHDOG_LOOKS 4

static void own_signals(sigset_t *set)
{
    sigemptyset(set);
    sigaddset(set, SIGTERM);
    sigaddset(set, SIGINT);
    sigaddset(set, SIGHUP);
}

void daemon_block_signals(void)
{
    sigset_t set;
    own_signals(&set);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
}

void daemon_init(struct daemon *daemon)
{
    *daemon = (struct daemon){.signal_fd = -1};
}

static bool listen_at(struct daemon *daemon, const char *text, bool beyond_loopback, struct error *error)
{
    struct address address;
    if (daemon->listener_count == DAEMON_LISTENERS_MAX)
        return error_set(error, ERROR_LIMIT, text, "at most %d addresses", DAEMON_LISTENERS_MAX);
    if (!address_parse(&address, text, error) ||
        !listener_open(&daemon->listeners[daemon->listener_count], &address, beyond_loopback, error))
        return false;
    daemon->listener_count++;
    return true;
}

/* Takes the first address off `*rest`; NULL: none is left. A path may have blanks, so an address ends where the
 * next one begins: with "unix:", "tcp:" or another word and a colon. */
static char *next_address(char **rest)
{
    char *address = *rest + strspn(*rest, BLANKS), *end = address, *next = address;
    do {
        end = next + strcspn(next, BLANKS);
        next = end + strspn(end, BLANKS);
    } while (*next && next[strcspn(next, "/:" BLANKS)] != ':');
    *end = '\0';
    *rest = next;
    return address[0] ? address : NULL;
}

bool daemon_listen(struct daemon *daemon, const char *addresses, bool beyond_loopback, struct error *error)
{
    char *copy = strdup(addresses), *rest = copy;
    bool ok = copy || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    for (char *address; ok && (address = next_address(&rest));)
        ok = listen_at(daemon, address, beyond_loopback, error);
    free(copy);
    return ok && (daemon->listener_count || error_set(error, ERROR_INVALID, "server.listen", "no address"));
}

bool daemon_listen_activated(struct daemon *daemon, bool beyond_loopback, size_t *count, struct error *error)
{
    char names[DAEMON_LISTENERS_MAX][ACTIVATION_NAME_BYTES];
    for (size_t i = 0; i < DAEMON_LISTENERS_MAX; i++)
        activation_name(i, names[i]);
    *count = activation_take();
    if (*count > DAEMON_LISTENERS_MAX)
        return error_set(error, ERROR_LIMIT, "LISTEN_FDS", "at most %d sockets", DAEMON_LISTENERS_MAX);
    for (size_t i = 0; i < *count; i++) {
        if (!listener_adopt(&daemon->listeners[i], ACTIVATION_FD_FIRST + (int)i, names[i], beyond_loopback, error))
            return false;
        daemon->listener_count++;
    }
    return true;
}

/* ---- clients ----------------------------------------------------------------------------------------- */

static void watch_listeners(struct daemon *daemon, bool watched)
{
    for (size_t i = 0; i < daemon->listener_count; i++) {
        if (daemon->listener_watches[i])
            loop_watch_change(daemon->listener_watches[i], watched ? (uint32_t)EPOLLIN : 0);
    }
}

static void on_accept_timer(void *context)
{
    watch_listeners(context, true);
}

static void pause_accepting(struct daemon *daemon)
{
    watch_listeners(daemon, false);
    loop_timer_start(daemon->loop, &daemon->accept_timer, ACCEPT_PAUSE_NS);
}

static bool accept_one(struct daemon *daemon, const struct listener *listener)
{
    struct address peer;
    bool retry_later;
    int fd = listener_accept(listener, &peer, &retry_later);
    if (retry_later)
        pause_accepting(daemon);
    if (fd < 0)
        return false;
    struct error error = {0};
    if (hub_add_client(&daemon->hub, fd, &listener->address, &peer, &error))
        return true;
    if (log_is_due(address_network(&peer), "turned away"))
        log_write(LOG_WARNING, "session", "a client is turned away: %s", error.text);
    greeting_turn_away(fd, error.text, error.kind == ERROR_DENIED ? 0 : HANDSHAKE_TRY_AGAIN);
    close(fd);
    return true;
}

static void accept_from(struct daemon *daemon, const struct listener *listener)
{
    for (int i = 0; i < ACCEPTS_A_TURN && accept_one(daemon, listener); i++)
        continue;
}

static void on_listeners(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct daemon *daemon = context;
    for (size_t i = 0; i < daemon->listener_count; i++)
        accept_from(daemon, &daemon->listeners[i]);
}

/* ---- the end ----------------------------------------------------------------------------------------- */

static void stop(struct daemon *daemon)
{
    if (daemon->hub.stopping) {
        loop_stop(daemon->loop); /* asked twice: without goodbye */
        return;
    }
    notify_manager("STOPPING=1");
    for (size_t i = 0; i < daemon->listener_count; i++) {
        loop_watch_remove(daemon->listener_watches[i]);
        daemon->listener_watches[i] = NULL;
        listener_close(&daemon->listeners[i]);
    }
    daemon->listener_count = 0;
    loop_timer_start(daemon->loop, &daemon->stop_timer, STOP_NS);
    hub_stop(&daemon->hub);
}

/* systemd's notify-reload wants the time along, to tell this answer from one to a signal before. */
static void reload(struct daemon *daemon)
{
    char state[64];
    snprintf(state, sizeof(state), "RELOADING=1\nMONOTONIC_USEC=%" PRIu64, clock_now_ns() / 1000);
    notify_manager(state);
    if (daemon->reload)
        daemon->reload(daemon->reload_context);
    notify_manager("READY=1");
}

static void on_signal(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct daemon *daemon = context;
    struct signalfd_siginfo info;
    if (read(daemon->signal_fd, &info, sizeof(info)) != (ssize_t)sizeof(info))
        return;
    if (info.ssi_signo == SIGHUP) {
        if (!daemon->hub.stopping)
            reload(daemon);
        return;
    }
    log_write(LOG_INFO, "session", "stopping: %s", info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT");
    stop(daemon);
}

static void on_emptied(void *context)
{
    struct daemon *daemon = context;
    if (daemon->hub.stopping)
        loop_stop(daemon->loop);
    else if (daemon->unused_ns)
        loop_timer_start(daemon->loop, &daemon->unused_timer, daemon->unused_ns);
}

/* A client that has come since then starts the timer again when it goes. */
static void on_unused_timer(void *context)
{
    struct daemon *daemon = context;
    if (daemon->hub.stopping || daemon->hub.sessions.count)
        return;
    log_write(LOG_INFO, "session", "stopping: there was no client for %" PRIu64 " s",
              daemon->unused_ns / UINT64_C(1000000000));
    stop(daemon);
}

static void on_stop_timer(void *context)
{
    struct daemon *daemon = context;
    loop_stop(daemon->loop);
}

static void on_owner_gone(void *context)
{
    struct daemon *daemon = context;
    if (!daemon->hub.stopping)
        stop(daemon);
}

/* A retry may succeed: another process has another context. */
static void on_device_gone(void *context)
{
    struct daemon *daemon = context;
    if (daemon->hub.stopping)
        return;
    log_write(LOG_ERROR, "session", "stopping: the GPU is lost for good");
    daemon->device_gone = true;
    stop(daemon);
}

/* A driver that hangs cannot be healed from within, so the manager hears nothing more; nor where this thread
 * hangs. A ping that is left out because of one long slice is made up for by the next. */
static void on_watchdog_timer(void *context)
{
    struct daemon *daemon = context;
    const struct engine_port *engine = &daemon->hub.options.engine;
    if (engine->is_alive(engine->context, &daemon->engine_turns))
        notify_manager("WATCHDOG=1");
    loop_timer_start(daemon->loop, &daemon->watchdog_timer, daemon->watchdog_ns / WATCHDOG_LOOKS);
}

/* ---- life -------------------------------------------------------------------------------------------- */

static bool watch_signals(struct daemon *daemon, struct error *error)
{
    sigset_t set;
    own_signals(&set);
    daemon->signal_fd = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (daemon->signal_fd < 0)
        return error_set(error, ERROR_INTERNAL, NULL, "signalfd: %s", strerror(errno));
    daemon->signal_watch = loop_watch_add(daemon->loop, daemon->signal_fd, EPOLLIN, on_signal, daemon, error);
    return daemon->signal_watch != NULL;
}

bool daemon_start(struct daemon *daemon, const struct hub_options *options, struct error *error)
{
    struct loop *loop = loop_create(error);
    if (!loop)
        return false;
    if (!hub_init(&daemon->hub, loop, options, error)) {
        loop_destroy(loop);
        return false;
    }
    daemon->loop = loop;
    daemon->hub.owner_gone = on_owner_gone;
    daemon->hub.emptied = on_emptied;
    daemon->hub.device_gone = on_device_gone;
    daemon->hub.call_context = daemon;
    daemon->accept_timer = (struct loop_timer){.call = on_accept_timer, .context = daemon};
    daemon->stop_timer = (struct loop_timer){.call = on_stop_timer, .context = daemon};
    daemon->unused_timer = (struct loop_timer){.call = on_unused_timer, .context = daemon};
    daemon->watchdog_timer = (struct loop_timer){.call = on_watchdog_timer, .context = daemon};
    daemon->watchdog_ns = notify_watchdog_ns();
    if (daemon->watchdog_ns)
        on_watchdog_timer(daemon);
    if (!watch_signals(daemon, error))
        return false;
    on_emptied(daemon); /* as yet there is no client */
    for (size_t i = 0; i < daemon->listener_count; i++) {
        daemon->listener_watches[i] =
            loop_watch_add(loop, daemon->listeners[i].fd, EPOLLIN, on_listeners, daemon, error);
        if (!daemon->listener_watches[i])
            return false;
    }
    return true;
}

bool daemon_serve_fd(struct daemon *daemon, int fd, struct error *error)
{
    struct address own = {.storage_bytes = sizeof(own.storage)}, peer = {.storage_bytes = sizeof(peer.storage)};
    char field[32];
    snprintf(field, sizeof(field), "--fd %d", fd);
    if (getsockname(fd, (struct sockaddr *)&own.storage, &own.storage_bytes) < 0 ||
        getpeername(fd, (struct sockaddr *)&peer.storage, &peer.storage_bytes) < 0)
        return error_set(error, ERROR_INVALID, field, "not a connected socket: %s", strerror(errno));
    int flags = fcntl(fd, F_GETFL);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0 || fcntl(fd, F_SETFD, FD_CLOEXEC) < 0)
        return error_set(error, ERROR_INVALID, field, "%s", strerror(errno));
    daemon->hub.owner = daemon->hub.last_number + 1;
    return hub_add_client(&daemon->hub, fd, &own, &peer, error);
}

void daemon_print_ready(const struct daemon *daemon, FILE *stream)
{
    for (size_t i = 0; i < daemon->listener_count; i++) {
        char text[ADDRESS_TEXT_BYTES];
        address_print(&daemon->listeners[i].address, text);
        fprintf(stream, "READY %s\n", text);
    }
    if (!daemon->listener_count)
        fprintf(stream, "READY\n");
    fflush(stream);
}

bool daemon_run(struct daemon *daemon, bool *device_gone, struct error *error)
{
    notify_manager("READY=1");
    bool ok = loop_run(daemon->loop, error);
    *device_gone = daemon->device_gone;
    return ok;
}

static void close_sessions(struct daemon *daemon)
{
    size_t cursor = 0;
    void *session;
    while (hashmap_next(&daemon->hub.sessions, &cursor, NULL, &session))
        session_close(session);
    loop_run_deferred(daemon->loop);
}

void daemon_finish(struct daemon *daemon)
{
    for (size_t i = 0; i < daemon->listener_count; i++) {
        loop_watch_remove(daemon->listener_watches[i]);
        listener_close(&daemon->listeners[i]);
    }
    if (daemon->loop) {
        close_sessions(daemon);
        loop_watch_remove(daemon->signal_watch);
        loop_timer_stop(daemon->loop, &daemon->accept_timer);
        loop_timer_stop(daemon->loop, &daemon->stop_timer);
        loop_timer_stop(daemon->loop, &daemon->unused_timer);
        loop_timer_stop(daemon->loop, &daemon->watchdog_timer);
        hub_finish(&daemon->hub);
        loop_destroy(daemon->loop);
    }
    if (daemon->signal_fd >= 0)
        close(daemon->signal_fd);
    daemon_init(daemon);
}
