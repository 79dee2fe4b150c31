/* SPDX-License-Identifier: MIT */
/* System calls of the network side in one table, so that a test can shorten, interrupt and fail each.
 * Production code never writes it. */
#ifndef FARLIGHT_BASE_SYS_H
#define FARLIGHT_BASE_SYS_H

#include <sys/epoll.h>
#include <sys/socket.h>
#include <sys/types.h>

struct sys_calls {
    ssize_t (*read)(int fd, void *data, size_t bytes);
    ssize_t (*sendmsg)(int fd, const struct msghdr *message, int flags);
    int (*accept4)(int fd, struct sockaddr *address, socklen_t *address_bytes, int flags);
    int (*socket)(int domain, int type, int protocol);
    int (*connect)(int fd, const struct sockaddr *address, socklen_t address_bytes);
    int (*bind)(int fd, const struct sockaddr *address, socklen_t address_bytes);
    int (*listen)(int fd, int backlog);
    int (*epoll_wait)(int fd, struct epoll_event *events, int max_events, int timeout_ms);
};
extern struct sys_calls sys;

/* System calls that are repeated when a signal interrupts them. */
ssize_t sys_read(int fd, void *data, size_t bytes);
ssize_t sys_sendmsg(int fd, const struct msghdr *message, int flags);
int sys_accept(int fd, struct sockaddr *address, socklen_t *address_bytes, int flags);

#endif
