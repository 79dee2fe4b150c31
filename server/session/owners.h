/* SPDX-License-Identifier: MIT */
/* Those to whom clients belong: a user, a key, or the network of clients that nobody knows. What there is of
 * places and memory is shared between owners, not between connections: however many connections one owner opens,
 * the others keep their part. One thread. */
#ifndef FARLIGHT_SESSION_OWNERS_H
#define FARLIGHT_SESSION_OWNERS_H

#include "base/hashmap.h"
#include "net/address.h"
#include "net/auth.h"
#include "session/blob_store.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct engine_command;

struct owner {
    uint64_t number;
    size_t references;
    uint32_t clients;     /* introduced */
    uint64_t frame_bytes; /* maximum of the frames of its jobs */
    uint64_t transaction_bytes;
    /* Its commands that are not with the engine yet, in order; owners take turns. */
    struct engine_command *waiting, **waiting_end;
    size_t waiting_count;
    bool held;            /* so many that its sessions do not read on */
    uint32_t stats_asked; /* of its questions for figures: those that the engine has */
    bool waits_for_stats; /* its next command is one more; it has no turn until one is answered */
    struct owner *next;   /* whose turn is after this one's; NULL: it has no command, or is the last */
};

struct owners {
    struct hashmap by_number;
};

/* To whom blobs and kept scenes belong: the same of users and keys; a client that nobody knows shares with no
 * other. */
blob_principal principal_number(const struct auth_identity *identity, uint64_t session);
/* As the next process knows it: sessions are counted from 1 there, too, so theirs become nobody's. */
#define PRINCIPAL_NOBODY (UINT64_C(1) << 32)
blob_principal principal_for_next_process(blob_principal principal);
/* A reference to the owner of that number, made where there is none. NULL: out of memory. */
struct owner *owner_find(struct owners *owners, uint64_t number);
struct owner *owner_ref(struct owner *owner);
void owner_unref(struct owners *owners, struct owner *owner); /* accepts NULL */
void owners_finish(struct owners *owners);

/* What one owner may have of the `limit` of all; 0 %: all of it. At least 1. */
uint64_t owner_share(uint64_t limit, uint32_t percent);
/* Whether an owner that has `own` of `all` may have `more`. */
bool owner_may_have(uint64_t own, uint64_t all, uint64_t more, uint64_t limit, uint32_t percent);

#endif
