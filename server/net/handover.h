/* SPDX-License-Identifier: MIT */
/* Handover of a client from the front, which has identified it and read its hello, to the worker that serves
 * it. */
#ifndef FARLIGHT_NET_HANDOVER_H
#define FARLIGHT_NET_HANDOVER_H

#include "net/auth.h"
#include "net/channel.h"
#include "net/connection.h"

/* The packet. Its first descriptor is the client's socket; the second holds the bytes of `saved`. */
struct handover {
    struct auth_identity identity;
    struct address peer;
    struct connection_saved saved; /* `bytes` is NULL in the packet */
    bool is_owner;                 /* the worker, and the daemon, end with this client */
    uint32_t to_worker;            /* for the front: number of the worker that should serve it */
    bool is_open;                  /* its hello was answered with the values below: messages are next */
    bool can_h264, can_abandon;
    char name[HANDSHAKE_NAME_MAX_BYTES + 1];
};

/* Sends a connection with its identity; `message` was read from it already, and is to be read first (NULL:
 * none). See connection_save(). The caller still owns the connection and must close it next. False and *error:
 * it was not sent. */
bool handover_send(struct channel *channel, const struct connection *connection, const struct handover *handover,
                   const uint8_t *message, size_t message_bytes, struct error *error);
/* Reads the packet; owns the descriptor of the bytes. The caller frees handover->saved.bytes. */
bool handover_take(struct handover *handover, const void *payload, size_t bytes, int bytes_fd,
                   struct error *error);

#endif
