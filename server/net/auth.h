/* SPDX-License-Identifier: MIT */
/* Who is at the other end. On a Unix socket the kernel says it; over TCP on loopback nobody does. */
#ifndef FARLIGHT_NET_AUTH_H
#define FARLIGHT_NET_AUTH_H

#include "base/error.h"
#include "net/address.h"

#include <stdbool.h>
#include <stdint.h>

struct auth_identity {
    bool known;     /* the peer's user is known: it shares blobs with its other connections */
    uint32_t user;  /* its user number, if known */
    bool read_only; /* it may look, but change nothing */
    char name[40];  /* for people: "user 1000", "tcp:127.0.0.1:40312" */
};

/* False with ERROR_DENIED: the peer may not come in. `insecure` as for listener_open(). */
bool auth_identify(struct auth_identity *identity, int fd, const struct address *peer, bool insecure,
                   struct error *error);

#endif
