/* SPDX-License-Identifier: MIT */
/* Sockets that wait for clients. */
#ifndef FARLIGHT_NET_LISTEN_H
#define FARLIGHT_NET_LISTEN_H

#include "base/error.h"
#include "net/address.h"

#include <stdbool.h>

struct listener {
    int fd;                 /* non-blocking */
    struct address address; /* with the port that the kernel chose, if it was 0 */
    bool owns_path;         /* the socket file is ours to remove */
};

/* Unix: the file gets mode 0660; its folder is made with mode 0750 if it is missing (its parent must be
 * there); a file that nobody answers at is removed, a live daemon there is an error. TCP: only loopback, unless
 * `beyond_loopback` says that there is a key for those who come from there, or that none is wanted. */
bool listener_open(struct listener *listener, const struct address *address, bool beyond_loopback,
                   struct error *error);
/* One that listens already, handed over by the service manager, whose file stays there; `name` is for people. The
 * descriptor is the listener's if it succeeds. */
bool listener_adopt(struct listener *listener, int fd, const char *name, bool beyond_loopback,
                    struct error *error);
void listener_close(struct listener *listener); /* removes the socket file */

/* The next client, non-blocking; -1 if none waits. *peer: where it comes from. *retry_later: the process is out of
 * descriptors, so that the listener stays readable without anybody being let in. */
int listener_accept(const struct listener *listener, struct address *peer, bool *retry_later);

#endif
