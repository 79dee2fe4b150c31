/* SPDX-License-Identifier: MIT */
/* The thread on which a keeper reads and writes scenes, in the order in which it is asked. The caller keeps
 * changes away from a scene until it has been read; frames may continue. */
#ifndef FARLIGHT_ENGINE_KEEP_H
#define FARLIGHT_ENGINE_KEEP_H

#include "base/error.h"
#include "engine/engine.h"

struct keep;

/* `on_change` is called on the thread when a scene was read, and when an order was carried out. NULL and *error:
 * no memory, or no thread. */
struct keep *keep_create(const struct engine_keeper *keeper, void (*on_change)(void *context), void *context,
                         struct error *error);
/* Carries out orders for at most that long, and drops the rest. Accepts NULL. */
void keep_destroy(struct keep *keep, uint64_t within_ns);

bool keep_is_idle(struct keep *keep); /* whether a scene to be saved would be read at once */
/* False: no memory. */
bool keep_save(struct keep *keep, const struct scene *scene, uint64_t principal, enum sharing sharing);
bool keep_forget(struct keep *keep, uint64_t principal, const char *name);
/* True once for each scene that was read; *read_ns: how long that took. Until then the caller saves no other. */
bool keep_was_read(struct keep *keep, uint64_t *read_ns);

#endif
