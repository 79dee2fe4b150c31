/* SPDX-License-Identifier: MIT */
#include "front/workers.h"

#include "base/log.h"
#include "front/callers.h"
#include "net/handover.h"

#include <errno.h>
#include <inttypes.h>
#include <signal.h>
#include <spawn.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

/* Maximum of processes: an attacker may connect from many networks, each of which has a worker. */
#define WORKERS_MAX 128u
/* Blanks behind a worker's number, which the worker overwrites with its owner for lists of processes. */
#define TITLE_BYTES 128
/* Pings without an answer after which a worker counts as hanging. */
#define PINGS_MAX 3u

/* ---- starting ---- */

/* Whether a variable concerns the front alone, which is the service manager's only partner. */
static bool is_for_front(const char *variable)
{
    static const char *const names[] = {"NOTIFY_SOCKET=", "WATCHDOG_USEC=", "WATCHDOG_PID=", "LISTEN_"};
    for (size_t i = 0; i < sizeof(names) / sizeof(names[0]); i++) {
        if (strncmp(variable, names[i], strlen(names[i])) == 0)
            return true;
    }
    return false;
}

static char **worker_environment(void)
{
    size_t count = 0, kept = 0;
    while (environ[count])
        count++;
    char **variables = calloc(count + 1, sizeof(*variables));
    for (size_t i = 0; variables && i < count; i++) {
        if (!is_for_front(environ[i]))
            variables[kept++] = environ[i];
    }
    return variables;
}

static bool spawn(struct worker *worker, int fd, struct error *error)
{
    char number[TITLE_BYTES];
    snprintf(number, sizeof(number), "%-*" PRIu32, TITLE_BYTES - 1, worker->number);
    char *const arguments[] = {"farlightd", "--worker", number, NULL};
    char **variables = worker_environment();
    posix_spawn_file_actions_t actions;
    posix_spawnattr_t attributes;
    posix_spawn_file_actions_init(&actions);
    posix_spawnattr_init(&attributes);
    /* A session of its own: the kernel shares processors between sessions (sched_autogroup), and a terminal's
     * signals are the front's alone. */
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSID);
    int why = variables ? posix_spawn_file_actions_adddup2(&actions, fd, CHANNEL_WORKER_FD) : ENOMEM;
    if (why == 0)
        why = posix_spawn(&worker->pid, "/proc/self/exe", &actions, &attributes, arguments, variables);
    posix_spawnattr_destroy(&attributes);
    posix_spawn_file_actions_destroy(&actions);
    free(variables);
    return why == 0 || error_set(error, ERROR_INTERNAL, NULL, "cannot start a worker: %s", strerror(why));
}

/* ---- its end ---- */

static void log_end(const struct worker *worker, int status, bool is_asked)
{
    if (worker->failure.kind && !worker->front->ready)
        return; /* the front says why it does not start */
    if (worker->failure.kind) {
        log_write(LOG_ERROR, "front", "worker %" PRIu32 " (%s) has ended: %s", worker->number, worker->owner.name,
                  worker->failure.text);
        return;
    }
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0)
        log_write(LOG_DEBUG, "front", "worker %" PRIu32 " (%s) has ended", worker->number, worker->owner.name);
    else if (WIFSIGNALED(status))
        log_write(is_asked ? LOG_WARNING : LOG_ERROR, "front", "worker %" PRIu32 " (%s) was ended by signal %d",
                  worker->number, worker->owner.name, WTERMSIG(status));
    else
        log_write(LOG_ERROR, "front", "worker %" PRIu32 " (%s) has ended with status %d", worker->number,
                  worker->owner.name, WEXITSTATUS(status));
}

static void remove_worker(struct worker *worker)
{
    struct front *front = worker->front;
    share_groups_end(&front->groups, worker->number);
    struct worker **place = &front->workers;
    while (*place != worker)
        place = &(*place)->next;
    *place = worker->next;
    loop_watch_remove(worker->pid_watch);
    close(worker->pid_fd);
    channel_close(&worker->channel);
    free(worker);
}

static void replace(struct front *front)
{
    struct error error = {0};
    if (!workers_start_ahead(front, &error))
        log_write(LOG_ERROR, "front", "%s", error.text);
}

/* Ends a worker whose process has ended; its clients see their connections end, and reconnect. */
static void on_exit_of(void *context, uint32_t epoll_events)
{
    (void)epoll_events;
    struct worker *worker = context;
    struct front *front = worker->front;
    int status = 0;
    if (waitpid(worker->pid, &status, WNOHANG) != worker->pid)
        return;
    const bool is_asked = worker->is_stopping;
    worker->is_stopping = true;      /* no more clients are handed to it */
    channel_drain(&worker->channel); /* reads why it ended, if it said so */
    log_end(worker, status, is_asked);
    struct error failure = worker->failure;
    worker->is_ready = false;
    error_set(&failure, ERROR_INTERNAL, NULL, "the worker of this client has ended");
    callers_refuse(front, worker, failure.text);
    const bool ends_daemon = worker->has_daemon_owner;
    /* A successor keeps the device ready for the next user. */
    const bool is_replaced = worker->was_ready && front->workers == worker && !worker->next;
    remove_worker(worker);
    front_settled(front, &failure);
    front_counted(front);
    front_configured(front);
    if (ends_daemon)
        front_stop(front);
    if (front->stopping && !front->workers)
        loop_stop(front->loop);
    else if (is_replaced && !front->stopping)
        replace(front);
}

/* ---- its packets ---- */

static void close_fds(const int fds[CHANNEL_FDS])
{
    for (int i = 0; i < CHANNEL_FDS; i++) {
        if (fds[i] >= 0)
            close(fds[i]);
    }
}

static void stop_one(struct worker *worker)
{
    worker->is_stopping = true;
    kill(worker->pid, SIGTERM);
}

/* Notes that a worker is ready; a packet from before it had its owner is outdated. */
static void take_ready(struct worker *worker, const void *payload, size_t bytes)
{
    struct channel_ready ready;
    if (bytes != sizeof(ready))
        return;
    memcpy(&ready, payload, bytes);
    worker->device = ready.device;
    if (ready.has_owner != worker->has_owner || worker->is_stopping)
        return;
    worker->is_ready = worker->was_ready = true;
    front_settled(worker->front, NULL);
    callers_hand_over(worker->front, worker);
}

static void kill_one(const struct worker *worker, const char *why)
{
    log_write(LOG_ERROR, "front", "worker %" PRIu32 " (%s) is killed: %s", worker->number, worker->owner.name,
              why);
    kill(worker->pid, SIGKILL);
}

static void take_counts(struct worker *worker, const void *payload, size_t bytes)
{
    if (bytes != sizeof(worker->counts))
        return;
    memcpy(&worker->counts, payload, bytes);
    front_counted(worker->front);
    /* The worker may not know of a client that was just handed over. */
    if (worker->counts.unused_s && worker->counts.handed == worker->handed && !worker->is_stopping) {
        log_write(LOG_INFO, "front", "worker %" PRIu32 " (%s) ends: it had no client for %" PRIu32 " s",
                  worker->number, worker->owner.name, worker->counts.unused_s);
        stop_one(worker);
    }
}

static struct worker *find(const struct front *front, uint32_t number)
{
    struct worker *worker = front->workers;
    while (worker && worker->number != number)
        worker = worker->next;
    return worker;
}

static void forward_question(struct worker *asker, const void *payload, size_t bytes)
{
    struct channel_question question;
    if (bytes != sizeof(question))
        return;
    memcpy(&question, payload, bytes);
    question.asker = asker->number;
    struct channel_asked asked = {.number = question.number};
    for (struct worker *other = asker->front->workers; other; other = other->next) {
        if (other != asker && other->is_ready && other->has_owner && !other->is_stopping)
            asked.count += channel_send(&other->channel, CHANNEL_ASK, &question, sizeof(question), NULL);
    }
    channel_send(&asker->channel, CHANNEL_ASKED, &asked, sizeof(asked), NULL);
}

static void forward_answer(const struct worker *worker, const void *payload, size_t bytes)
{
    struct channel_answer answer;
    uint8_t *packet = bytes >= sizeof(answer) ? malloc(bytes) : NULL;
    if (!packet)
        return;
    memcpy(packet, payload, bytes);
    memcpy(&answer, packet, sizeof(answer));
    answer.worker = worker->number;
    memcpy(packet, &answer, sizeof(answer));
    struct worker *asker = find(worker->front, answer.asker);
    if (asker)
        channel_send(&asker->channel, CHANNEL_ANSWER, packet, bytes, NULL);
    free(packet);
}

/* Whether a worker may hand the client over: it acts for its own user alone, whose rights are those that the front
 * knows. */
static bool may_hand_over(const struct worker *from, struct handover *handover)
{
    struct auth_identity *identity = &handover->identity;
    const struct front_options *options = &from->front->options;
    const struct auth_key_numbers keys = auth_keys_numbers(options->keys);
    handover->is_owner = false;
    if (identity->has_user && readers_have(&options->readers, identity->user))
        identity->read_only = true;
    return from->has_owner && auth_owner_number(identity, &handover->peer) == from->owner.number &&
           (!identity->has_key || auth_numbers_have(&keys, identity));
}

/* Forwards a client whose first request names a scene of another worker. If that worker has ended, the client sees
 * its connection end, and reconnects. */
static void forward_client(const struct worker *from, const void *payload, size_t bytes,
                           const int fds[CHANNEL_FDS])
{
    struct handover handover;
    struct worker *to = NULL;
    if (bytes == sizeof(handover)) {
        memcpy(&handover, payload, bytes);
        to = may_hand_over(from, &handover) ? find(from->front, handover.to_worker) : NULL;
    }
    if (to && to->is_ready && !to->is_stopping)
        to->handed += channel_send(&to->channel, CHANNEL_CLIENT, &handover, sizeof(handover), fds);
    else
        close_fds(fds);
}

static void on_received(void *context, enum channel_kind kind, const void *payload, size_t bytes,
                        const int fds[CHANNEL_FDS])
{
    struct worker *worker = context;
    if (kind == CHANNEL_CLIENT)
        forward_client(worker, payload, bytes, fds);
    else
        close_fds(fds); /* no worker has reason to send one */
    switch (kind) {
    case CHANNEL_READY:
        take_ready(worker, payload, bytes);
        return;
    case CHANNEL_PING:
        worker->pings_due = 0;
        return;
    case CHANNEL_HANGS:
        kill_one(worker, "its GPU does not answer");
        return;
    case CHANNEL_ENDING:
        worker->is_stopping = true;
        return;
    case CHANNEL_FAILED:
        if (bytes == sizeof(worker->failure))
            memcpy(&worker->failure, payload, bytes);
        return;
    case CHANNEL_COUNTS:
        take_counts(worker, payload, bytes);
        return;
    case CHANNEL_ASK:
        forward_question(worker, payload, bytes);
        return;
    case CHANNEL_ANSWER:
        forward_answer(worker, payload, bytes);
        return;
    case CHANNEL_CONFIG:
        worker->configs_due -= worker->configs_due > 0;
        front_configured(worker->front);
        return;
    case CHANNEL_CLIENT:
    case CHANNEL_START:
    case CHANNEL_OWNER:
    case CHANNEL_ASKED:
        return;
    }
}

static void on_closed(void *context)
{
    struct worker *worker = context;
    worker->is_ready = false; /* its exit is next */
}

/* ---- for the front ---- */

static void apply_share(const struct worker *worker)
{
    const struct front *front = worker->front;
    const uint32_t weight =
        worker->has_owner ? shares_weight(&front->options.shares, worker->owner.number) : SHARES_DEFAULT_WEIGHT;
    share_groups_apply(&front->groups, worker->number, worker->pid, weight);
}

/* Watches the worker's channel and process. False: everything is released. */
static bool watch(struct worker *worker, int fd, struct error *error)
{
    struct loop *loop = worker->front->loop;
    worker->channel =
        (struct channel){.received = on_received, .closed = on_closed, .context = worker, .watch = NULL};
    if (!channel_open(&worker->channel, loop, fd, error)) {
        close(fd);
        return false;
    }
    worker->pid_fd = (int)syscall(SYS_pidfd_open, worker->pid, 0);
    worker->pid_watch =
        worker->pid_fd < 0 ? NULL : loop_watch_add(loop, worker->pid_fd, EPOLLIN, on_exit_of, worker, error);
    if (worker->pid_watch)
        return true;
    error_set(error, ERROR_INTERNAL, NULL, "cannot watch a worker: %s", strerror(errno));
    if (worker->pid_fd >= 0)
        close(worker->pid_fd);
    channel_close(&worker->channel);
    return false;
}

static void send_start(struct worker *worker, const struct channel_owner *owner)
{
    const struct front *front = worker->front;
    struct channel_start start = {.has_owner = owner != NULL};
    if (owner)
        start.owner = *owner;
    for (const struct worker *other = front->workers; other; other = other->next) {
        if (other->device >= 0 && other->device < CHANNEL_DEVICES)
            start.workers_at[other->device]++;
    }
    channel_send(&worker->channel, CHANNEL_START, &start, sizeof(start), NULL);
    channel_send(&worker->channel, CHANNEL_CONFIG, front->setup, front->options.setup_bytes, NULL);
}

struct worker *workers_start(struct front *front, const struct channel_owner *owner, struct error *error)
{
    struct worker *worker = calloc(1, sizeof(*worker));
    int fds[2];
    if (!worker || !channel_pair(fds, error)) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "no memory for a worker");
        free(worker);
        return NULL;
    }
    *worker = (struct worker){.front = front,
                              .number = ++front->workers_started,
                              .has_owner = owner != NULL,
                              .owner = owner ? *owner : (struct channel_owner){.name = "of nobody yet"},
                              .device = -1};
    bool ok = spawn(worker, fds[1], error);
    close(fds[1]);
    if (!ok) {
        close(fds[0]);
    } else if (!watch(worker, fds[0], error)) {
        kill(worker->pid, SIGKILL);
        waitpid(worker->pid, NULL, 0);
        ok = false;
    }
    if (!ok) {
        free(worker);
        return NULL;
    }
    worker->next = front->workers;
    front->workers = worker;
    apply_share(worker);
    send_start(worker, owner);
    return worker;
}

struct worker *workers_start_ahead(struct front *front, struct error *error)
{
    const struct auth_identity own = {.has_user = true, .user = geteuid()};
    const struct channel_owner owner = {.number = auth_owner_number(&own, NULL), .name = "waits"};
    return workers_start(front, front->options.owners_first ? &owner : NULL, error);
}

static void assign(struct worker *worker, const struct channel_owner *owner)
{
    worker->has_owner = true;
    worker->is_ready = false; /* until it acknowledges its owner */
    worker->owner = *owner;
    apply_share(worker);
    channel_send(&worker->channel, CHANNEL_OWNER, owner, sizeof(*owner), NULL);
}

struct worker *workers_of(struct front *front, uint64_t owner, const char *name, struct error *error)
{
    struct worker *free_one = NULL;
    uint32_t count = 0;
    for (struct worker *worker = front->workers; worker; worker = worker->next) {
        count++;
        if (worker->is_stopping || !worker->channel.watch) /* an ending worker may take a while */
            continue;
        if (worker->has_owner && worker->owner.number == owner) {
            /* A worker that restored scenes knows its owner's number only. */
            snprintf(worker->owner.name, sizeof(worker->owner.name), "%s", name);
            return worker;
        }
        if (!worker->has_owner)
            free_one = worker;
    }
    if (!free_one && count >= WORKERS_MAX) {
        error_set(error, ERROR_LIMIT, NULL, "%u users are served, the limit; try again later", WORKERS_MAX);
        return NULL;
    }
    struct channel_owner taken = {.number = owner};
    snprintf(taken.name, sizeof(taken.name), "%s", name);
    if (!free_one)
        return workers_start(front, &taken, error);
    assign(free_one, &taken);
    return free_one;
}

static uint32_t clients_of(const struct worker *worker)
{
    return worker->counts.clients + (worker->handed - worker->counts.handed);
}

uint32_t workers_clients(const struct front *front)
{
    uint32_t clients = 0;
    for (const struct worker *worker = front->workers; worker; worker = worker->next)
        clients += clients_of(worker);
    return clients;
}

uint32_t workers_clients_of(const struct front *front, uint64_t owner)
{
    uint32_t clients = 0;
    for (const struct worker *worker = front->workers; worker; worker = worker->next)
        clients += worker->has_owner && worker->owner.number == owner ? clients_of(worker) : 0;
    return clients;
}

void workers_stop(struct front *front)
{
    for (struct worker *worker = front->workers; worker; worker = worker->next)
        stop_one(worker);
}

void workers_kill(struct front *front)
{
    for (struct worker *worker = front->workers; worker; worker = worker->next) {
        worker->is_stopping = true;
        kill(worker->pid, SIGKILL);
    }
}

void workers_ping(struct front *front)
{
    for (struct worker *worker = front->workers; worker; worker = worker->next) {
        if (!worker->is_ready || worker->is_stopping)
            worker->pings_due = 0; /* a worker may still restore scenes */
        else if (worker->pings_due++ < PINGS_MAX)
            channel_send(&worker->channel, CHANNEL_PING, NULL, 0, NULL);
        else
            kill_one(worker, "it does not answer");
    }
}

void workers_send_setup(struct front *front)
{
    for (struct worker *worker = front->workers; worker; worker = worker->next)
        worker->configs_due +=
            channel_send(&worker->channel, CHANNEL_CONFIG, front->setup, front->options.setup_bytes, NULL);
}

bool workers_have_setup(const struct front *front)
{
    const struct worker *worker = front->workers;
    while (worker && !worker->configs_due)
        worker = worker->next;
    return !worker;
}

void workers_finish(struct front *front)
{
    workers_kill(front);
    while (front->workers) {
        waitpid(front->workers->pid, NULL, 0);
        remove_worker(front->workers);
    }
}
