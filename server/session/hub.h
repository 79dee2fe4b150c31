/* SPDX-License-Identifier: MIT */
/* State that the sessions share: the loop, the engine, the blobs, the limits. */
#ifndef FARLIGHT_SESSION_HUB_H
#define FARLIGHT_SESSION_HUB_H

#include "base/hashmap.h"
#include "net/auth.h"
#include "net/connection.h"
#include "net/handover.h"
#include "net/loop.h"
#include "session/blob_store.h"
#include "session/engine_port.h"
#include "session/hasher.h"
#include "session/limits.h"
#include "session/principals.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct session;

struct hub_options {
    struct session_limits limits;
    struct connection_limits connection_limits;
    uint64_t started_ns;    /* start of the daemon */
    uint64_t first_client;  /* number before that of the first client */
    bool owner_may_be_idle; /* whether the client of daemon_serve_fd() may stay silent */
    struct engine_port engine;
    struct timeline *timeline;          /* records every frame that was sent; may be NULL */
    struct engine_limits engine_limits; /* the engine's limits, which clients are informed of */
    uint64_t device_bytes;              /* the engine's limit of device memory, likewise; 0: none */
    struct auth_key_numbers keys;       /* the daemon's keys; clients with another key are disconnected */
};

struct hub {
    struct loop *loop;
    struct hub_options options;
    struct blob_store *blobs;
    struct hasher *hasher;      /* NULL: the network thread hashes itself */
    struct hashmap sessions;    /* struct session *, by number */
    struct hashmap departed;    /* bytes of edits, by number of a client that is gone and that the engine has not
                                   forgotten yet */
    uint32_t introduced;        /* sessions with a completed hello */
    uint64_t frame_bytes;       /* maximum of the frames of all jobs */
    uint64_t transaction_bytes; /* memory of edits that are not answered */
    uint64_t last_number;
    bool stopping;
    uint64_t worker_of;                    /* auth_owner_number() of the process's owner; 0 may be root */
    uint64_t owner;                        /* number of the client that the daemon serves alone; 0: none */
    struct connection_limits owner_limits; /* limits of that client's connection */
    loop_call_fn *owner_gone,
        *emptied,     /* called when that client is gone, and when the last session ends; may be NULL */
        *device_gone, /* called when the engine's device is lost for good; may be NULL */
        *counted;     /* called when the number of introduced sessions has changed; may be NULL */
    void *call_context;

    struct others *others; /* the daemon's other workers */
    struct loop_watch *engine_watch;
    /* Commands that did not fit the engine's queue, in order. */
    struct engine_command *waiting, **waiting_end;
    size_t waiting_count;
    bool held; /* whether so many wait that nothing is read from clients */
    struct loop_timer retry_timer;
};

bool hub_init(struct hub *hub, struct loop *loop, const struct hub_options *options, struct error *error);
void hub_finish(struct hub *hub); /* requires that no session is left */

/* Adds a client; takes over the descriptor when it succeeds. `handover` has the bytes that were read already. */
bool hub_add_client(struct hub *hub, int fd, const struct handover *handover, struct error *error);
/* Says goodbye to all clients; `emptied` is called when they are gone, at once if there are none. */
void hub_stop(struct hub *hub);

/* Applies limits and keys to new requests and new clients; everything else stays. False: out of memory,
 * nothing is changed. */
bool hub_reload(struct hub *hub, const struct hub_options *options, struct error *error);

/* Submits a command to the engine, now or as soon as its queue has space. */
void hub_submit(struct hub *hub, struct engine_command *command);
/* Counts the edits of a client that is gone until the engine has forgotten the client. */
void hub_departed(struct hub *hub, uint64_t client, uint64_t transaction_bytes);
/* Asks the engine to evict scenes without a holder, as that many bytes for blobs are lacking. */
void hub_trim(struct hub *hub, uint64_t bytes);
/* Creates a command for a request of a session: zeroed except for kind, client and request. NULL: out of memory.
 */
struct engine_command *hub_command(enum engine_command_kind kind, uint64_t client, uint32_t request);

#endif
