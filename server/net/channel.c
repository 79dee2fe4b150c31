/* SPDX-License-Identifier: MIT */
/* Packets with descriptors over a pair of sockets. */
#include "net/channel.h"

#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/epoll.h>
#include <sys/socket.h>
#include <unistd.h>

struct channel_packet {
    struct channel_packet *next;
    int fds[CHANNEL_FDS];
    size_t bytes;
    uint32_t kind;
    uint8_t payload[];
};

static void close_fds(const int fds[CHANNEL_FDS])
{
    for (int i = 0; i < CHANNEL_FDS; i++) {
        if (fds[i] >= 0)
            close(fds[i]);
    }
}

static void destroy_packet(struct channel_packet *packet)
{
    close_fds(packet->fds);
    free(packet);
}

/* ---- sending ---- */

/* Sends a packet. False with EAGAIN: not yet. */
static bool send_parts(int fd, uint32_t kind, const void *payload, size_t bytes, const int *fds)
{
    /* The const is cast away for struct iovec; sendmsg() does not write. */
    struct iovec parts[2] = {{&kind, sizeof(kind)}, {(void *)(uintptr_t)payload, bytes}};
    union {
        struct cmsghdr header;
        uint8_t bytes[CMSG_SPACE(CHANNEL_FDS * sizeof(int))];
    } control = {0};
    struct msghdr message = {.msg_iov = parts, .msg_iovlen = 2};
    if (fds) {
        message.msg_control = control.bytes;
        message.msg_controllen = sizeof(control.bytes);
        control.header = (struct cmsghdr){
            .cmsg_level = SOL_SOCKET, .cmsg_type = SCM_RIGHTS, .cmsg_len = CMSG_LEN(CHANNEL_FDS * sizeof(int))};
        memcpy(CMSG_DATA(&control.header), fds, CHANNEL_FDS * sizeof(int));
    }
    ssize_t sent;
    do
        sent = sendmsg(fd, &message, MSG_NOSIGNAL | MSG_DONTWAIT);
    while (sent < 0 && errno == EINTR);
    return sent >= 0;
}

static bool send_packet(int fd, const struct channel_packet *packet)
{
    return send_parts(fd, packet->kind, packet->payload, packet->bytes, packet->fds[0] >= 0 ? packet->fds : NULL);
}

void channel_say(int fd, enum channel_kind kind, const void *payload, size_t bytes, const int *fds)
{
    send_parts(fd, (uint32_t)kind, payload, bytes, fds);
}

static void end(struct channel *channel)
{
    channel_close(channel);
    channel->closed(channel->context);
}

/* Sends as much as the other end accepts. False: it is gone. */
static bool flush(struct channel *channel)
{
    while (channel->first && send_packet(channel->fd, channel->first)) {
        struct channel_packet *sent = channel->first;
        channel->first = sent->next;
        if (!channel->first)
            channel->end = &channel->first;
        destroy_packet(sent);
    }
    if (channel->first && errno != EAGAIN && errno != EWOULDBLOCK)
        return false;
    loop_watch_change(channel->watch, EPOLLIN | (channel->first ? (uint32_t)EPOLLOUT : 0));
    return true;
}

bool channel_send(struct channel *channel, enum channel_kind kind, const void *payload, size_t bytes,
                  const int *fds)
{
    struct channel_packet *packet = channel->watch ? malloc(sizeof(*packet) + bytes) : NULL;
    if (!packet) {
        if (fds)
            close_fds(fds);
        return false;
    }
    *packet = (struct channel_packet){.kind = kind, .bytes = bytes, .fds = {-1, -1}};
    if (fds)
        memcpy(packet->fds, fds, sizeof(packet->fds));
    if (bytes)
        memcpy(packet->payload, payload, bytes);
    *channel->end = packet;
    channel->end = &packet->next;
    flush(channel); /* the watch reports a failure too, outside of this call */
    return true;
}

/* ---- receiving ---- */

static ssize_t receive(int fd, int flags, uint32_t *kind, uint8_t *payload, int fds[CHANNEL_FDS])
{
    struct iovec parts[2] = {{kind, sizeof(*kind)}, {payload, CHANNEL_PAYLOAD_MAX_BYTES}};
    union {
        struct cmsghdr header;
        uint8_t bytes[CMSG_SPACE(CHANNEL_FDS * sizeof(int))];
    } control;
    struct msghdr message = {
        .msg_iov = parts, .msg_iovlen = 2, .msg_control = control.bytes, .msg_controllen = sizeof(control.bytes)};
    ssize_t got;
    do
        got = recvmsg(fd, &message, MSG_CMSG_CLOEXEC | flags);
    while (got < 0 && errno == EINTR);
    fds[0] = fds[1] = -1;
    const struct cmsghdr *header = got >= 0 ? CMSG_FIRSTHDR(&message) : NULL;
    if (header && header->cmsg_type == SCM_RIGHTS && header->cmsg_len == CMSG_LEN(CHANNEL_FDS * sizeof(int)))
        memcpy(fds, CMSG_DATA(header), CHANNEL_FDS * sizeof(int));
    return got;
}

static void on_ready(void *context, uint32_t epoll_events)
{
    struct channel *channel = context;
    if (epoll_events & EPOLLOUT && !flush(channel)) {
        end(channel);
        return;
    }
    if (!(epoll_events & (EPOLLIN | EPOLLHUP | EPOLLERR)))
        return;
    uint8_t *payload = malloc(CHANNEL_PAYLOAD_MAX_BYTES);
    uint32_t kind;
    int fds[CHANNEL_FDS];
    ssize_t got = payload ? receive(channel->fd, MSG_DONTWAIT, &kind, payload, fds) : -1;
    if (got >= (ssize_t)sizeof(kind))
        channel->received(channel->context, (enum channel_kind)kind, payload, (size_t)got - sizeof(kind), fds);
    else if (got >= 0 || (errno != EAGAIN && errno != EWOULDBLOCK))
        end(channel);
    free(payload);
}

void channel_drain(struct channel *channel)
{
    uint8_t *payload = malloc(CHANNEL_PAYLOAD_MAX_BYTES);
    uint32_t kind;
    int fds[CHANNEL_FDS];
    ssize_t got;
    while (payload && channel->watch &&
           (got = receive(channel->fd, MSG_DONTWAIT, &kind, payload, fds)) >= (ssize_t)sizeof(kind))
        channel->received(channel->context, (enum channel_kind)kind, payload, (size_t)got - sizeof(kind), fds);
    free(payload);
}

bool channel_wait(int fd, enum channel_kind kind, void *payload, size_t bytes)
{
    uint8_t *packet = malloc(CHANNEL_PAYLOAD_MAX_BYTES);
    uint32_t got_kind;
    int fds[CHANNEL_FDS];
    bool ok = packet && receive(fd, 0, &got_kind, packet, fds) == (ssize_t)(sizeof(got_kind) + bytes) &&
              got_kind == (uint32_t)kind;
    if (ok)
        memcpy(payload, packet, bytes);
    free(packet);
    return ok;
}

/* ---- life ---- */

bool channel_pair(int fds[2], struct error *error)
{
    return socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, fds) == 0 ||
           error_set(error, ERROR_INTERNAL, NULL, "socketpair: %s", strerror(errno));
}

bool channel_open(struct channel *channel, struct loop *loop, int fd, struct error *error)
{
    channel->watch = loop_watch_add(loop, fd, EPOLLIN, on_ready, channel, error);
    if (!channel->watch)
        return false;
    channel->loop = loop;
    channel->fd = fd;
    channel->first = NULL;
    channel->end = &channel->first;
    return true;
}

void channel_close(struct channel *channel)
{
    if (!channel->watch)
        return;
    loop_watch_remove(channel->watch);
    channel->watch = NULL;
    close(channel->fd);
    for (struct channel_packet *packet; (packet = channel->first);) {
        channel->first = packet->next;
        destroy_packet(packet);
    }
}
