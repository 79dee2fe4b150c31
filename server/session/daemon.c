/* SPDX-License-Identifier: MIT */
#include "session/daemon.h"

#include "base/clock.h"
#include "base/log.h"
#include "net/handover.h"
#include "net/listen.h"
#include "session/others.h"
#include "session/session.h"

#include <errno.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

/* Time in which clients may receive their goodbye when the daemon stops. */
#define STOP_NS UINT64_C(400000000)
/* Checks within the time after which a device without progress counts as lost. */
#define WATCHDOG_CHECKS 4

static void own_signals(sigset_t *set)
{
    sigemptyset(set);
    sigaddset(set, SIGTERM);
    sigaddset(set, SIGINT);
}

void daemon_block_signals(void)
{
    sigset_t set;
    own_signals(&set);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    signal(SIGHUP, SIG_IGN);
}

void daemon_init(struct daemon *daemon)
{
    *daemon = (struct daemon){.signal_fd = -1};
}

/* ---- the end ----------------------------------------------------------------------------------------- */

static void stop(struct daemon *daemon)
{
    if (daemon->hub.stopping) {
        loop_stop(daemon->loop); /* second signal: no goodbye */
        return;
    }
    channel_send(&daemon->front, CHANNEL_ENDING, NULL, 0, NULL);
    loop_timer_start(daemon->loop, &daemon->stop_timer, STOP_NS);
    hub_stop(&daemon->hub);
}

static void on_signal(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct daemon *daemon = context;
    struct signalfd_siginfo info;
    if (read(daemon->signal_fd, &info, sizeof(info)) != (ssize_t)sizeof(info))
        return;
    /* A service manager signals the front too, which then stops its workers. */
    if (daemon->front.watch && daemon->hub.stopping)
        return;
    log_write(daemon->front.watch ? LOG_DEBUG : LOG_INFO, "session", "stopping: %s",
              info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT");
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

/* ---- the front --------------------------------------------------------------------------------------- */

static void send_counts(struct daemon *daemon, uint32_t unused_s)
{
    const struct channel_counts counts = {
        .clients = (uint32_t)daemon->hub.introduced, .handed = daemon->handed, .unused_s = unused_s};
    channel_send(&daemon->front, CHANNEL_COUNTS, &counts, sizeof(counts), NULL);
}

static void on_counted(void *context)
{
    send_counts(context, 0);
}

static void start_unused_timer(struct daemon *daemon)
{
    loop_timer_start(daemon->loop, &daemon->unused_timer, daemon->unused_s * UINT64_C(1000000000));
}

static void on_emptied(void *context)
{
    struct daemon *daemon = context;
    if (daemon->hub.stopping)
        loop_stop(daemon->loop);
    else
        start_unused_timer(daemon);
}

/* Reports that no client is left; a client that has arrived since then restarts the timer when it goes. */
static void on_unused_timer(void *context)
{
    struct daemon *daemon = context;
    if (!daemon->hub.stopping && !daemon->hub.sessions.count)
        send_counts(daemon, daemon->unused_s);
}

static void take_client(struct daemon *daemon, const void *payload, size_t bytes, const int fds[CHANNEL_FDS])
{
    struct handover handover;
    struct error error = {0};
    daemon->handed++;
    bool ok = handover_take(&handover, payload, bytes, fds[1], &error);
    if (ok) {
        ok = hub_add_client(&daemon->hub, fds[0], &handover, &error);
        explicit_bzero(handover.saved.bytes, handover.saved.in_bytes + handover.saved.link_bytes);
        free(handover.saved.bytes);
    }
    if (!ok) {
        log_write(LOG_WARNING, "session", "a client is turned away: %s", error.text);
        close(fds[0]);
        send_counts(daemon, 0);
    }
}

static void send_ready(struct daemon *daemon, bool has_owner)
{
    const struct channel_ready ready = {.has_owner = has_owner, .device = daemon->device};
    channel_send(&daemon->front, CHANNEL_READY, &ready, sizeof(ready), NULL);
}

static void take_owner(struct daemon *daemon, const struct channel_owner *owner)
{
    daemon->hub.worker_of = owner->number;
    daemon->owned(daemon->front_context, owner);
    start_unused_timer(daemon); /* a client of restored scenes may never come */
    send_ready(daemon, true);
}

/* Reports a hanging driver, which cannot be healed from within. One long slice is no sign of it: several checks
 * must find no progress. */
static void on_watchdog_timer(void *context)
{
    struct daemon *daemon = context;
    const struct engine_port *engine = &daemon->hub.options.engine;
    const uint64_t now_ns = clock_now_ns();
    if (engine->is_alive(engine->context, &daemon->engine_turns))
        daemon->alive_ns = now_ns;
    else if (now_ns - daemon->alive_ns >= daemon->watchdog_ns)
        channel_send(&daemon->front, CHANNEL_HANGS, NULL, 0, NULL);
    loop_timer_start(daemon->loop, &daemon->watchdog_timer, daemon->watchdog_ns / WATCHDOG_CHECKS);
}

static void on_received(void *context, enum channel_kind kind, const void *payload, size_t bytes,
                        const int fds[CHANNEL_FDS])
{
    struct daemon *daemon = context;
    struct channel_owner owner;
    switch (kind) {
    case CHANNEL_CONFIG:
        daemon->configured(daemon->front_context, payload, bytes);
        if (daemon->unused_timer.running)
            start_unused_timer(daemon); /* scenes may linger for longer now */
        channel_send(&daemon->front, CHANNEL_CONFIG, NULL, 0, NULL);
        return;
    case CHANNEL_CLIENT:
        take_client(daemon, payload, bytes, fds);
        return;
    case CHANNEL_OWNER:
        if (bytes == sizeof(owner)) {
            memcpy(&owner, payload, bytes);
            take_owner(daemon, &owner);
        }
        return;
    case CHANNEL_ASK:
    case CHANNEL_ASKED:
    case CHANNEL_ANSWER:
        others_received(daemon->hub.others, kind, payload, bytes);
        return;
    case CHANNEL_PING:
        channel_send(&daemon->front, CHANNEL_PING, NULL, 0, NULL);
        return;
    case CHANNEL_START:
    case CHANNEL_READY:
    case CHANNEL_ENDING:
    case CHANNEL_FAILED:
    case CHANNEL_HANGS:
    case CHANNEL_COUNTS:
        return;
    }
}

/* Ends without goodbye, since the front was killed or has crashed: clients must see just that. */
static void on_front_gone(void *context)
{
    struct daemon *daemon = context;
    loop_stop(daemon->loop);
}

bool daemon_serve_front(struct daemon *daemon, int fd, const struct channel_owner *owner, struct error *error)
{
    daemon->front = (struct channel){.received = on_received, .closed = on_front_gone, .context = daemon};
    daemon->hub.counted = on_counted;
    if (!channel_open(&daemon->front, daemon->loop, fd, error))
        return false;
    others_reach(daemon->hub.others, &daemon->front);
    daemon->alive_ns = clock_now_ns();
    if (daemon->watchdog_ns)
        on_watchdog_timer(daemon);
    if (owner)
        take_owner(daemon, owner);
    else
        send_ready(daemon, false);
    return true;
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
    daemon->stop_timer = (struct loop_timer){.call = on_stop_timer, .context = daemon};
    daemon->unused_timer = (struct loop_timer){.call = on_unused_timer, .context = daemon};
    daemon->watchdog_timer = (struct loop_timer){.call = on_watchdog_timer, .context = daemon};
    return watch_signals(daemon, error);
}

bool daemon_serve_fd(struct daemon *daemon, int fd, struct error *error)
{
    struct handover handover = {.is_owner = true};
    return listen_take_connected(fd, &handover.peer, error) &&
           auth_identify(&handover.identity, fd, &handover.peer, true, error) &&
           hub_add_client(&daemon->hub, fd, &handover, error);
}

bool daemon_run(struct daemon *daemon, bool *device_gone, struct error *error)
{
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
    if (daemon->loop) {
        daemon->hub.counted = NULL;
        close_sessions(daemon);
        channel_close(&daemon->front);
        loop_watch_remove(daemon->signal_watch);
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
