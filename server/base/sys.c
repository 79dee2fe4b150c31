/* SPDX-License-Identifier: MIT */
/* Table of system calls. */
#include "base/sys.h"

#include <errno.h>
#include <unistd.h>

/* glibc declares the address arguments as transparent unions, which fit no plain function pointer. */
static int call_accept4(int fd, struct sockaddr *address, socklen_t *address_bytes, int flags)
{
    return accept4(fd, address, address_bytes, flags);
}

static int call_connect(int fd, const struct sockaddr *address, socklen_t address_bytes)
{
    return connect(fd, address, address_bytes);
}

static int call_bind(int fd, const struct sockaddr *address, socklen_t address_bytes)
{
    return bind(fd, address, address_bytes);
}

struct sys_calls sys = {
    .read = read,
    .sendmsg = sendmsg,
    .accept4 = call_accept4,
    .socket = socket,
    .connect = call_connect,
    .bind = call_bind,
    .listen = listen,
    .epoll_wait = epoll_wait,
};

ssize_t sys_read(int fd, void *data, size_t bytes)
{
    ssize_t got;
    do
        got = sys.read(fd, data, bytes);
    while (got < 0 && errno == EINTR);
    return got;
}

ssize_t sys_sendmsg(int fd, const struct msghdr *message, int flags)
{
    ssize_t sent;
    do
        sent = sys.sendmsg(fd, message, flags);
    while (sent < 0 && errno == EINTR);
    return sent;
}

int sys_accept(int fd, struct sockaddr *address, socklen_t *address_bytes, int flags)
{
    int accepted;
    do
        accepted = sys.accept4(fd, address, address_bytes, flags);
    while (accepted < 0 && errno == EINTR);
    return accepted;
}
