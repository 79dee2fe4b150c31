/* SPDX-License-Identifier: MIT */
/* Unix and TCP listeners, and the sockets of accepted clients. */
#include "net/listen.h"

#include "base/host.h"
#include "base/log.h"
#include "base/sys.h"

#include <errno.h>
#include <fcntl.h>
#include <libgen.h>
#include <limits.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

/* Probes of TCP: a client whose host is silent for two minutes is lost. */
#define PROBE_AFTER_S 60
#define PROBE_EVERY_S 15
#define PROBES 4
/* Unsent bytes that the kernel may hold: few, as a frame that motion overtakes cannot be withdrawn from it, and
 * enough to keep a local network busy. */
#define UNSENT_BYTES (32 << 10)
/* Nodes of a farm connect at once, and a non-blocking connect fails while the backlog is full. */
#define BACKLOG SOMAXCONN

static const struct sockaddr *raw(const struct address *address)
{
    return (const struct sockaddr *)&address->storage;
}

static bool is_runtime_folder(const char *folder)
{
    char of_user[PATH_MAX];
    return strcmp(folder, HOST_RUNTIME_FOLDER) == 0 ||
           (host_user_runtime_folder(of_user, sizeof(of_user)) && strcmp(folder, of_user) == 0);
}

static bool make_folder(const char *path, struct error *error)
{
    char copy[PATH_MAX];
    snprintf(copy, sizeof(copy), "%s", path);
    const char *folder = dirname(copy);
    struct stat status;
    if (stat(folder, &status) == 0)
        return true;
    /* Any other missing folder is more likely a misspelling. */
    if (!is_runtime_folder(folder)) {
        error_set(error, ERROR_INVALID, path, "the folder %s cannot be used: %s", folder, strerror(errno));
        return error_remedy(error, "correct the address, or make the folder");
    }
    if (mkdir(folder, 0750) == 0 || errno == EEXIST)
        return true;
    error_set(error, ERROR_INVALID, path, "cannot make the folder %s: %s", folder, strerror(errno));
    return error_remedy(error, "give --listen unix:/PATH, or set XDG_RUNTIME_DIR to a folder of yours");
}

/* Removes a stale file: a live daemon answers a connect; a refusal shows that the file is stale. */
static bool clear_path(const struct address *address, struct error *error)
{
    const char *path = address_path(address);
    struct stat status;
    if (lstat(path, &status) < 0)
        return errno == ENOENT || error_set(error, ERROR_INVALID, path, "%s", strerror(errno));
    if (!S_ISSOCK(status.st_mode))
        return error_set(error, ERROR_INVALID, path,
                         "the path names a file that is not a socket; it was left alone");
    int fd = sys.socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd < 0)
        return error_set(error, ERROR_INTERNAL, path, "socket: %s", strerror(errno));
    int result = sys.connect(fd, raw(address), address->storage_bytes);
    int why = errno;
    close(fd);
    if (result < 0 && why == ECONNREFUSED) {
        log_write(LOG_INFO, "net", "removing the stale socket %s", path);
        if (unlink(path) == 0 || errno == ENOENT)
            return true;
        return error_set(error, ERROR_INVALID, path, "cannot remove the stale socket: %s", strerror(errno));
    }
    if (result < 0 && why == ENOENT)
        return true;
    if (result < 0 && why != EAGAIN && why != EINTR)
        return error_set(error, ERROR_INVALID, path, "cannot tell whether a daemon listens there: %s",
                         strerror(why));
    error_set(error, ERROR_BUSY, path, "another daemon listens there");
    return error_remedy(error, "stop it, or use another path");
}

static bool check_tcp(const struct address *address, bool beyond_loopback, struct error *error)
{
    if (beyond_loopback || address_is_loopback(address))
        return true;
    char text[ADDRESS_TEXT_BYTES];
    address_print(address, text);
    error_set(error, ERROR_DENIED, text,
              "beyond loopback, plain TCP is open to every host that can reach it, and can be read on its way");
    return error_remedy(error,
                        "give a key with --key-file ('farlight key FILE' makes one), listen on 127.0.0.1 and "
                        "connect through ssh, or give --insecure");
}

static bool bind_and_listen(struct listener *listener, const struct address *address, struct error *error)
{
    char text[ADDRESS_TEXT_BYTES];
    address_print(address, text);
    int on = 1;
    if (!address_is_unix(address))
        setsockopt(listener->fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    if (address->storage.ss_family == AF_INET6)
        setsockopt(listener->fd, IPPROTO_IPV6, IPV6_V6ONLY, &on, sizeof(on));
    /* The mask applies at creation, so that other users cannot connect even before the chmod. */
    mode_t mask = umask(0117);
    int result = sys.bind(listener->fd, raw(address), address->storage_bytes);
    int why = errno;
    umask(mask);
    if (result < 0)
        return error_set(error, why == EADDRINUSE ? ERROR_BUSY : ERROR_INVALID, text, "%s", strerror(why));
    listener->owns_path = address_is_unix(address);
    if (sys.listen(listener->fd, BACKLOG) < 0)
        return error_set(error, ERROR_INTERNAL, text, "listen: %s", strerror(errno));
    listener->address.storage_bytes = sizeof(listener->address.storage);
    if (getsockname(listener->fd, (struct sockaddr *)&listener->address.storage,
                    &listener->address.storage_bytes) < 0)
        return error_set(error, ERROR_INTERNAL, text, "getsockname: %s", strerror(errno));
    return true;
}

bool listener_open(struct listener *listener, const struct address *address, bool beyond_loopback,
                   struct error *error)
{
    *listener = (struct listener){.fd = -1, .address = *address};
    if (address_is_unix(address)) {
        if (!make_folder(address_path(address), error) || !clear_path(address, error))
            return false;
    } else if (!check_tcp(address, beyond_loopback, error)) {
        return false;
    }
    listener->fd = sys.socket(address->storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (listener->fd < 0)
        return error_set(error, ERROR_INTERNAL, "listen", "socket: %s", strerror(errno));
    if (!bind_and_listen(listener, address, error)) {
        listener_close(listener);
        return false;
    }
    return true;
}

static bool is_listening_stream(int fd)
{
    int type = 0, listens = 0;
    socklen_t bytes = sizeof(type), listens_bytes = sizeof(listens);
    return getsockopt(fd, SOL_SOCKET, SO_TYPE, &type, &bytes) == 0 && type == SOCK_STREAM &&
           getsockopt(fd, SOL_SOCKET, SO_ACCEPTCONN, &listens, &listens_bytes) == 0 && listens;
}

bool listener_adopt(struct listener *listener, int fd, const char *name, bool beyond_loopback, struct error *error)
{
    *listener = (struct listener){.fd = fd};
    struct address *address = &listener->address;
    address->storage_bytes = sizeof(address->storage);
    if (!is_listening_stream(fd) ||
        getsockname(fd, (struct sockaddr *)&address->storage, &address->storage_bytes) < 0) {
        error_set(error, ERROR_INVALID, name,
                  "the service manager passed a descriptor that is not a listening stream socket");
        return error_remedy(error, "use ListenStream= and Accept=no in the socket unit");
    }
    sa_family_t family = address->storage.ss_family;
    if (family != AF_UNIX && family != AF_INET && family != AF_INET6)
        return error_set(error, ERROR_UNSUPPORTED, name,
                         "unsupported socket family %u; allowed are Unix, IPv4 and IPv6", (unsigned)family);
    int flags = fcntl(fd, F_GETFL);
    if (flags < 0 || fcntl(fd, F_SETFL, flags | O_NONBLOCK) < 0)
        return error_set(error, ERROR_INTERNAL, name, "%s", strerror(errno));
    return address_is_unix(address) || check_tcp(address, beyond_loopback, error);
}

void listener_close(struct listener *listener)
{
    if (listener->owns_path)
        unlink(address_path(&listener->address));
    if (listener->fd >= 0)
        close(listener->fd);
    *listener = (struct listener){.fd = -1};
}

int listener_accept(const struct listener *listener, struct address *peer, bool *retry_later)
{
    *retry_later = false;
    *peer = (struct address){.storage_bytes = sizeof(peer->storage)};
    int fd = sys_accept(listener->fd, (struct sockaddr *)&peer->storage, &peer->storage_bytes,
                        SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (fd < 0) {
        *retry_later = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
        if (*retry_later)
            log_write(LOG_WARNING, "net", "cannot accept a client: %s", strerror(errno));
        return -1;
    }
    /* A Unix peer has no name; callers need only the family. */
    peer->storage.ss_family = listener->address.storage.ss_family;
    if (!address_is_unix(peer)) {
        int on = 1; /* answers are small and urgent; frames are large in any case */
        setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
        /* The kernel gets few bytes, as they can be neither withdrawn nor overtaken. */
        setsockopt(fd, IPPROTO_TCP, TCP_NOTSENT_LOWAT, &(int){UNSENT_BYTES}, sizeof(int));
        /* Keep-alive finds a client that waits for frames, and may be silent for ever, after it has vanished. */
        setsockopt(fd, SOL_SOCKET, SO_KEEPALIVE, &on, sizeof(on));
        setsockopt(fd, IPPROTO_TCP, TCP_KEEPIDLE, &(int){PROBE_AFTER_S}, sizeof(int));
        setsockopt(fd, IPPROTO_TCP, TCP_KEEPINTVL, &(int){PROBE_EVERY_S}, sizeof(int));
        setsockopt(fd, IPPROTO_TCP, TCP_KEEPCNT, &(int){PROBES}, sizeof(int));
    }
    return fd;
}

bool listen_take_connected(int fd, struct address *peer, struct error *error)
{
    char field[32];
    snprintf(field, sizeof(field), "--fd %d", fd);
    *peer = (struct address){.storage_bytes = sizeof(peer->storage)};
    if (getpeername(fd, (struct sockaddr *)&peer->storage, &peer->storage_bytes) < 0)
        return error_set(error, ERROR_INVALID, field, "not a connected socket: %s", strerror(errno));
    const int flags = fcntl(fd, F_GETFL);
    return (flags >= 0 && fcntl(fd, F_SETFL, flags | O_NONBLOCK) == 0 && fcntl(fd, F_SETFD, FD_CLOEXEC) == 0) ||
           error_set(error, ERROR_INVALID, field, "%s", strerror(errno));
}
