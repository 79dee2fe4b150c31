/* SPDX-License-Identifier: MIT */
/* Connecting a socket to the address of a daemon. */
#include "lib/address.h"
#include "lib/stream.h"
#include "lib/text.h"

#include <errno.h>
#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

/* connect() with a deadline, on a non-blocking socket. Returns 0, or an errno value, or -1 with *error set. */
static int connect_by(int fd, const struct sockaddr *address, socklen_t address_bytes, uint64_t deadline_ns,
                      int interrupt_fd, struct fl_error *error)
{
    if (connect(fd, address, address_bytes) == 0)
        return 0;
    if (errno != EINPROGRESS && errno != EINTR)
        return errno;
    struct pollfd polled = {.fd = fd, .events = POLLOUT};
    if (!fl_wait(&polled, 1, interrupt_fd, deadline_ns, error))
        return -1;
    int failure = 0;
    socklen_t failure_bytes = sizeof(failure);
    if (getsockopt(fd, SOL_SOCKET, SO_ERROR, &failure, &failure_bytes) < 0)
        return errno;
    return failure;
}

static int refuse(const char *address, int failure, struct fl_error *error)
{
    /* An invalid address or missing rights do not change by themselves; a daemon may still start. */
    const bool is_final = failure == EACCES || failure == EPERM || failure == ENOTDIR || failure == ELOOP ||
                          failure == ENAMETOOLONG || failure == EPROTOTYPE || failure == EAFNOSUPPORT;
    if (failure > 0) {
        fl_error_set(error, is_final ? FL_ERROR_SYSTEM : FL_ERROR_CONNECTION, address, "cannot reach a daemon: %s",
                     strerror(failure));
        if (failure == EACCES)
            fl_error_remedy(error, "ask for the socket's group, usually farlight, or leave --server out");
        else
            fl_error_remedy(error, "start one with 'farlightd --listen ADDRESS', or leave --server out");
        if (error)
            error->retryable = failure == EAGAIN || failure == ETIMEDOUT;
    }
    return -1;
}

static int connect_unix(const char *address, const char *path, uint64_t deadline_ns, int interrupt_fd,
                        struct fl_error *error)
{
    struct sockaddr_un name = {.sun_family = AF_UNIX};
    if (*path == '\0' || strlen(path) >= sizeof(name.sun_path)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, address, "a socket's path has 1 to %zu characters",
                     sizeof(name.sun_path) - 1);
        return -1;
    }
    memcpy(name.sun_path, path, strlen(path) + 1);
    const int fd = socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return refuse(address, errno, error);
    const int failure =
        connect_by(fd, (const struct sockaddr *)&name, (socklen_t)sizeof(name), deadline_ns, interrupt_fd, error);
    if (failure == 0)
        return fd;
    close(fd);
    return refuse(address, failure, error);
}

/* Splits "HOST:PORT" or "[HOST]:PORT". */
static bool split_host(const char *text, char *host, size_t host_bytes, const char **port)
{
    const char *colon = strrchr(text, ':');
    if (!colon || colon == text || colon[1] == '\0')
        return false;
    size_t length = (size_t)(colon - text);
    if (text[0] == '[' && text[length - 1] == ']') {
        text++;
        length -= 2;
    } else if (memchr(text, ':', length)) {
        return false;
    }
    if (length == 0 || length >= host_bytes)
        return false;
    memcpy(host, text, length);
    host[length] = '\0';
    *port = colon + 1;
    return true;
}

static int connect_tcp(const char *address, const char *where, uint64_t deadline_ns, int interrupt_fd,
                       struct fl_error *error)
{
    char host[256];
    const char *port = NULL;
    uint64_t number = 0;
    if (!split_host(where, host, sizeof(host), &port) || !fl_text_integer(port, 1, 65535, &number, NULL)) {
        fl_error_set(error, FL_ERROR_ARGUMENT, address, "is not tcp:HOST:PORT with a port of 1 to 65535");
        return -1;
    }
    const struct addrinfo hints = {.ai_family = AF_UNSPEC, .ai_socktype = SOCK_STREAM, .ai_flags = AI_NUMERICSERV};
    struct addrinfo *found = NULL;
    const int status = getaddrinfo(host, port, &hints, &found);
    if (status != 0) {
        fl_error_set(error, status == EAI_AGAIN ? FL_ERROR_CONNECTION : FL_ERROR_SYSTEM, address,
                     "unknown host: %s", gai_strerror(status));
        return -1;
    }
    int failure = ECONNREFUSED, fd = -1;
    for (const struct addrinfo *at = found; at && fd < 0 && failure >= 0; at = at->ai_next) {
        fd = socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, at->ai_protocol);
        failure = fd < 0 ? errno : connect_by(fd, at->ai_addr, at->ai_addrlen, deadline_ns, interrupt_fd, error);
        if (fd >= 0 && failure != 0) {
            close(fd);
            fd = -1;
        }
    }
    freeaddrinfo(found);
    if (fd < 0)
        return refuse(address, failure, error);
    const int on = 1;
    setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    return fd;
}

int fl_address_connect(const char *address, uint64_t deadline_ns, int interrupt_fd, bool *local,
                       struct fl_error *error)
{
    *local = strncmp(address, "unix:", 5) == 0;
    if (*local)
        return connect_unix(address, address + 5, deadline_ns, interrupt_fd, error);
    if (strncmp(address, "tcp:", 4) == 0)
        return connect_tcp(address, address + 4, deadline_ns, interrupt_fd, error);
    fl_error_set(error, FL_ERROR_ARGUMENT, address, "is not an address of a daemon");
    fl_error_remedy(error, "give unix:PATH, tcp:HOST:PORT or ssh:HOST[:SOCKET]");
    return -1;
}
