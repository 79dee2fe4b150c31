/* SPDX-License-Identifier: MIT */
/* Kept and shared scenes on disk: written while they change, removed when they end, and restored at the start. */
#ifndef FARLIGHT_SESSION_KEEPER_H
#define FARLIGHT_SESSION_KEEPER_H

#include "session/hub.h"
#include "store/store.h"

/* Keeper for the engine. *store outlives the engine; while it is NULL nothing is kept. */
struct engine_keeper keeper_port(struct store **store);

/* Restores the scenes of the store as lingering scenes of their owners, before any client is served. A scene that
 * cannot be restored is removed, or stays on the disk where memory or a limit is the reason, and the log says so.
 * Ends early where SIGTERM or SIGINT waits; the rest stays on the disk. */
void keeper_restore(struct store *store, struct hub *hub);

#endif
