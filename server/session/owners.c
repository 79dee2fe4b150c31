/* SPDX-License-Identifier: MIT */
#include "session/owners.h"

#include <stdlib.h>

/* Behind the numbers of users, as of auth_owner_number(): clients that nobody knows. */
#define SESSION_BIT (UINT64_C(1) << 32)

blob_principal principal_number(const struct auth_identity *identity, uint64_t session)
{
    return identity->has_key || identity->has_user ? auth_owner_number(identity, NULL) : SESSION_BIT + session;
}

blob_principal principal_for_next_process(blob_principal principal)
{
    return principal & AUTH_OWNER_KEY || principal < SESSION_BIT ? principal : PRINCIPAL_NOBODY;
}

struct owner *owner_find(struct owners *owners, uint64_t number)
{
    struct owner *owner = hashmap_get(&owners->by_number, number);
    if (owner)
        return owner_ref(owner);
    owner = calloc(1, sizeof(*owner));
    if (!owner || !hashmap_put(&owners->by_number, number, owner)) {
        free(owner);
        return NULL;
    }
    owner->number = number;
    owner->references = 1;
    owner->waiting_end = &owner->waiting;
    return owner;
}

struct owner *owner_ref(struct owner *owner)
{
    owner->references++;
    return owner;
}

void owner_unref(struct owners *owners, struct owner *owner)
{
    if (!owner || --owner->references)
        return;
    hashmap_remove(&owners->by_number, owner->number);
    free(owner);
}

void owners_finish(struct owners *owners)
{
    hashmap_finish(&owners->by_number);
}

uint64_t owner_share(uint64_t limit, uint32_t percent)
{
    uint64_t share = !percent ? limit : limit / 100 * percent + limit % 100 * percent / 100;
    return share ? share : 1;
}

bool owner_may_have(uint64_t own, uint64_t all, uint64_t more, uint64_t limit, uint32_t percent)
{
    uint64_t share = owner_share(limit, percent);
    return more <= limit && all <= limit - more && more <= share && own <= share - more;
}
