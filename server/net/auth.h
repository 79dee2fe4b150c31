/* SPDX-License-Identifier: MIT */
/* Who is at the other end. On a Unix socket the kernel says it, on a sealed connection the key; over TCP on
 * loopback nobody does. */
#ifndef FARLIGHT_NET_AUTH_H
#define FARLIGHT_NET_AUTH_H

#include "base/error.h"
#include "net/address.h"
#include "protocol/sealed/sealed.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* The keys that the daemon knows. */
struct auth_keys {
    struct sealed_key keys[SEALED_KEYS_MAX];
    bool read_only[SEALED_KEYS_MAX]; /* whoever has it may look, but change nothing */
    size_t count;
};

struct auth_identity {
    bool known;     /* it shares blobs with its other connections: by its user, or by its key */
    bool has_user;  /* the kernel says who the peer's user is */
    uint32_t user;  /* the number of that, if there is one */
    bool has_key;   /* it has proved that it has a key of the daemon's */
    uint64_t key;   /* the number of that, if there is one */
    bool read_only; /* it may look, but change nothing */
    char name[48];  /* for people: "user 1000", "tcp:127.0.0.1:40312", "key, tcp:10.0.0.7:40312" */
};

/* Reads the key files; an empty path is none. */
bool auth_read_keys(struct auth_keys *keys, const char *key_file, const char *reader_key_file,
                    struct error *error);
/* What is known before the client has said anything. False with ERROR_DENIED: the peer may not come in.
 * `beyond_loopback` as for listener_open(). */
bool auth_identify(struct auth_identity *identity, int fd, const struct address *peer, bool beyond_loopback,
                   struct error *error);
/* The client has proved that it has the key of that index: this is who it is, from now on. */
void auth_identify_by_key(struct auth_identity *identity, const struct auth_keys *keys, size_t index);
/* Whether a connection between the two, the daemon's own address first, runs beyond this host or could. */
bool auth_is_beyond_loopback(const struct address *own, const struct address *peer);

#endif
