/* SPDX-License-Identifier: MIT */
#include "front/front.h"

#include "base/clock.h"
#include "base/log.h"
#include "base/log_rate.h"
#include "front/callers.h"
#include "front/workers.h"
#include "net/activation.h"
#include "net/greeting.h"
#include "net/notify.h"

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/signalfd.h>
#include <unistd.h>

/* Maximum of clients accepted at once, so that the first can finish their handshake before the next are counted.
 */
#define ACCEPTS_A_TURN 4
/* Pause when descriptors have run out: a listener stays readable then, so it is not watched for this long. */
#define ACCEPT_PAUSE_NS UINT64_C(100000000)
/* Time in which workers may say goodbye to their clients and end. */
#define STOP_NS UINT64_C(600000000)
#define BLANKS " \t"
/* Time between two pings of a worker. */
#define PING_NS UINT64_C(10000000000)
/* Time between two notices to the service manager that the start continues. */
#define EXTEND_NS UINT64_C(5000000000)
/* Notices within the service manager's timeout. */
#define WATCHDOG_CHECKS 4

void front_init(struct front *front)
{
    *front = (struct front){.signal_fd = -1};
}

/* ---- addresses --------------------------------------------------------------------------------------- */

static bool listen_at(struct front *front, const char *text, bool beyond_loopback, struct error *error)
{
    struct address address;
    if (front->listener_count == FRONT_LISTENERS_MAX)
        return error_set(error, ERROR_LIMIT, text, "at most %d addresses", FRONT_LISTENERS_MAX);
    if (!address_parse(&address, text, error) ||
        !listener_open(&front->listeners[front->listener_count], &address, beyond_loopback, error))
        return false;
    front->listener_count++;
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

bool front_listen(struct front *front, const char *addresses, bool beyond_loopback, struct error *error)
{
    char *copy = strdup(addresses), *rest = copy;
    bool ok = copy || error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    for (char *address; ok && (address = next_address(&rest));)
        ok = listen_at(front, address, beyond_loopback, error);
    free(copy);
    return ok && (front->listener_count || error_set(error, ERROR_INVALID, "server.listen", "no address"));
}

bool front_listen_activated(struct front *front, bool beyond_loopback, size_t *count, struct error *error)
{
    char names[FRONT_LISTENERS_MAX][ACTIVATION_NAME_BYTES];
    for (size_t i = 0; i < FRONT_LISTENERS_MAX; i++)
        activation_name(i, names[i]);
    *count = activation_take();
    if (*count > FRONT_LISTENERS_MAX)
        return error_set(error, ERROR_LIMIT, "LISTEN_FDS", "at most %d sockets", FRONT_LISTENERS_MAX);
    for (size_t i = 0; i < *count; i++) {
        if (!listener_adopt(&front->listeners[i], ACTIVATION_FD_FIRST + (int)i, names[i], beyond_loopback, error))
            return false;
        front->listener_count++;
    }
    return true;
}

/* ---- clients ----------------------------------------------------------------------------------------- */

static void watch_listeners(struct front *front, bool watched)
{
    for (size_t i = 0; i < front->listener_count; i++) {
        if (front->listener_watches[i])
            loop_watch_change(front->listener_watches[i], watched ? (uint32_t)EPOLLIN : 0);
    }
}

static void on_accept_timer(void *context)
{
    watch_listeners(context, true);
}

static void pause_accepting(struct front *front)
{
    watch_listeners(front, false);
    loop_timer_start(front->loop, &front->accept_timer, ACCEPT_PAUSE_NS);
}

static bool accept_one(struct front *front, const struct listener *listener)
{
    struct address peer;
    bool retry_later;
    int fd = listener_accept(listener, &peer, &retry_later);
    if (retry_later)
        pause_accepting(front);
    if (fd < 0)
        return false;
    struct error error = {0};
    if (callers_add(front, fd, &listener->address, &peer, &error))
        return true;
    if (log_is_due(address_network(&peer), "turned away"))
        log_write(LOG_WARNING, "front", "a client is turned away: %s", error.text);
    greeting_turn_away(fd, error.text, error.kind == ERROR_DENIED ? 0 : HANDSHAKE_TRY_AGAIN);
    close(fd);
    return true;
}

static void accept_from(struct front *front, const struct listener *listener)
{
    for (int i = 0; i < ACCEPTS_A_TURN && accept_one(front, listener); i++)
        continue;
}

static void on_listeners(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct front *front = context;
    for (size_t i = 0; i < front->listener_count; i++)
        accept_from(front, &front->listeners[i]);
}

/* ---- the end ----------------------------------------------------------------------------------------- */

static void close_listeners(struct front *front)
{
    for (size_t i = 0; i < front->listener_count; i++) {
        loop_watch_remove(front->listener_watches[i]);
        listener_close(&front->listeners[i]);
    }
    front->listener_count = 0;
}

void front_stop(struct front *front)
{
    if (front->stopping)
        return;
    front->stopping = true;
    notify_manager("STOPPING=1");
    close_listeners(front);
    loop_timer_start(front->loop, &front->stop_timer, STOP_NS);
    workers_stop(front);
    if (!front->workers)
        loop_stop(front->loop);
}

static void on_stop_timer(void *context)
{
    log_write(LOG_WARNING, "front", "workers that have not ended are killed");
    workers_kill(context);
}

/* systemd's notify-reload requires the time, to distinguish this answer from one to an earlier signal. */
static void reload(struct front *front)
{
    char state[64];
    snprintf(state, sizeof(state), "RELOADING=1\nMONOTONIC_USEC=%" PRIu64, clock_now_ns() / 1000);
    notify_manager(state);
    front->reload(front->reload_context);
    if (!front->reloading)
        notify_manager("READY=1"); /* nothing has changed */
}

static void on_signal(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct front *front = context;
    struct signalfd_siginfo info;
    if (read(front->signal_fd, &info, sizeof(info)) != (ssize_t)sizeof(info))
        return;
    if (info.ssi_signo == SIGHUP) {
        if (!front->stopping)
            reload(front);
        return;
    }
    log_write(LOG_INFO, "front", "stopping: %s", info.ssi_signo == SIGTERM ? "SIGTERM" : "SIGINT");
    if (front->stopping)
        workers_kill(front); /* second signal: no goodbye */
    front_stop(front);
}

static void on_unused_timer(void *context)
{
    struct front *front = context;
    if (front->stopping || workers_clients(front))
        return;
    log_write(LOG_INFO, "front", "stopping: there was no client for %" PRIu64 " s",
              front->options.unused_ns / UINT64_C(1000000000));
    front_stop(front);
}

static void on_watchdog_timer(void *context)
{
    struct front *front = context;
    notify_manager("WATCHDOG=1");
    loop_timer_start(front->loop, &front->watchdog_timer, front->watchdog_ns / WATCHDOG_CHECKS);
}

static void on_ping_timer(void *context)
{
    struct front *front = context;
    workers_ping(front);
    loop_timer_start(front->loop, &front->ping_timer, PING_NS);
}

static void on_extend_timer(void *context)
{
    struct front *front = context;
    notify_manager("EXTEND_TIMEOUT_USEC=30000000");
    loop_timer_start(front->loop, &front->extend_timer, EXTEND_NS);
}

/* ---- events of workers -------------------------------------------------------------------------------- */

void front_configured(struct front *front)
{
    if (!front->reloading || !workers_have_setup(front))
        return;
    front->reloading = false;
    log_write(LOG_INFO, "config", "the configuration was read again");
    notify_manager("READY=1");
}

void front_counted(struct front *front)
{
    if (workers_clients(front))
        loop_timer_stop(front->loop, &front->unused_timer);
    else if (front->options.unused_ns && !front->unused_timer.running)
        loop_timer_start(front->loop, &front->unused_timer, front->options.unused_ns);
}

static void print_ready(const struct front *front)
{
    for (size_t i = 0; i < front->listener_count; i++) {
        char text[ADDRESS_TEXT_BYTES];
        address_print(&front->listeners[i].address, text);
        fprintf(front->ready_stream, "READY %s\n", text);
    }
    fflush(front->ready_stream);
    notify_manager("READY=1");
}

/* The start is over when every first worker is ready or gone; one that is ready suffices. */
void front_settled(struct front *front, const struct error *failure)
{
    if (failure)
        front->failure = *failure;
    if (front->ready)
        return;
    for (const struct worker *worker = front->workers; worker; worker = worker->next) {
        if (!worker->is_ready)
            return;
    }
    front->ready = front->workers != NULL;
    if (front->ready && !front->stopping)
        print_ready(front); /* before a client is served: it may ask where else the daemon listens */
    loop_stop(front->loop);
}

/* ---- life -------------------------------------------------------------------------------------------- */

static bool set_options(struct front *front, const struct front_options *options)
{
    void *setup = malloc(options->setup_bytes);
    if (!setup)
        return false;
    memcpy(setup, options->setup, options->setup_bytes);
    auth_keys_ref(options->keys);
    auth_keys_unref(front->options.keys);
    free(front->setup);
    front->options = *options;
    front->setup = setup;
    return true;
}

bool front_reload(struct front *front, const struct front_options *options, struct error *error)
{
    if (!set_options(front, options))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    front->reloading = true;
    workers_send_setup(front);
    front_configured(front);
    front_counted(front);
    return true;
}

static bool watch_signals(struct front *front, struct error *error)
{
    sigset_t set;
    sigemptyset(&set);
    sigaddset(&set, SIGTERM);
    sigaddset(&set, SIGINT);
    sigaddset(&set, SIGHUP);
    sigprocmask(SIG_BLOCK, &set, NULL);
    signal(SIGPIPE, SIG_IGN);
    front->signal_fd = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
    if (front->signal_fd < 0)
        return error_set(error, ERROR_INTERNAL, NULL, "signalfd: %s", strerror(errno));
    front->signal_watch = loop_watch_add(front->loop, front->signal_fd, EPOLLIN, on_signal, front, error);
    return front->signal_watch != NULL;
}

static bool watch_all_listeners(struct front *front, struct error *error)
{
    for (size_t i = 0; i < front->listener_count; i++) {
        front->listener_watches[i] =
            loop_watch_add(front->loop, front->listeners[i].fd, EPOLLIN, on_listeners, front, error);
        if (!front->listener_watches[i])
            return false;
    }
    return true;
}

/* Starts the workers of owners with kept scenes; without any, a worker without an owner, so that
 * the device is tried and the first user need not wait. */
static bool start_workers(struct front *front, struct error *error)
{
    const struct front_options *options = &front->options;
    for (size_t i = 0; i < options->owner_count; i++) {
        const struct channel_owner owner = {.number = options->owners[i], .name = "restores scenes"};
        if (!workers_start(front, &owner, error))
            return false;
    }
    if (options->owner_count)
        on_extend_timer(front);
    return options->owner_count || workers_start_ahead(front, error);
}

static bool start(struct front *front, const struct front_options *options, struct error *error)
{
    front->loop = loop_create(error);
    if (!front->loop)
        return false;
    front->accept_timer = (struct loop_timer){.call = on_accept_timer, .context = front};
    front->stop_timer = (struct loop_timer){.call = on_stop_timer, .context = front};
    front->unused_timer = (struct loop_timer){.call = on_unused_timer, .context = front};
    front->watchdog_timer = (struct loop_timer){.call = on_watchdog_timer, .context = front};
    front->ping_timer = (struct loop_timer){.call = on_ping_timer, .context = front};
    front->extend_timer = (struct loop_timer){.call = on_extend_timer, .context = front};
    if (!set_options(front, options))
        return error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory");
    share_groups_begin(&front->groups, "/proc/self/cgroup", "/sys/fs/cgroup");
    return watch_signals(front, error) && watch_all_listeners(front, error) && start_workers(front, error) &&
           (options->owner_fd < 0 || callers_add_owner(front, options->owner_fd, error));
}

bool front_run(struct front *front, const struct front_options *options, FILE *stream, struct error *error)
{
    front->ready_stream = stream;
    /* This first run of the loop ends when the first workers are ready, or have failed. */
    if (!start(front, options, error) || !loop_run(front->loop, error))
        return false;
    if (!front->ready && !front->stopping) {
        *error = front->failure;
        return false;
    }
    loop_timer_stop(front->loop, &front->extend_timer);
    if (front->stopping)
        return true;
    front_counted(front);
    on_ping_timer(front);
    front->watchdog_ns = notify_watchdog_ns();
    if (front->watchdog_ns)
        on_watchdog_timer(front);
    return loop_run(front->loop, error);
}

void front_finish(struct front *front)
{
    close_listeners(front);
    if (front->loop) {
        callers_close(front);
        workers_finish(front);
        hashmap_finish(&front->sources);
        loop_watch_remove(front->signal_watch);
        loop_timer_stop(front->loop, &front->accept_timer);
        loop_timer_stop(front->loop, &front->extend_timer);
        loop_timer_stop(front->loop, &front->ping_timer);
        loop_timer_stop(front->loop, &front->stop_timer);
        loop_timer_stop(front->loop, &front->unused_timer);
        loop_timer_stop(front->loop, &front->watchdog_timer);
        loop_destroy(front->loop);
    }
    if (front->signal_fd >= 0)
        close(front->signal_fd);
    auth_keys_unref(front->options.keys);
    free(front->setup);
    front_init(front);
}
