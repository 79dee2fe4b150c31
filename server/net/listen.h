/* SPDX-License-Identifier: MIT */
/* Sockets that accept clients. */
#ifndef FARLIGHT_NET_LISTEN_H
#define FARLIGHT_NET_LISTEN_H

#include "base/error.h"
#include "net/address.h"

#include <stdbool.h>

struct listener {
    int fd;                 /* non-blocking */
    struct address address; /* includes the port that the kernel chose, if it was 0 */
    bool owns_path;         /* close removes the socket file */
};

/* Opens a listener. Unix: the file gets mode 0660; its folder must exist, except one of base/host.h, which is
 * made with mode 0750; a stale socket file is removed, a live daemon there is an error. TCP: loopback only,
 * unless `beyond_loopback` says that a key protects the address, or that none is wanted. */
bool listener_open(struct listener *listener, const struct address *address, bool beyond_loopback,
                   struct error *error);
/* Adopts a listening socket of the service manager, whose file is left in place; `name` is for messages. On
 * success the listener owns the descriptor. */
bool listener_adopt(struct listener *listener, int fd, const char *name, bool beyond_loopback,
                    struct error *error);
void listener_close(struct listener *listener); /* removes the socket file */

/* Accepts the next client, non-blocking; -1 if none waits. *peer: its address. *retry_later: the process is out
 * of descriptors, so the listener stays readable and accepts no client. */
int listener_accept(const struct listener *listener, struct address *peer, bool *retry_later);

/* Adopts a connected socket that another program has opened (--fd), and finds its peer. It becomes non-blocking
 * and close-on-exec. */
bool listen_take_connected(int fd, struct address *peer, struct error *error);

#endif
