/* SPDX-License-Identifier: MIT */
/* What all sessions share: the loop, the engine, the blobs, the limits. */
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
    uint64_t started_ns;    /* when the daemon was */
    uint64_t first_client;  /* clients are numbered from the next one on */
    bool owner_may_be_idle; /* the client of daemon_serve_fd() is not disconnected for its silence */
    struct engine_port engine;
    struct timeline *timeline;          /* hears of every frame that was sent; may be NULL */
    struct engine_limits engine_limits; /* as the engine has them; told to clients */
    uint64_t device_bytes;              /* likewise; 0: no limit */
    struct auth_key_numbers keys;       /* that the daemon knows; clients with another one go */
};

struct hub {
    struct loop *loop;
    struct hub_options options;
    struct blob_store *blobs;
    struct hasher *hasher;   /* NULL: the network thread hashes itself */
    struct hashmap sessions; /* struct session *, by number */
    struct hashmap departed; /* bytes of edits, by number: clients that are gone and that the engine still knows */
    uint32_t introduced;     /* sessions whose hello is done */
    uint64_t frame_bytes;    /* maximum of the frames of all jobs */
    uint64_t transaction_bytes; /* of edits that are not answered */
    uint64_t last_number;
    bool stopping;
    uint64_t worker_of;                    /* auth_owner_number() of whose process this is; 0 may be root */
    uint64_t owner;                        /* number of the client that the daemon serves alone; 0: none */
    struct connection_limits owner_limits; /* of that one */
    loop_call_fn *owner_gone,
        *emptied,     /* called when that client is gone, and when the last session is; may be NULL */
        *device_gone, /* the engine's device is lost for good; may be NULL */
        *counted;     /* there are more or fewer introduced sessions; may be NULL */
    void *call_context;

    struct others *others; /* the daemon's other workers */
    struct loop_watch *engine_watch;
    /* Commands that did not fit the engine's queue, in order. */
    struct engine_command *waiting, **waiting_end;
    size_t waiting_count;
    bool held; /* so many that clients are not read from */
    struct loop_timer retry_timer;
};

bool hub_init(struct hub *hub, struct loop *loop, const struct hub_options *options, struct error *error);
void hub_finish(struct hub *hub); /* all sessions are gone */

/* A new client; takes over the descriptor when it succeeds. Of `handover` without bytes nothing was read yet. */
bool hub_add_client(struct hub *hub, int fd, const struct handover *handover, struct error *error);
/* Says goodbye to all clients; `emptied` is called when they are gone, at once if there are none. */
void hub_stop(struct hub *hub);

/* Applies limits and keys to new requests and new clients; everything else stays. False: out of memory,
 * nothing is changed. */
bool hub_reload(struct hub *hub, const struct hub_options *options, struct error *error);

/* Submits a command to the engine, now or as soon as its queue has space. */
void hub_submit(struct hub *hub, struct engine_command *command);
/* A client is gone whose edits the engine may hold until it has forgotten the client. */
void hub_departed(struct hub *hub, uint64_t client, uint64_t transaction_bytes);
/* That many bytes for blobs are lacking: evicts scenes without a holder. */
void hub_trim(struct hub *hub, uint64_t bytes);
/* The same for one of a session's requests: zeroed but for kind, client and request. NULL: out of memory. */
struct engine_command *hub_command(enum engine_command_kind kind, uint64_t client, uint32_t request);

#endif
