/* SPDX-License-Identifier: MIT */
/* A client on its way from the front, which knows who it is and has read its hello, to the worker that answers. */
#ifndef FARLIGHT_NET_HANDOVER_H
#define FARLIGHT_NET_HANDOVER_H

#include "net/auth.h"
#include "net/channel.h"
#include "net/connection.h"

/* The packet. Its first descriptor is the client's socket; the second holds the bytes of `saved`. */
struct handover {
    struct auth_identity identity;
    struct address peer;
    struct connection_saved saved; /* its `bytes` are NULL in the packet */
    bool is_owner;                 /* the worker, and the daemon, end with it */
    uint32_t to_worker;            /* for the front: number of the worker that is to serve it */
    bool is_open;                  /* its hello was answered, as follows: messages are next */
    bool can_h264, can_abandon;
    char name[HANDSHAKE_NAME_MAX_BYTES + 1];
};

/* Sends a connection, and whose it is; `message` was read of it already, and is to be read first (NULL: nothing
 * is). See connection_save(). It is the caller's still: connection_close() is next. False and *error: it has not
 * gone. */
bool handover_send(struct channel *channel, const struct connection *connection, const struct handover *handover,
                   const uint8_t *message, size_t message_bytes, struct error *error);
/* Reads the packet; takes over the descriptor of the bytes. The caller frees handover->saved.bytes. */
bool handover_take(struct handover *handover, const void *payload, size_t bytes, int bytes_fd,
                   struct error *error);

#endif
