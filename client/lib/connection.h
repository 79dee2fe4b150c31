/* SPDX-License-Identifier: MIT */
/* Inside of a connection, for the files of this folder. */
#ifndef FARLIGHT_CLIENT_LIB_CONNECTION_H
#define FARLIGHT_CLIENT_LIB_CONNECTION_H

#include "lib/process.h"
#include "lib/stream.h"
#include "protocol/handshake.h"

/* The channel of blob data; jobs have those above. */
#define FL_UPLOAD_CHANNEL 1u

/* A message without texts or arrays that did not fit into the buffer. */
struct fl_late {
    struct fl_late *next;
    uint32_t request;
    struct message message;
};

struct fl_receiver;
/* 1: the message was the receiver's; 0: it may be another's; -1: the connection is broken, *error says why. */
typedef int fl_take_fn(struct fl_receiver *receiver, const struct framing_header *header,
                       const struct message *message, struct fl_error *error);
/* A job, a view or a scene: messages may arrive for it at any time, also while another answer is awaited. */
struct fl_receiver {
    struct fl_receiver *next; /* of the connection's */
    fl_take_fn *take;
};

struct fl_connection {
    struct fl_stream stream;
    struct fl_process process; /* the private daemon or ssh */
    struct handshake_limits limits;
    int interrupt_fd;
    uint32_t last_request, last_scene, last_channel;
    uint64_t upload_credit;           /* the daemon's total for the upload channel */
    uint64_t upload_sent;             /* bytes of blob data sent on it so far */
    struct fl_receiver *receivers;    /* not owned */
    bool has_job, has_view;           /* one of each may run */
    struct fl_late *late, **late_end; /* owned: sent before everything else as soon as the buffer has space */
    bool read_only;                   /* the daemon lets it change nothing */
    bool can_h264;                    /* this client and the daemon */
    struct fl_error broken;           /* why the connection is broken; code NONE: it works */
    struct message_stats_reply stats; /* the last answer */
    uint64_t lost_after_ns;           /* of silence; 0: messages may not be sent yet */
    uint64_t silent_ns;               /* counted while we listen, at most a part of it at a time */
    uint64_t look_ns;                 /* when the next part of silence is over; UINT64_MAX: none is counted yet */
    uint64_t start_ns;
    bool local;
    bool said_goodbye;
    char address[300];
};

/* A received answer or message of a frame; valid until the next call on the connection. */
struct fl_received {
    struct framing_header header;
    struct message message;
};

/* Marks the connection as unusable, for reasons of the stream or the peer; adds what is known about a private
 * daemon's end. Returns false. */
bool fl_connection_break(struct fl_connection *connection, struct fl_error *error);
/* False, with the reason, if the connection is broken. */
bool fl_connection_check(const struct fl_connection *connection, struct fl_error *error);
uint32_t fl_connection_next_request(struct fl_connection *connection);

/* Sends one message and waits until the kernel has it. */
bool fl_connection_send(struct fl_connection *connection, uint32_t request, uint32_t channel,
                        const struct message *message, struct fl_error *error);
/* For messages that release something, which cannot be retried: sent now, or as soon as the buffer has space. The
 * message has no texts and no arrays. If there is no memory for it, the connection is marked as broken, as its end
 * releases everything. */
void fl_connection_send_late(struct fl_connection *connection, uint32_t request, const struct message *message);
/* Moves delayed messages to the stream as far as they fit. False: the connection is broken. */
bool fl_connection_push_late(struct fl_connection *connection, struct fl_error *error);
/* Until it is removed, the receiver is offered what is not for the connection itself. */
void fl_connection_add(struct fl_connection *connection, struct fl_receiver *receiver);
void fl_connection_remove(struct fl_connection *connection, struct fl_receiver *receiver);
/* Handles messages for the connection itself (ping, credit for uploads, blocked, goodbye, an error of request 0)
 * or a receiver: 1: handled; 0: it is for the caller; -1: the connection is broken, *error says why. */
int fl_connection_consume(struct fl_connection *connection, const struct framing_header *header,
                          const struct message *message, struct fl_error *error);
enum fl_step {
    FL_STEP_MESSAGE, /* for the caller */
    FL_STEP_SERVED,  /* bytes came or went, or a message was for the connection or a receiver */
    FL_STEP_FAILED
};
/* One message, or one round of waiting if there is none. */
enum fl_step fl_connection_step(struct fl_connection *connection, struct fl_received *received,
                                uint64_t deadline_ns, struct fl_error *error);
/* The next message that is for the caller. */
bool fl_connection_receive(struct fl_connection *connection, struct fl_received *received, uint64_t deadline_ns,
                           struct fl_error *error);
/* Serves the connection until the daemon lets `total` bytes in all be uploaded and a message fits into the buffer.
 * An ERROR that answers `request` is FL_ERROR_REFUSED; other messages are dropped. */
bool fl_connection_wait_upload(struct fl_connection *connection, uint32_t request, uint64_t total,
                               uint64_t deadline_ns, struct fl_error *error);
/* The answer to `request`; other messages are dropped. An ERROR is FL_ERROR_REFUSED. */
bool fl_connection_answer(struct fl_connection *connection, uint32_t request, enum message_type expected,
                          struct fl_received *received, uint64_t deadline_ns, struct fl_error *error);
/* Sends a question of one message and waits for its answer, for half a minute. */
bool fl_connection_ask(struct fl_connection *connection, const struct message *question,
                       enum message_type expected, struct fl_received *received, struct fl_error *error);
/* Ends a round of waiting, which lasts until connection->look_ns at most: pings a daemon that was not heard for a
 * while, which also keeps the daemon from disconnecting us for our silence. False: nothing was heard from it for
 * lost_after_ns, and the connection is broken. */
bool fl_connection_heed_silence(struct fl_connection *connection, struct fl_error *error);
/* The daemon's error as ours; returns false. */
bool fl_error_from_message(struct fl_error *error, const struct message_error *message);

#endif
