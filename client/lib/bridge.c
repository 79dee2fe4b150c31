/* SPDX-License-Identifier: MIT */
/* Copies bytes between two descriptors and a daemon's socket: the far end of an ssh connection. */
#include "lib/address.h"
#include "lib/connection.h"
#include "protocol/common/clock.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <unistd.h>

#define BUFFER_BYTES 262144u
#define CONNECT_NS 30000000000ull

/* A direction of the bridge. Its descriptors may block, so they are used only after poll. */
struct direction {
    int from, to;
    bool to_is_socket;
    bool source_ended, closed;
    size_t start, end;
    uint8_t data[BUFFER_BYTES];
};

static bool failed(int number, struct fl_error *error)
{
    return number == EAGAIN || number == EINTR ||
           fl_error_set(error, FL_ERROR_CONNECTION, "", "the bridge broke: %s", strerror(number));
}

static bool fill(struct direction *way, short revents, struct fl_error *error)
{
    if (revents == 0 || way->source_ended || way->end > way->start)
        return true;
    const ssize_t got = read(way->from, way->data, sizeof(way->data));
    if (got < 0)
        return failed(errno, error);
    way->source_ended = got == 0;
    way->start = 0;
    way->end = (size_t)got;
    return true;
}

static bool drain(struct direction *way, short revents, struct fl_error *error)
{
    if (revents != 0 && way->end > way->start) {
        const size_t left = way->end - way->start;
        /* A pipe accepts at least PIPE_BUF without blocking once poll reports it. */
        const ssize_t put = way->to_is_socket
                                ? send(way->to, way->data + way->start, left, MSG_NOSIGNAL | MSG_DONTWAIT)
                                : write(way->to, way->data + way->start, left < 4096 ? left : 4096);
        if (put < 0)
            return failed(errno, error);
        way->start += (size_t)put;
    }
    if (way->source_ended && way->start == way->end && !way->closed) {
        way->closed = true;
        if (way->to_is_socket)
            shutdown(way->to, SHUT_WR);
    }
    return true;
}

static bool carry(struct direction *up, struct direction *down, struct fl_error *error)
{
    struct direction *const ways[2] = {up, down};
    /* The daemon closes after the end of its input: `down` ends last. */
    while (!down->closed) {
        struct pollfd polled[4];
        for (unsigned i = 0; i < 2; i++) {
            const bool holds = ways[i]->end > ways[i]->start;
            polled[2 * i] =
                (struct pollfd){.fd = ways[i]->from, .events = holds || ways[i]->source_ended ? 0 : POLLIN};
            polled[2 * i + 1] = (struct pollfd){.fd = ways[i]->to, .events = holds ? POLLOUT : 0};
        }
        if (!fl_wait(polled, 4, 0, UINT64_MAX, error))
            return false;
        for (unsigned i = 0; i < 2; i++)
            if (!fill(ways[i], polled[2 * i].revents, error) || !drain(ways[i], polled[2 * i + 1].revents, error))
                return false;
    }
    return true;
}

bool fl_bridge(const char *address, int in_fd, int out_fd, struct fl_error *error)
{
    bool local = false;
    const int fd = fl_address_connect(address, monotonic_now_ns() + CONNECT_NS, 0, &local, error);
    if (fd < 0)
        return false;
    struct direction *ways = calloc(2, sizeof(*ways));
    bool carried = false;
    if (!ways) {
        fl_error_set(error, FL_ERROR_MEMORY, "", "out of memory");
    } else {
        ways[0].from = in_fd;
        ways[0].to = fd;
        ways[0].to_is_socket = true;
        ways[1].from = fd;
        ways[1].to = out_fd;
        carried = carry(&ways[0], &ways[1], error);
    }
    free(ways);
    close(fd);
    return carried;
}
