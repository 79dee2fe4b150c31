/* SPDX-License-Identifier: MIT */
/* Handover of a connection by a packet and a memory file. */
#include "net/handover.h"

#include <errno.h>
#include <fcntl.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

/* Limit above the size of an input buffer and a link's two. */
#define SAVED_MAX_BYTES ((size_t)1 << 20)

static bool write_all(int fd, const uint8_t *bytes, size_t count)
{
    for (size_t done = 0; done < count;) {
        const ssize_t written = write(fd, bytes + done, count - done);
        if (written <= 0)
            return false;
        done += (size_t)written;
    }
    return true;
}

static bool read_all(int fd, uint8_t *bytes, size_t count)
{
    for (size_t done = 0; done < count;) {
        const ssize_t got = pread(fd, bytes + done, count - done, (off_t)done);
        if (got <= 0)
            return false;
        done += (size_t)got;
    }
    return true;
}

static int save_bytes(struct connection_saved *saved, const struct connection *connection, const uint8_t *message,
                      size_t message_bytes)
{
    if (!connection_save(connection, message, message_bytes, saved))
        return -1;
    const size_t count = saved->in_bytes + saved->link_bytes;
    int fd = memfd_create("farlight client", MFD_CLOEXEC);
    if (fd >= 0 && !write_all(fd, saved->bytes, count)) {
        close(fd);
        fd = -1;
    }
    explicit_bzero(saved->bytes, count); /* a link's streams are secret */
    free(saved->bytes);
    saved->bytes = NULL;
    return fd;
}

bool handover_send(struct channel *channel, const struct connection *connection, const struct handover *handover,
                   const uint8_t *message, size_t message_bytes, struct error *error)
{
    struct handover packet = *handover;
    const int bytes_fd = save_bytes(&packet.saved, connection, message, message_bytes);
    const int socket_fd = bytes_fd >= 0 ? fcntl(connection->fd, F_DUPFD_CLOEXEC, 0) : -1;
    if (socket_fd < 0) {
        error_set(error, ERROR_OUT_OF_MEMORY, NULL, "cannot hand a client over: %s", strerror(errno));
        if (bytes_fd >= 0)
            close(bytes_fd);
        return false;
    }
    const int fds[CHANNEL_FDS] = {socket_fd, bytes_fd};
    return channel_send(channel, CHANNEL_CLIENT, &packet, sizeof(packet), fds) ||
           error_set(error, ERROR_OUT_OF_MEMORY, NULL, "cannot hand a client over: its worker is gone");
}

/* Whether the packet is valid; it may come from another worker. */
static bool is_valid(struct handover *handover)
{
    const struct connection_saved *saved = &handover->saved;
    handover->name[sizeof(handover->name) - 1] = '\0';
    handover->identity.name[sizeof(handover->identity.name) - 1] = '\0';
    return saved->in_bytes <= SAVED_MAX_BYTES && saved->link_bytes <= SAVED_MAX_BYTES &&
           handover->peer.storage_bytes <= sizeof(handover->peer.storage);
}

bool handover_take(struct handover *handover, const void *payload, size_t bytes, int bytes_fd, struct error *error)
{
    bool ok = bytes == sizeof(*handover) && bytes_fd >= 0;
    if (ok) {
        memcpy(handover, payload, sizeof(*handover));
        handover->saved.bytes = NULL;
        ok = is_valid(handover);
    }
    if (ok) {
        const size_t count = handover->saved.in_bytes + handover->saved.link_bytes;
        handover->saved.bytes = malloc(count + 1); /* a silent client has no bytes */
        ok = handover->saved.bytes && read_all(bytes_fd, handover->saved.bytes, count);
        if (!ok)
            free(handover->saved.bytes);
    }
    if (bytes_fd >= 0)
        close(bytes_fd);
    return ok || error_set(error, ERROR_INTERNAL, NULL, "a client that was handed over cannot be taken");
}
