/* SPDX-License-Identifier: MIT */
#include "lib/shaper.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <fcntl.h>
#include <poll.h>
#include <pthread.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <sys/socket.h>
#include <time.h>
#include <unistd.h>

/* Bytes in the kernel's buffers are before or behind the link: as few as the daemon has in its own
 * (TCP_NOTSENT_LOWAT there). */
#define BUFFER_BYTES (32 << 10)
#define SECOND_NS UINT64_C(1000000000)
#define LINGER_NS SECOND_NS

struct packet {
    uint64_t due_ns; /* at the other end */
    size_t start, end;
    uint8_t bytes[FL_LINK_PACKET_BYTES];
};

/* One direction. */
struct way {
    int from, to;
    bool ended;      /* nothing more comes in */
    bool closed;     /* likewise, and all has gone out */
    bool is_blocked; /* the receiver takes no more for now */
    uint64_t free_ns;
    uint64_t first, last;   /* on the way: [first, last), modulo the number of packets */
    struct packet *packets; /* owned */
};

struct fl_shaper {
    struct fl_link link;
    size_t packets; /* each way */
    pthread_t thread;
    uint64_t reset_ns;   /* UINT64_MAX: never */
    struct way up, down; /* to the peer, and from it */
};

/* Packets that have arrived. A receiver that is gone takes all. */
static void give(struct fl_shaper *shaper, struct way *way, uint64_t now_ns)
{
    way->is_blocked = false;
    while (way->first < way->last) {
        struct packet *packet = &way->packets[way->first % shaper->packets];
        if (packet->due_ns > now_ns)
            return;
        const ssize_t sent =
            send(way->to, packet->bytes + packet->start, packet->end - packet->start, MSG_NOSIGNAL);
        if (sent < 0 && errno == EINTR)
            continue;
        if (sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            way->is_blocked = true;
            return;
        }
        packet->start = sent < 0 ? packet->end : packet->start + (size_t)sent;
        way->first += packet->start == packet->end;
    }
    if (way->ended && !way->closed) {
        way->closed = true;
        shutdown(way->to, SHUT_WR);
    }
}

static bool has_space(const struct fl_shaper *shaper, const struct way *way, uint64_t now_ns)
{
    return !way->ended && way->last - way->first < shaper->packets && fl_link_opens_ns(way->free_ns) <= now_ns;
}

static void take(struct fl_shaper *shaper, struct way *way, uint64_t now_ns)
{
    while (has_space(shaper, way, now_ns)) {
        struct packet *packet = &way->packets[way->last % shaper->packets];
        const ssize_t got = recv(way->from, packet->bytes, sizeof(packet->bytes), 0);
        if (got > 0) {
            packet->start = 0;
            packet->end = (size_t)got;
            packet->due_ns = fl_link_enter(&shaper->link, &way->free_ns, packet->end, now_ns);
            way->last++;
        } else if (got < 0 && errno == EINTR) {
            continue;
        } else if (got < 0 && (errno == EAGAIN || errno == EWOULDBLOCK)) {
            return;
        } else {
            way->ended = true;
        }
    }
}

static uint64_t earlier(uint64_t a, uint64_t b)
{
    return a < b ? a : b;
}

/* Says what to wait for; returns until when at most. Descriptors for which nothing is to be waited are left out:
 * one that has hung up would cause a busy loop. */
static uint64_t watch(const struct fl_shaper *shaper, const struct way *way, struct pollfd polled[2],
                      uint64_t now_ns)
{
    const bool has_room = has_space(shaper, way, now_ns);
    uint64_t until_ns = UINT64_MAX;
    polled[0] = (struct pollfd){.fd = has_room ? way->from : -1, .events = POLLIN};
    polled[1] = (struct pollfd){.fd = way->is_blocked ? way->to : -1, .events = POLLOUT};
    if (!way->ended && fl_link_opens_ns(way->free_ns) > now_ns)
        until_ns = fl_link_opens_ns(way->free_ns);
    if (way->first < way->last && !way->is_blocked)
        until_ns = earlier(until_ns, way->packets[way->first % shaper->packets].due_ns);
    return until_ns;
}

static void wait_until(struct pollfd polled[4], uint64_t until_ns)
{
    const uint64_t now_ns = monotonic_now_ns(), left_ns = until_ns > now_ns ? until_ns - now_ns : 0;
    const struct timespec left = {.tv_sec = (time_t)(left_ns / SECOND_NS), .tv_nsec = (long)(left_ns % SECOND_NS)};
    ppoll(polled, 4, until_ns < UINT64_MAX ? &left : NULL, NULL);
}

/* The near end is closed as a whole: once that has arrived at the peer, nothing is left to do. */
static bool carry(struct fl_shaper *shaper)
{
    uint64_t linger_ns = UINT64_MAX;
    for (;;) {
        struct pollfd polled[4];
        const uint64_t now_ns = monotonic_now_ns();
        if (now_ns >= shaper->reset_ns)
            return false;
        take(shaper, &shaper->up, now_ns);
        take(shaper, &shaper->down, now_ns);
        give(shaper, &shaper->up, now_ns);
        give(shaper, &shaper->down, now_ns);
        if (shaper->up.ended && linger_ns == UINT64_MAX)
            linger_ns = now_ns + shaper->link.round_trip_ns / 2 + LINGER_NS;
        if (shaper->up.closed || now_ns >= linger_ns)
            return true;
        const uint64_t until_ns =
            earlier(watch(shaper, &shaper->up, polled, now_ns), watch(shaper, &shaper->down, polled + 2, now_ns));
        wait_until(polled, earlier(earlier(until_ns, linger_ns), shaper->reset_ns));
    }
}

static void *run(void *argument)
{
    struct fl_shaper *shaper = argument;
    if (!carry(shaper)) /* TCP says a reset in this way; a Unix socket just ends */
        setsockopt(shaper->up.to, SOL_SOCKET, SO_LINGER, &(struct linger){.l_onoff = 1}, sizeof(struct linger));
    close(shaper->up.to);
    close(shaper->up.from);
    return NULL;
}

/* The caller's signals are for its own threads. */
static bool start_thread(struct fl_shaper *shaper)
{
    sigset_t all, before;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before);
    const int failure = pthread_create(&shaper->thread, NULL, run, shaper);
    pthread_sigmask(SIG_SETMASK, &before, NULL);
    return failure == 0;
}

static bool make_non_blocking(int fd)
{
    const int flags = fcntl(fd, F_GETFL);
    return flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) == 0;
}

static void limit_buffers(int near, int far)
{
    static const int bytes = BUFFER_BYTES;
    setsockopt(near, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
    setsockopt(far, SOL_SOCKET, SO_SNDBUF, &bytes, sizeof(bytes));
    setsockopt(far, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof(bytes)); /* of no effect on a Unix socket */
}

static void finish(struct fl_shaper *shaper)
{
    if (!shaper)
        return;
    free(shaper->up.packets);
    free(shaper->down.packets);
    free(shaper);
}

static struct fl_shaper *create(const struct fl_link *link)
{
    static atomic_uint_fast64_t count;
    struct fl_shaper *shaper = calloc(1, sizeof(*shaper));
    if (!shaper)
        return NULL;
    const uint64_t lasts_ns = fl_link_reset_ns(link, atomic_fetch_add(&count, 1)), now_ns = monotonic_now_ns();
    shaper->link = *link;
    shaper->reset_ns = lasts_ns < UINT64_MAX - now_ns ? now_ns + lasts_ns : UINT64_MAX;
    shaper->packets = fl_link_packets(link);
    shaper->up.packets = calloc(shaper->packets, sizeof(*shaper->up.packets));
    shaper->down.packets = calloc(shaper->packets, sizeof(*shaper->down.packets));
    if (shaper->up.packets && shaper->down.packets)
        return shaper;
    finish(shaper);
    return NULL;
}

struct fl_shaper *fl_shaper_start(const struct fl_link *link, int *fd, struct fl_error *error)
{
    struct fl_shaper *shaper = create(link);
    int ends[2] = {-1, -1}; /* the caller's, ours */
    if (shaper && socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) == 0) {
        shaper->up.from = shaper->down.to = ends[1];
        shaper->up.to = shaper->down.from = *fd;
        limit_buffers(ends[0], *fd);
        if (make_non_blocking(ends[1]) && make_non_blocking(*fd) && start_thread(shaper)) {
            *fd = ends[0];
            return shaper;
        }
        close(ends[0]);
        close(ends[1]);
    }
    fl_error_set(error, FL_ERROR_SYSTEM, "", "cannot shape the connection: out of memory, descriptors or threads");
    finish(shaper);
    close(*fd);
    *fd = -1;
    return NULL;
}

void fl_shaper_destroy(struct fl_shaper *shaper)
{
    if (!shaper)
        return;
    pthread_join(shaper->thread, NULL);
    finish(shaper);
}
