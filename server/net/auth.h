/* SPDX-License-Identifier: MIT */
/* Identity of a client. The kernel provides it on a Unix socket, the key on a sealed connection; plain TCP on
 * loopback has none. */
#ifndef FARLIGHT_NET_AUTH_H
#define FARLIGHT_NET_AUTH_H

#include "base/error.h"
#include "net/address.h"
#include "protocol/sealed/sealed.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Keys of the daemon, in memory for secrets. NULL: none. */
struct auth_keys {
    uint32_t refs;
    struct sealed_key keys[SEALED_KEYS_MAX];
    bool read_only[SEALED_KEYS_MAX]; /* its holder may view scenes and not change them */
    size_t count;
};

/* Numbers of the keys without the keys themselves, for code that does not need them. */
struct auth_key_numbers {
    uint64_t numbers[SEALED_KEYS_MAX];
    bool read_only[SEALED_KEYS_MAX];
    size_t count;
};

struct auth_identity {
    bool known;     /* identified by user or key: it shares blobs with its other connections */
    bool has_user;  /* the kernel has identified the user */
    uint32_t user;  /* the number of that user, if has_user */
    bool has_key;   /* proved to hold one of the daemon's keys */
    uint64_t key;   /* the number of that key, if has_key */
    bool read_only; /* may view scenes and not change them */
    char name[48];  /* for people: "user 1000", "tcp:127.0.0.1:40312", "key, tcp:10.0.0.7:40312" */
};

/* Reads the key files; an empty path names none. The caller has a reference to *keys. */
bool auth_read_keys(struct auth_keys **keys, const char *key_file, const char *reader_key_file,
                    struct error *error);
struct auth_keys *auth_keys_ref(struct auth_keys *keys);
void auth_keys_unref(struct auth_keys *keys); /* the last reference wipes the keys */
struct auth_key_numbers auth_keys_numbers(const struct auth_keys *keys);
/* Whether a holder of that identity's key still has its permissions. */
bool auth_numbers_have(const struct auth_key_numbers *keys, const struct auth_identity *identity);
/* Identifies a client before its first byte. False with ERROR_DENIED: the peer is refused. `beyond_loopback` as
 * for listener_open(). */
bool auth_identify(struct auth_identity *identity, int fd, const struct address *peer, bool beyond_loopback,
                   struct error *error);
/* Sets the identity of a client that has proved to hold the key of that index. */
void auth_identify_by_key(struct auth_identity *identity, const struct auth_keys *keys, size_t index);
/* Bit of keys in owner numbers. */
#define AUTH_OWNER_KEY (UINT64_C(1) << 63)
/* Number of the client's owner: of the user, the key, or the network of an unidentified client. `peer` may be
 * NULL for users and keys. */
uint64_t auth_owner_number(const struct auth_identity *identity, const struct address *peer);
/* Whether a connection between the daemon's own address and the peer's needs a key: TCP that leaves this host,
 * or could; and all TCP if the daemon has keys, as every user of this host reaches loopback. */
bool auth_needs_key(const struct address *own, const struct address *peer, const struct auth_keys *keys);

#endif
