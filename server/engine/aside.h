/* SPDX-License-Identifier: MIT */
/* Transactions that take long, and jobs that begin with a search through a large scene, carried out beside the
 * thread that owns GL: a few threads, of which one client has at most one at a time, so that others find one free.
 * The caller keeps everything else away from a scene until its transaction is done, and changes from one that
 * is searched. */
#ifndef FARLIGHT_ENGINE_ASIDE_H
#define FARLIGHT_ENGINE_ASIDE_H

#include "base/error.h"
#include "engine/animation.h"
#include "engine/engine.h"

#include <stdatomic.h>

/* A transaction, or a job's start. It belongs to a thread of the pool until aside_take_done() returns it; only
 * `abandoned` may be set in between. */
struct aside_commit {
    struct aside_commit *next; /* for the pool */
    struct scene *scene;
    struct engine_command *command; /* owned; its edits are gone afterwards */
    struct animation_bounds bounds; /* bounds that a job's start has found */
    atomic_bool abandoned;
    bool applied;
    struct error error; /* why not */
    uint64_t start_ns, duration_ns;
    uint64_t promised_bytes; /* maximum that its tables may take; for the caller */
};

struct aside;

/* `on_done` is called on a thread of the pool after each. NULL and *error: no memory, or no thread. */
struct aside *aside_create(void (*on_done)(void *context), void *context, struct error *error);
/* Abandons unfinished tasks and waits for their end. Accepts NULL. */
void aside_destroy(struct aside *aside);

void aside_submit(struct aside *aside, struct aside_commit *commit);
struct aside_commit *aside_take_done(struct aside *aside); /* NULL: none is finished */
void aside_commit_destroy(struct aside_commit *commit);    /* accepts NULL */

#endif
