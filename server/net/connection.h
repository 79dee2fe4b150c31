/* SPDX-License-Identifier: MIT */
/* Connection to a client: turns bytes into messages and messages into bytes, sealed or not, with limits of time
 * and memory. It knows the protocol's framing and handshake, not the meaning of messages. One thread, the loop's.
 *
 * A connection is destroyed by the loop at the end of a turn, never inside a call: after connection_close()
 * it still exists, silent, until the handler's closed() has returned. */
#ifndef FARLIGHT_NET_CONNECTION_H
#define FARLIGHT_NET_CONNECTION_H

#include "net/loop.h"
#include "net/out_queue.h"
#include "protocol/framing.h"
#include "protocol/handshake.h"
#include "protocol/sealed/link.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

struct connection_limits {
    uint32_t handshake_ms;         /* until the hello is complete */
    uint32_t wrong_key_ms;         /* delay of the answer to a wrong key */
    uint32_t progress_grace_ms;    /* time that any message may take; .. */
    uint32_t progress_bytes_per_s; /* .. after it, the minimum rate */
    uint32_t idle_ms;        /* silence of a client that waits for nothing, or that does not read; 0: no limit */
    uint32_t lost_ms;        /* silence of a client that waits for something, despite pings; 0: no limit */
    uint32_t queued_soft_ms; /* maximum time with more than queued_soft_bytes queued */
    uint64_t queued_soft_bytes; /* queued bytes above which nothing is read from the client */
    uint64_t queued_hard_bytes;
};

/* Conditions for accepting a client. */
struct connection_entry {
    uint64_t log_source;           /* source by which lines in the log are rate-limited */
    const uint32_t *sharers;       /* number of connections that share its turn; NULL: it has its own */
    const struct sealed_key *keys; /* the owner's; must outlive the connection */
    size_t key_count;
    bool sealed_only; /* a client without one of the keys is refused */
};

/* Callbacks to the layer above; `context` is that of connection_create(). */
struct connection_handler {
    /* Time until a client may begin a sealed connection; 0: now. Asked again after that time. */
    uint64_t (*seal_wait_ns)(void *context);
    void (*key_failed)(void *context);
    /* The client holds the key of that index; its hello is next. */
    void (*key_proved)(void *context, size_t index);
    /* NULL, or a replacement of hello(): another process will serve the client, and connection_save() hands it
     * over in its state before the hello. It waits until it is closed or refused (connection_refuse()). */
    void (*route)(void *context, const struct handshake_hello *hello);
    /* Fills the reply. False: the client is refused with reply->text. */
    bool (*hello)(void *context, const struct handshake_hello *hello, struct handshake_reply *reply);
    /* The hello was answered; messages may be sent. */
    void (*opened)(void *context);
    /* A message, valid in every field; lives until the call returns. */
    void (*message)(void *context, const struct framing_header *header, const struct message *message);
    /* A message with a valid frame and an invalid field. */
    void (*invalid)(void *context, const struct framing_header *header, const struct decode_error *error);
    /* Little bulk is queued: more can be queued now. */
    void (*room)(void *context);
    /* Whether the client waits for an answer or a frame: it may be silent as long as it answers pings. */
    bool (*awaited)(const void *context);
    /* The last call. The connection is freed when it returns. */
    void (*closed)(void *context);
};

enum connection_state {
    CONNECTION_HELLO,     /* waits for the client's first bytes */
    CONNECTION_WRONG_KEY, /* its refusal is delayed; nothing is read */
    CONNECTION_ROUTED,    /* another process will serve it; nothing is read */
    CONNECTION_OPEN,
    CONNECTION_FLUSHING,  /* goodbye is queued; nothing is read */
    CONNECTION_LINGERING, /* goodbye is sent; incoming bytes are read and dropped, so that the kernel delivers
                             it */
    CONNECTION_CLOSED,
};

struct connection {
    struct loop *loop;
    const struct connection_limits *limits;
    const struct connection_handler *handler;
    void *context;
    struct connection_entry entry;
    int fd;
    enum connection_state state;
    struct loop_watch *watch;
    struct loop_timer timer;
    struct loop_deferred turn_end;

    struct sealed_link *link; /* NULL: the connection is not sealed */
    uint64_t seal_due_ns;     /* time at which its sealed handshake may begin; 0: it need not wait */
    uint8_t *in;              /* in_capacity suits the largest message allowed in this state */
    size_t in_capacity, in_used;
    struct scratch scratch;
    void *scratch_data;
    bool held;                 /* the layer above accepts no messages at present */
    unsigned messages_left;    /* messages that it may pass on before other clients get their turn */
    bool write_blocked;        /* the kernel's buffer is full */
    uint64_t message_began_ns; /* beginning of the incomplete message at the start of `in`; 0: none */

    struct out_queue out;
    uint64_t over_soft_since_ns; /* 0: not over it */
    uint64_t closing_since_ns;

    uint64_t connected_ns, last_received_ns, last_sent_ns;
    uint64_t checked_ns; /* time of the last check whether a ping is due */
    unsigned unanswered; /* pings since the client was last heard */
    uint64_t received_bytes, sent_bytes;
};

/* A saved connection: the bytes read from it, to be passed on in their order. */
struct connection_saved {
    size_t in_bytes;   /* at the start of `bytes`: unsealed */
    size_t link_bytes; /* a saved link, after those; 0: not sealed */
    uint8_t *bytes;    /* malloc'ed */
    bool is_open;      /* its hello was answered */
};

/* Creates a connection; owns the descriptor (non-blocking) on success. `saved`: bytes that another process has
 * read from it, or NULL. */
struct connection *connection_create(struct loop *loop, int fd, const struct connection_limits *limits,
                                     const struct connection_entry *entry,
                                     const struct connection_handler *handler, void *context,
                                     const struct connection_saved *saved, struct error *error);
/* Saves a connection for another process: in the state CONNECTION_ROUTED, or if it is open and nothing is
 * queued. `message` was read from it already, and is to be read first; NULL: none. False: out of memory. */
bool connection_save(const struct connection *connection, const uint8_t *message, size_t message_bytes,
                     struct connection_saved *saved);
/* Refuses a client whose hello has arrived, with the reason, and closes. */
void connection_refuse(struct connection *connection, const char *text, uint64_t capabilities);

/* Sends a control message. False, with a line in the log: it cannot be encoded, or the connection is closing. */
bool connection_send(struct connection *connection, uint32_t request, uint32_t channel,
                     const struct message *message);
/* Sends a message that contains header and payload; owns it in any case. */
void connection_send_raw(struct connection *connection, struct out_message *message, bool bulk);
/* Announces that room() has something to queue. */
void connection_wake(struct connection *connection);
bool connection_wants_bulk(const struct connection *connection);
void connection_hold(struct connection *connection, bool held);
/* Bytes of an incomplete message. */
size_t connection_incoming_bytes(const struct connection *connection);

/* Sends goodbye, waits a moment for its delivery, closes. With an error code, ERROR on request 0 goes first.
 */
void connection_finish(struct connection *connection, enum protocol_error_code code, const char *field,
                       const char *text);
/* Closes without goodbye. */
void connection_close(struct connection *connection);

#endif
