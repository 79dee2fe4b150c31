/* SPDX-License-Identifier: MIT */
/* Key files, and identities of clients. */
#include "net/auth.h"

#include "base/log.h"
#include "protocol/sealed/key.h"
#include "protocol/sealed/secret.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>
#include <sys/socket.h>

static bool read_key(struct auth_keys *keys, const char *path, bool read_only, struct error *error)
{
    struct decode_error why = {0};
    if (!path[0])
        return true;
    if (!sealed_key_read(&keys->keys[keys->count], path, &why)) {
        bool denied = why.code == PROTOCOL_ERROR_DENIED;
        error_set(error, denied ? ERROR_DENIED : ERROR_INVALID, path, "%s", why.text);
        return !denied && error_remedy(error, "'farlight key FILE' makes one");
    }
    keys->read_only[keys->count++] = read_only;
    return true;
}

static bool read_keys(struct auth_keys *keys, const char *key_file, const char *reader_key_file,
                      struct error *error)
{
    if (!read_key(keys, key_file, false, error) || !read_key(keys, reader_key_file, true, error))
        return false;
    if (keys->count == 2 && memcmp(&keys->keys[0], &keys->keys[1], sizeof(keys->keys[0])) == 0)
        return error_set(error, ERROR_INVALID, reader_key_file,
                         "is the same key as server.key_file, whose holders may edit");
    return true;
}

bool auth_read_keys(struct auth_keys **keys, const char *key_file, const char *reader_key_file,
                    struct error *error)
{
    *keys = NULL;
    if (!key_file[0] && !reader_key_file[0])
        return true;
    struct auth_keys *read = secret_create(sizeof(*read));
    if (!read)
        return error_set(error, ERROR_OUT_OF_MEMORY, "server.key_file", "no memory for keys");
    read->refs = 1;
    if (!read_keys(read, key_file, reader_key_file, error)) {
        auth_keys_unref(read);
        return false;
    }
    if (!secret_is_locked(read, sizeof(*read)))
        log_write(LOG_WARNING, "net",
                  "the memory of keys cannot be locked, and may be swapped: raise LimitMEMLOCK");
    *keys = read;
    return true;
}

struct auth_keys *auth_keys_ref(struct auth_keys *keys)
{
    if (keys)
        keys->refs++;
    return keys;
}

void auth_keys_unref(struct auth_keys *keys)
{
    if (keys && --keys->refs == 0)
        secret_destroy(keys);
}

struct auth_key_numbers auth_keys_numbers(const struct auth_keys *keys)
{
    struct auth_key_numbers known = {.count = keys ? keys->count : 0};
    for (size_t i = 0; i < known.count; i++) {
        known.numbers[i] = sealed_key_number(&keys->keys[i]);
        known.read_only[i] = keys->read_only[i];
    }
    return known;
}

bool auth_numbers_have(const struct auth_key_numbers *keys, const struct auth_identity *identity)
{
    for (size_t i = 0; i < keys->count; i++) {
        if (keys->numbers[i] == identity->key && keys->read_only[i] == identity->read_only)
            return true;
    }
    return false;
}

/* Bit of networks in owner numbers. Users are 32-bit numbers, keys have the top bit set. */
#define NETWORK_BIT (UINT64_C(1) << 62)

uint64_t auth_owner_number(const struct auth_identity *identity, const struct address *peer)
{
    if (identity->has_key)
        return AUTH_OWNER_KEY | identity->key;
    if (identity->has_user)
        return identity->user;
    return (address_network(peer) & ~AUTH_OWNER_KEY) | NETWORK_BIT;
}

bool auth_needs_key(const struct address *own, const struct address *peer, const struct auth_keys *keys)
{
    return !address_is_unix(peer) && (keys || !address_is_loopback(own) || !address_is_loopback(peer));
}

bool auth_identify(struct auth_identity *identity, int fd, const struct address *peer, bool beyond_loopback,
                   struct error *error)
{
    *identity = (struct auth_identity){0};
    if (address_is_unix(peer)) {
        struct ucred credentials = {0};
        socklen_t bytes = sizeof(credentials);
        if (getsockopt(fd, SOL_SOCKET, SO_PEERCRED, &credentials, &bytes) < 0)
            return error_set(error, ERROR_DENIED, "peer", "the kernel does not tell the peer's user: %s",
                             strerror(errno));
        identity->known = identity->has_user = true;
        identity->user = credentials.uid;
        snprintf(identity->name, sizeof(identity->name), "user %u", (unsigned)credentials.uid);
        return true;
    }
    char text[ADDRESS_TEXT_BYTES];
    address_print(peer, text);
    snprintf(identity->name, sizeof(identity->name), "%.39s", text);
    if (beyond_loopback || address_is_loopback(peer))
        return true;
    return error_set(error, ERROR_DENIED, "peer", "%s is not on this host", text);
}

void auth_identify_by_key(struct auth_identity *identity, const struct auth_keys *keys, size_t index)
{
    const struct auth_identity before = *identity;
    identity->known = identity->has_key = true;
    identity->key = sealed_key_number(&keys->keys[index]);
    identity->read_only = keys->read_only[index];
    snprintf(identity->name, sizeof(identity->name), "%s, %.33s", identity->read_only ? "reader's key" : "key",
             before.name);
}
